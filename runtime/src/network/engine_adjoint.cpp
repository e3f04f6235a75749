// SPDX-License-Identifier: Apache-2.0
// Reverse mode: from the adjoint of each result to those of its inputs, starting with the last layer.
#include <algorithm>

#include "network/engine.h"
#include "network/engine_rows.h"
#include "network/layers.h"
#include "network/padding.h"

namespace dpde::nn {

template <class Real>
void Engine<Real>::adjoint(const Ports& ports, void* const* inputs, void* const* seeds, void* const* input_bars,
                           double* weight_bars) {
  now_ = memory_.data();
  load(ports, inputs, value_view(0));
  if (find_tape()) {
    read_from_->release(now_);  // its values stay valid until the next run is stored
  } else {
    run(true);
  }
  begin_reverse();
  find_needs(input_bars, weight_bars != nullptr);
  const size_t last = plan_.values.size() - 1;
  load(ports, seeds, adjoint_view(last));
  std::fill(written_.begin(), written_.end(), 0);
  written_[last] = 1;
  for (size_t k = plan_.steps.size(); k-- > 0;) {
    if (plan_.steps[k].live && needed_[k + 1] && written_[k + 1]) adjoint_step(k, weight_bars);
  }
  if (input_bars == nullptr || !needed_[0]) return;
  if (!written_[0]) clear_cells(team_, adjoint_view(0));
  store(ports, adjoint_view(0), input_bars);
}

/// Packs the weights for reverse runs.
template <class Real>
void Engine<Real>::begin_reverse() {
  if (reverse_packed_) return;
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Convolution& convolution = plan_.steps[k].convolution;
    for (size_t phase = 0; phase < convolution.reverse.size(); ++phase)
      pack(convolution.reverse[phase], weights_.data(), packed_[k].reverse[phase]);
  }
  reverse_packed_ = true;
}

/// Finds the adjoints that are needed for a weight's gradient or for a wanted adjoint of an input.
template <class Real>
void Engine<Real>::find_needs(void* const* input_bars, bool weights) {
  needed_[0] = 0;
  for (int32_t channel = 0; channel < plan_.network.inputs; ++channel) {
    if (input_bars != nullptr && input_bars[channel] != nullptr) needed_[0] = 1;
  }
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Step& step = plan_.steps[k];
    needed_[k + 1] = needed_[static_cast<size_t>(step.layer.input)];
    if (joins(step) && needed_[static_cast<size_t>(step.layer.other)]) needed_[k + 1] = 1;
    if (step.layer.kind == DPDE_CONV && weights) needed_[k + 1] = 1;
  }
}

/// Returns whether the adjoint of a value already has contents, to which the caller must add.
template <class Real>
bool Engine<Real>::begin_adjoint(size_t value) {
  const bool add = written_[value];
  written_[value] = 1;
  return add;
}

/// The adjoint of a value for code that can only add: cleared on first use.
template <class Real>
View<Real> Engine<Real>::added_to(size_t value) {
  const View<Real> view = adjoint_view(value);
  if (!begin_adjoint(value)) clear_cells(team_, view);
  return view;
}

template <class Real>
void Engine<Real>::adjoint_step(size_t k, double* weight_bars) {
  const dpde_layer& layer = plan_.steps[k].layer;
  if (layer.kind == DPDE_CONV) return adjoint_convolution(k, weight_bars);
  switch (layer.kind) {
    case DPDE_ACTIVATE:
    case DPDE_SCALE: return adjoint_activation(k);
    case DPDE_ADD:
    case DPDE_CONCAT: return adjoint_sum(k);
    default: return adjoint_pool(k);
  }
}

template <class Real>
void Engine<Real>::adjoint_convolution(size_t k, double* weight_bars) {
  const Step& step = plan_.steps[k];
  const View<Real> seeds = adjoint_view(k + 1);
  clear_margins(seeds);
  const auto input = static_cast<size_t>(step.layer.input);
  if (weight_bars != nullptr) {
    const View<Real> source = read_by(step, value_view(input));
    add_weight_gradient(team_, step.convolution.forward, source, seeds, weight_bars + step.layer.weights);
    if (step.layer.bias >= 0) add_bias_gradient(step, seeds, weight_bars);
  }
  adjoint_of_input(k, seeds, packed_[k].reverse);
}

template <class Real>
void Engine<Real>::clear_margins(const View<Real>& seeds) {
  const int64_t margins = seeds.shape->plane * seeds.shape->channels / 4;
  parallel(team_, seeds.shape->channels, margins,
           [&](int64_t channel) { clear_margin(*seeds.shape, seeds.plane(channel)); });
}

template <class Real>
void Engine<Real>::adjoint_of_input(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights) {
  const Step& step = plan_.steps[k];
  if (!needed_[static_cast<size_t>(step.layer.input)]) return;
  if (step.convolution.phased) return adjoint_of_phases(k, seeds, weights);
  adjoint_of_read(k, seeds, weights);
}

template <class Real>
void Engine<Real>::add_bias_gradient(const Step& step, const View<Real>& seeds, double* weight_bars) {
  const Shape& shape = *seeds.shape;
  parallel(team_, shape.channels, shape.channels * shape.rows() * shape.cells[0] / 10, [&](int64_t channel) {
    double sum = 0;
    for (int64_t row = 0; row < shape.rows(); ++row)
      sum += static_cast<double>(kernels_.sum(seeds.row(channel, row), shape.cells[0]));
    weight_bars[step.layer.bias + channel] += sum;
  });
}

/// On periodic axes the seeds repeat beyond the ends. On others they end there, and the adjoints of a margin are added
/// to the cells that it repeats.
template <class Real>
void Engine<Real>::adjoint_of_read(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights) {
  const Step& step = plan_.steps[k];
  const auto input = static_cast<size_t>(step.layer.input);
  const View<Real> bars = adjoint_view(input);
  const auto each_channel = [&](const View<Real>& view, const auto& f) {
    parallel(team_, view.shape->channels,
             (view.shape->plane - view.shape->rows() * view.shape->cells[0]) * view.shape->channels / 4, f);
  };
  each_channel(seeds, [&](int64_t channel) { fill_margin(*seeds.shape, seeds.plane(channel)); });
  const Axes& reach = step.convolution.reach;
  Range range = whole(plan_.values[input]);
  bool is_larger = false;
  for (size_t axis = 0; axis < 3; ++axis) {
    if (!folds(plan_.padding[axis]) || reach[axis] == 0) continue;
    is_larger = true;
    range.first[axis] = -reach[axis];
    range.cells[axis] += 2 * reach[axis];
  }
  Ends<Real> ends;
  if (begin_adjoint(input)) ends.base = bars;
  if (ends.base.data && is_larger)
    each_channel(bars, [&](int64_t channel) { clear_margin(*bars.shape, bars.plane(channel)); });
  convolve(team_, step.convolution.reverse[0], weights[0], seeds, {bars}, range, ends);
  if (is_larger)
    each_channel(bars, [&](int64_t channel) { fold_margin(*bars.shape, plan_.padding, reach, bars.plane(channel)); });
}

template <class Real>
void Engine<Real>::adjoint_of_phases(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights) {
  const Convolution& convolution = plan_.steps[k].convolution;
  const View<Real> phases{phases_bar_ + convolution.phases.origin, &convolution.phases};
  Range range = whole(plan_.values[k + 1]);
  for (size_t axis = 0; axis < 3; ++axis) {
    range.first[axis] = -convolution.reach[axis];
    range.cells[axis] += 2 * convolution.reach[axis];
  }
  for (int64_t phase = 0; phase < convolution.phase_count; ++phase) {
    const auto number = static_cast<size_t>(phase);
    convolve(team_, convolution.reverse[number], weights[number], seeds, {phases, phase, convolution.phase_count},
             range, {});
  }
  add_phases_adjoint(team_, convolution, phases, added_to(static_cast<size_t>(plan_.steps[k].layer.input)));
}

/// For an activation or a scale: both multiply each adjoint.
template <class Real>
void Engine<Real>::adjoint_activation(size_t k) {
  const Step& step = plan_.steps[k];
  const dpde_layer& layer = step.layer;
  const auto input = static_cast<size_t>(layer.input);
  if (!needed_[input]) return;
  const View<Real> seeds = adjoint_view(k + 1), bars = adjoint_view(input);
  const bool add = begin_adjoint(input), of_result = !plan_.values[input].kept;
  const View<Real> at = value_view(of_result ? k + 1 : input);
  const auto rate = of_result ? kernels_.rate_of_result : kernels_.activation_rate;
  const auto factor = static_cast<Real>(layer.factor);
  for_each_row_of(team_, *at.shape, 4, [&](int64_t channel, int64_t row) {
    Real* const to = bars.row(channel, row);
    const Real* const from = seeds.row(channel, row);
    if (layer.kind == DPDE_SCALE) return kernels_.scale(factor, from, to, add, at.shape->cells[0]);
    rate(layer.activation, factor, at.row(channel, row), from, to, add, at.shape->cells[0]);
  });
}

template <class Real>
void Engine<Real>::adjoint_sum(size_t k) {
  const Step& step = plan_.steps[k];
  const dpde_layer& layer = step.layer;
  const View<Real> seeds = adjoint_view(k + 1);
  int64_t first = 0;
  for (const int32_t number : {layer.input, layer.other}) {
    const auto value = static_cast<size_t>(number);
    const int64_t channels = plan_.values[value].channels;
    if (number == step.merged) {
      written_[value] = 1;
    } else if (needed_[value]) {
      copy_channels(team_, seeds, first, adjoint_view(value), 0, channels, begin_adjoint(value));
    }
    if (layer.kind == DPDE_CONCAT) first += channels;
  }
}

template <class Real>
void Engine<Real>::adjoint_pool(size_t k) {
  const dpde_layer& layer = plan_.steps[k].layer;
  const auto input = static_cast<size_t>(layer.input);
  if (!needed_[input]) return;
  const View<Real> seeds = adjoint_view(k + 1);
  switch (layer.kind) {
    case DPDE_MEAN_POOL: return add_mean_pool_adjoint(team_, layer.stride, seeds, added_to(input));
    case DPDE_MAX_POOL: return add_max_pool_adjoint(team_, layer.stride, value_view(input), seeds, added_to(input));
    case DPDE_UPSAMPLE: return add_upsample_adjoint(team_, layer.stride, seeds, added_to(input));
    case DPDE_REORIENT: return reorient_back(team_, plan_.steps[k], seeds, adjoint_view(input), begin_adjoint(input));
    default: return fix_sum(team_, Real(0), seeds, adjoint_view(input), begin_adjoint(input));
  }
}

template class Engine<float>;
template class Engine<double>;

}  // namespace dpde::nn
