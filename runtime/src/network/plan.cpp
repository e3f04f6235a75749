// SPDX-License-Identifier: Apache-2.0
#include "network/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "base/aligned_memory.h"
#include "dpde/runtime/error.h"
#include "network/kernels/convolution_plan.h"

namespace dpde::nn {
namespace {

/// Refuses invalid networks. The compiler makes none, other users of the runtime might.
class Checks {
 public:
  explicit Checks(const dpde_network& network) : network_(network) {}

  void check(bool holds, const std::string& problem) const {
    if (!holds)
      throw Error(ErrorKind::input, fmt::format("the network `{}` {}", network_.name ? network_.name : "", problem));
  }

  void whole(const dpde_layout& layout) const {
    check(network_.rank == layout.rank, fmt::format("has {} axes, the grid {}", network_.rank, layout.rank));
    check(network_.real == DPDE_F32 || network_.real == DPDE_F64, "has values of an unknown kind");
    check(network_.inputs >= 1 && network_.outputs >= 1, "has no inputs or no outputs");
    check(network_.layer_count >= 0 && network_.weight_count >= 0, "has a negative number of layers or weights");
    for (int axis = 0; axis < network_.rank; ++axis) {
      check(network_.padding[axis] >= DPDE_PAD_PERIODIC && network_.padding[axis] <= DPDE_PAD_REFLECT,
            "has a padding that does not exist");
    }
  }

  void layer(int number, const std::vector<Value>& values) const {
    const dpde_layer& layer = network_.layers[number];
    const auto says = [&](bool holds, const std::string& problem) {
      check(holds, fmt::format("has a layer {} that {}", number + 1, problem));
    };
    const auto exists = [&](int32_t value) { return value >= 0 && value <= number; };
    says(layer.kind >= DPDE_CONV && layer.kind <= DPDE_REORIENT, "is of an unknown kind");
    says(exists(layer.input), "reads a value that is not there yet");
    const Value& input = values[static_cast<size_t>(layer.input)];
    if (layer.kind == DPDE_ADD || layer.kind == DPDE_CONCAT) {
      says(exists(layer.other), "reads a value that is not there yet");
      const Value& other = values[static_cast<size_t>(layer.other)];
      says(input.level == other.level,
           fmt::format("joins values of grids coarser by {} and by {}", input.level, other.level));
      const bool concat = layer.kind == DPDE_CONCAT;
      says(concat || input.channels == other.channels,
           fmt::format("adds {} and {} channels", input.channels, other.channels));
      says(layer.channels == input.channels + (concat ? other.channels : 0), "has a wrong number of channels");
    } else if (layer.kind == DPDE_CONV) {
      says(layer.extent >= 1 && layer.extent % 2 == 1, "has an extent that is not odd");
      says(layer.stride >= 1 && layer.dilation >= 1 && layer.groups >= 1 && layer.channels >= 1,
           "has a number below 1");
      says(input.channels % layer.groups == 0 && layer.channels % layer.groups == 0,
           "has channels that its groups do not divide");
      int64_t count = input.channels / layer.groups * layer.channels;
      for (int axis = 0; axis < network_.rank; ++axis) count *= layer.extent;
      says(layer.weights >= 0 && layer.weights + count <= network_.weight_count, "has weights that are not there");
      says(layer.bias < 0 || layer.bias + layer.channels <= network_.weight_count, "has biases that are not there");
    } else {
      says(layer.channels == input.channels, "changes the number of channels");
      says(layer.kind < DPDE_MEAN_POOL || layer.kind > DPDE_UPSAMPLE || layer.stride >= 1, "has a stride below 1");
      says(layer.kind != DPDE_ACTIVATE || (layer.activation >= DPDE_RELU && layer.activation <= DPDE_SILU),
           "is an unknown activation");
      says(layer.kind != DPDE_UPSAMPLE || input.level % layer.stride == 0,
           fmt::format("makes a grid that is coarser by {} finer by {}", input.level, layer.stride));
      if (layer.kind == DPDE_REORIENT) orientation(number, input);
    }
  }

  /// Axes and channels are permuted; exchanged axes have equal lengths.
  void orientation(int number, const Value& input) const {
    const dpde_layer& layer = network_.layers[number];
    const auto fits = [&](bool holds) {
      check(holds, fmt::format("has a layer {} that exchanges what does not fit", number + 1));
    };
    std::array<bool, 3> seen{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t from = std::abs(layer.axes[axis]) - 1, own = static_cast<int32_t>(axis);
      fits(from >= 0 && from < 3 && !seen[static_cast<size_t>(from)] &&
           (own < network_.rank ? from < network_.rank : layer.axes[axis] == own + 1));
      seen[static_cast<size_t>(from)] = true;
      fits(input.cells[axis] == input.cells[static_cast<size_t>(from)]);
    }
    std::vector<bool> taken(static_cast<size_t>(input.channels));
    for (int32_t channel = 0; layer.order != nullptr && channel < layer.channels; ++channel) {
      const int64_t from = std::abs(int64_t{layer.order[channel]}) - 1;
      fits(from >= 0 && from < input.channels && !taken[static_cast<size_t>(from)]);
      taken[static_cast<size_t>(from)] = true;
    }
  }

 private:
  const dpde_network& network_;
};

bool coarsens(int32_t kind) { return kind == DPDE_CONV || kind == DPDE_MEAN_POOL || kind == DPDE_MAX_POOL; }

Value value_of(const dpde_layer& layer, const Value& input, const dpde_layout& layout) {
  Value value;
  value.channels = layer.channels;
  value.level = coarsens(layer.kind)          ? input.level * layer.stride
                : layer.kind == DPDE_UPSAMPLE ? input.level / layer.stride
                                              : input.level;
  for (size_t axis = 0; axis < 3; ++axis) {
    value.cells[axis] =
        static_cast<int32_t>(axis) < layout.rank ? (layout.cells[axis] + value.level - 1) / value.level : 1;
  }
  return value;
}

bool reads_other(const dpde_layer& layer) { return layer.kind == DPDE_ADD || layer.kind == DPDE_CONCAT; }

void find_readers(Plan& plan) {
  std::vector<bool> needed(plan.values.size(), false);
  needed.back() = true;
  for (size_t k = plan.steps.size(); k-- > 0;) {
    Step& step = plan.steps[k];
    step.live = needed[k + 1];
    if (!step.live) continue;
    const auto read = [&](int32_t number) {
      Value& value = plan.values[static_cast<size_t>(number)];
      needed[static_cast<size_t>(number)] = true;
      ++value.readers;
      value.reader = static_cast<int32_t>(k);
    };
    read(step.layer.input);
    if (reads_other(step.layer)) read(step.layer.other);
  }
}

/// The only step that reads a value; null: none, or several.
Step* only_reader(Plan& plan, size_t value) {
  const Value& read = plan.values[value];
  return read.readers == 1 ? &plan.steps[static_cast<size_t>(read.reader)] : nullptr;
}

/// Fuses a convolution with an addition after it, whose other operand starts the sums, and with an activation after
/// that.
void fuse(Plan& plan, size_t k) {
  Step& conv = plan.steps[k];
  size_t result = k + 1;
  Step* reader = only_reader(plan, result);
  if (reader != nullptr && reader->layer.kind == DPDE_ADD) {
    const int32_t own = static_cast<int32_t>(result),
                  other = reader->layer.input == own ? reader->layer.other : reader->layer.input;
    if (other < own) {
      conv.base = other;
      reader->merged = own;
      reader->done = reader->done_kept = true;
      plan.values[result].kept = false;
      result = static_cast<size_t>(plan.values[result].reader) + 1;
      reader = only_reader(plan, result);
    }
  }
  if (reader == nullptr || reader->layer.kind != DPDE_ACTIVATE) return;
  conv.activation = plan.values[result].reader;
  reader->done = true;
  reader->done_kept = Plan::result_tells(reader->layer);
  plan.values[result].kept = !reader->done_kept;
}

void find_what_goes_together(Plan& plan) {
  for (size_t k = 0; k < plan.steps.size(); ++k) {
    if (plan.steps[k].live && plan.steps[k].layer.kind == DPDE_CONV) fuse(plan, k);
  }
  for (size_t v = plan.values.size(); v-- > 0;) {
    Value& value = plan.values[v];
    value.root = static_cast<int32_t>(v);
    const Step* reader = only_reader(plan, v);
    if (reader == nullptr) continue;
    const bool in_place =
        reader->layer.kind == DPDE_ACTIVATE || reader->layer.kind == DPDE_SCALE || reader->merged == value.root;
    if (in_place) value.root = plan.values[static_cast<size_t>(value.reader) + 1].root;
  }
}

void make_larger(Axes& margin, const Axes& other) {
  for (size_t axis = 0; axis < 3; ++axis) margin[axis] = std::max(margin[axis], other[axis]);
}

void make_shapes(Plan& plan) {
  const int64_t line = line_bytes / (plan.network.real == DPDE_F32 ? 4 : 8);
  std::vector<Axes> margin(plan.values.size()), adjoint(plan.values.size());
  for (size_t k = 0; k < plan.steps.size(); ++k) {
    Step& step = plan.steps[k];
    if (!step.live || step.layer.kind != DPDE_CONV) continue;
    const auto input = static_cast<size_t>(step.layer.input);
    set_reach(step.convolution, step.layer, plan.network.rank);
    const Axes& reach = step.convolution.reach;
    Axes written{}, read = reach;
    for (size_t axis = 0; axis < 3; ++axis) {
      const bool folds = plan.padding[axis] == DPDE_PAD_REPLICATE || plan.padding[axis] == DPDE_PAD_REFLECT;
      if (folds && !step.convolution.phased) written[axis] = reach[axis];
      if (folds || step.convolution.phased) read[axis] = 2 * reach[axis];
    }
    if (!step.convolution.phased) make_larger(margin[input], reach);
    make_larger(adjoint[static_cast<size_t>(plan.values[input].root)], written);
    make_larger(adjoint[static_cast<size_t>(plan.values[k + 1].root)], read);
  }
  std::array<int32_t, 3> periodic{};
  for (size_t axis = 0; axis < 3; ++axis)
    periodic[axis] = plan.padding[axis] == DPDE_PAD_PERIODIC ? DPDE_PAD_PERIODIC : DPDE_PAD_ZERO;
  for (size_t v = 0; v < plan.values.size(); ++v) {
    Value& value = plan.values[v];
    value.shape = make_shape(value.channels, value.cells, margin[v], plan.padding, line);
    value.adjoint = make_shape(value.channels, value.cells, adjoint[static_cast<size_t>(value.root)], periodic, line);
  }
}

}  // namespace

bool Plan::result_tells(const dpde_layer& layer) {
  switch (layer.activation) {
    case DPDE_RELU:
    case DPDE_TANH:
    case DPDE_SIGMOID: return true;
    case DPDE_LEAKY_RELU: return layer.factor >= 0 && layer.factor <= 1;
    default: return false;
  }
}

Plan make_plan(const dpde_network& network, const dpde_layout& layout, int64_t widest_block) {
  const Checks checks(network);
  checks.whole(layout);
  Plan plan;
  plan.network = network;
  plan.layout = layout;
  for (size_t axis = 0; axis < 3; ++axis)
    plan.padding[axis] = static_cast<int32_t>(axis) < network.rank ? network.padding[axis] : DPDE_PAD_ZERO;
  dpde_layer input{};
  input.kind = DPDE_SCALE;
  input.channels = network.inputs;
  plan.values.push_back(value_of(input, Value{}, layout));
  for (int number = 0; number < network.layer_count; ++number) {
    checks.layer(number, plan.values);
    Step step;
    step.layer = network.layers[number];
    if (step.layer.kind == DPDE_REORIENT && step.layer.order != nullptr)
      step.order.assign(step.layer.order, step.layer.order + step.layer.channels);
    step.layer.order = nullptr;
    plan.values.push_back(value_of(step.layer, plan.values[static_cast<size_t>(step.layer.input)], layout));
    plan.steps.push_back(step);
  }
  const Value& last = plan.values.back();
  checks.check(last.channels == network.outputs,
               fmt::format("ends with {} channels and has {} outputs", last.channels, network.outputs));
  checks.check(last.level == 1, fmt::format("ends on a grid that is coarser by {}", last.level));
  find_readers(plan);
  find_what_goes_together(plan);
  make_shapes(plan);
  for (size_t k = 0; k < plan.steps.size(); ++k) {
    Step& step = plan.steps[k];
    if (step.live && step.layer.kind == DPDE_CONV) plan_convolution(plan, step, plan.values[k + 1], widest_block);
  }
  return plan;
}

}  // namespace dpde::nn
