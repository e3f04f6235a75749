// SPDX-License-Identifier: Apache-2.0
#include "network/engine.h"

#include <algorithm>
#include <cstring>

#include "base/aligned_memory.h"
#include "network/engine_rows.h"
#include "network/layers.h"
#include "network/padding.h"

namespace dpde::nn {
namespace {

/// Calls `f(field pointer, index in the row of the plane, count)` for pieces of rows that are contiguous in both.
template <class Field, class Real, class F>
void for_each_piece(const Ports& ports, Field* field, const Shape& shape, Real* plane, const F& f) {
  const dpde_layout& layout = *ports.layout;
  for (int64_t done = 0; done < ports.count;) {
    const int64_t cell = ports.first + done, x = cell % layout.cells[0], row = cell / layout.cells[0];
    const int64_t own_x = done % shape.cells[0],
                  count = std::min({layout.cells[0] - x, shape.cells[0] - own_x, ports.count - done});
    f(field + index_of(layout, x, row % layout.cells[1], row / layout.cells[1]),
      plane + shape.row(done / shape.cells[0]) + own_x, count);
    done += count;
  }
}

}  // namespace

template <class Real>
Engine<Real>::Engine(const Plan& plan, const Team& team) : plan_(plan), team_(team), kernels_(kernels<Real>()) {
  const size_t count = plan_.values.size();
  places_.resize(count);
  roots_.resize(count);
  margin_read_.resize(count);
  needed_.resize(count);
  written_.resize(count);
  packed_.resize(plan_.steps.size());
  weights_.resize(static_cast<size_t>(plan_.network.weight_count));
  for (const Step& step : plan_.steps) {
    if (step.live && step.layer.kind == DPDE_CONV && !step.convolution.phased)
      margin_read_[static_cast<size_t>(step.layer.input)] = 1;
  }
  lay_out(false);
  bytes_ = used_;
  memory_ = Buffer(bytes_);
  lay_out(true);
  now_ = memory_.data();
}

/// Multiplications of a forward run.
template <class Real>
int64_t Engine<Real>::products() const {
  int64_t count = 0;
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Shape& result = plan_.values[k + 1].shape;
    if (plan_.steps[k].live)
      count += static_cast<int64_t>(plan_.steps[k].convolution.forward.offsets.size()) * result.channels *
               result.rows() * result.cells[0];
  }
  return count;
}

template <class Real>
Real* Engine<Real>::take(char* memory, int64_t count) {
  Real* const result = memory != nullptr ? reinterpret_cast<Real*>(memory + used_) : nullptr;
  used_ += (count * static_cast<int64_t>(sizeof(Real)) + line_bytes - 1) / line_bytes * line_bytes;
  return result;
}

/// Called twice: first to count the memory, then to assign it.
template <class Real>
void Engine<Real>::lay_out(bool place) {
  char* const memory = place ? memory_.data() : nullptr;
  used_ = 0;
  const auto is_live = [&](size_t v) { return v == 0 || plan_.steps[v - 1].live; };
  for (size_t v = 0; v < plan_.values.size(); ++v) {
    const Value& value = plan_.values[v];
    if (!is_live(v) || !value.kept) continue;
    places_[v] = used_ / static_cast<int64_t>(sizeof(Real)) + value.shape.origin;
    take(memory, value.shape.size);
  }
  value_bytes_ = used_;
  for (size_t v = 0; v < plan_.values.size(); ++v) {
    const Value& value = plan_.values[v];
    if (!is_live(v)) continue;
    if (value.root == static_cast<int32_t>(v)) roots_[v] = take(memory, std::max(value.shape.size, value.adjoint.size));
  }
  int64_t phases = 0;
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Convolution& convolution = plan_.steps[k].convolution;
    const auto size = [](const Product& product) { return static_cast<int64_t>(product.weights.size()); };
    Packed& packed = packed_[k];
    packed.forward = take(memory, size(convolution.forward));
    packed.rates = take(memory, size(convolution.forward));
    packed.bias = take(memory, plan_.steps[k].layer.channels);
    packed.bias_rates = take(memory, plan_.steps[k].layer.channels);
    packed.reverse.resize(convolution.reverse.size());
    for (size_t phase = 0; phase < packed.reverse.size(); ++phase)
      packed.reverse[phase] = take(memory, size(convolution.reverse[phase]));
    if (convolution.phased) phases = std::max(phases, convolution.phases.size);
  }
  phases_ = take(memory, phases);
  phases_bar_ = take(memory, phases);
}

template <class Real>
View<Real> Engine<Real>::rate_view(size_t value) const {
  if (has_own_rates_) return {own_rates_[value] + plan_.values[value].shape.origin, &plan_.values[value].shape};
  const auto root = static_cast<size_t>(plan_.values[value].root);
  const Shape& shape = plan_.values[root].shape;
  return {roots_[root] + shape.origin, &shape};
}

template <class Real>
View<Real> Engine<Real>::adjoint_view(size_t value) const {
  const auto root = static_cast<size_t>(plan_.values[value].root);
  const Shape& shape = plan_.values[root].adjoint;
  return {roots_[root] + shape.origin, &shape};
}

template <class Real>
bool Engine<Real>::set_weights(const double* weights) {
  if (weights_.empty() || std::memcmp(weights, weights_.data(), weights_.size() * sizeof(double)) == 0)
    return false;  // initially all are 0
  std::copy_n(weights, weights_.size(), weights_.begin());
  for (size_t k = 0; k < plan_.steps.size(); ++k) {
    const Step& step = plan_.steps[k];
    if (!step.live || step.layer.kind != DPDE_CONV) continue;
    pack(step.convolution.forward, weights_.data(), packed_[k].forward);
    if (step.layer.bias < 0) continue;
    std::transform(weights + step.layer.bias, weights + step.layer.bias + step.layer.channels, packed_[k].bias,
                   [](double value) { return static_cast<Real>(value); });
  }
  reverse_packed_ = false;
  return true;
}

template <class Real>
void Engine<Real>::load(const Ports& ports, void* const* fields, const View<Real>& view) {
  const Shape& shape = *view.shape;
  const int64_t cells = shape.rows() * shape.cells[0];
  parallel(team_, shape.channels, shape.channels * cells / 4, [&](int64_t channel) {
    Real* const plane = view.plane(channel);
    void* const field = fields ? fields[channel] : nullptr;
    if (field == nullptr || ports.count < cells) {
      for (int64_t number = 0; number < shape.rows(); ++number)
        std::fill_n(plane + shape.row(number), shape.cells[0], Real(0));
    }
    if (field == nullptr) return;
    with_field(ports.layout->real, field, [&](const auto* base) {
      for_each_piece(ports, base, shape, plane, [](const auto* from, Real* to, int64_t count) {
        for (int64_t x = 0; x < count; ++x) to[x] = static_cast<Real>(from[x]);
      });
    });
  });
}

template <class Real>
void Engine<Real>::store(const Ports& ports, const View<Real>& view, void* const* fields) {
  const Shape& shape = *view.shape;
  parallel(team_, shape.channels, shape.channels * shape.rows() * shape.cells[0] / 4, [&](int64_t channel) {
    if (fields[channel] == nullptr) return;
    with_field(ports.layout->real, fields[channel], [&](auto* base) {
      for_each_piece(ports, base, shape, view.plane(channel), [](auto* to, const Real* from, int64_t count) {
        for (int64_t x = 0; x < count; ++x) to[x] = static_cast<std::remove_reference_t<decltype(*to)>>(from[x]);
      });
    });
  });
}

/// Fills the margins of a value (or of its rates), once its cells are complete.
template <class Real>
void Engine<Real>::finish(size_t value, const View<Real>& view) {
  if (!margin_read_[value]) return;
  const Shape& shape = *view.shape;
  const int64_t margins = shape.plane - shape.rows() * shape.cells[0];
  parallel(team_, shape.channels, shape.channels * margins / 4,
           [&](int64_t channel) { fill_margin(shape, view.plane(channel)); });
}

template <class Real>
void Engine<Real>::value(const Ports& ports, void* const* inputs, void* const* outputs) {
  const bool keeps = written_to_ != nullptr && written_to_->is_recording();
  now_ = keeps ? written_to_->take() : memory_.data();
  load(ports, inputs, value_view(0));
  if (!find_tape()) run(keeps);
  store(ports, value_view(plan_.values.size() - 1), outputs);
}

/// Looks for a tape with the loaded inputs; if found, its values become the present run.
template <class Real>
bool Engine<Real>::find_tape() {
  char* const tape =
      read_from_ == nullptr ? nullptr : read_from_->find([&](const char* run) { return has_input(run); });
  if (tape != nullptr) now_ = tape;
  return tape != nullptr;
}

/// Compares bit by bit. Different inputs mostly differ in the first cells.
template <class Real>
bool Engine<Real>::has_input(const char* tape) const {
  const Shape& shape = plan_.values[0].shape;
  const View<Real> own = value_view(0), other{reinterpret_cast<Real*>(const_cast<char*>(tape)) + places_[0], &shape};
  for (int64_t channel = 0; channel < shape.channels; ++channel) {
    for (int64_t row = 0; row < shape.rows(); ++row) {
      if (std::memcmp(own.row(channel, row), other.row(channel, row),
                      static_cast<size_t>(shape.cells[0]) * sizeof(Real)) != 0)
        return false;
    }
  }
  return true;
}

/// `keep`: stores everything that derivatives need.
template <class Real>
void Engine<Real>::run(bool keep) {
  finish(0, value_view(0));
  for (size_t k = 0; k < plan_.steps.size(); ++k) run_step(k, keep);
}

template <class Real>
void Engine<Real>::run_step(size_t k, bool keep) {
  const Step& step = plan_.steps[k];
  if (!step.live) return;
  if (step.layer.kind == DPDE_CONV) return run_convolution(k, keep);
  if (keep ? step.done_kept : step.done) return;
  const View<Real> input = value_view(static_cast<size_t>(step.layer.input));
  run_layer(step, input, joins(step) ? value_view(static_cast<size_t>(step.layer.other)) : View<Real>{},
            value_view(k + 1));
  finish(k + 1, value_view(k + 1));
}

/// The input of a convolution in the form its terms read: as it is, or in phases.
template <class Real>
View<Real> Engine<Real>::read_by(const Step& step, const View<Real>& input) {
  if (!step.convolution.phased) return input;
  const View<Real> phases{phases_ + step.convolution.phases.origin, &step.convolution.phases};
  make_phases(team_, step.convolution, input, phases);
  return phases;
}

template <class Real>
void Engine<Real>::run_convolution(size_t k, bool keep) {
  const Step& step = plan_.steps[k];
  size_t result = k + 1;
  Ends<Real> ends;
  if (step.base >= 0) {
    ends.base = value_view(static_cast<size_t>(step.base));
    result = static_cast<size_t>(plan_.values[result].reader) + 1;
  }
  if (step.layer.bias >= 0) ends.bias = packed_[k].bias;
  if (step.activation >= 0) {
    const Step& activation = plan_.steps[static_cast<size_t>(step.activation)];
    if (!keep || activation.done_kept) {
      ends.activation = activation.layer.activation;
      ends.factor = static_cast<Real>(activation.layer.factor);
      result = static_cast<size_t>(step.activation) + 1;
    }
  }
  const View<Real> source = read_by(step, value_view(static_cast<size_t>(step.layer.input)));
  convolve(team_, step.convolution.forward, packed_[k].forward, source, {value_view(result)},
           whole(plan_.values[k + 1]), ends);
  finish(result, value_view(result));
}

template <class Real>
void Engine<Real>::run_layer(const Step& step, const View<Real>& input, const View<Real>& other,
                             const View<Real>& result) {
  const dpde_layer& layer = step.layer;
  const auto factor = static_cast<Real>(layer.factor);
  const int64_t channels = input.shape->channels, cells = input.shape->cells[0];
  switch (layer.kind) {
    case DPDE_ACTIVATE:
      return for_each_row_of(team_, *input.shape, 4, [&](int64_t channel, int64_t row) {
        kernels_.activate(layer.activation, factor, input.row(channel, row), result.row(channel, row), cells);
      });
    case DPDE_SCALE:
    case DPDE_ADD:
      return for_each_row_of(team_, *input.shape, 1, [&](int64_t channel, int64_t row) {
        Real* const to = result.row(channel, row);
        kernels_.scale(layer.kind == DPDE_SCALE ? factor : Real(1), input.row(channel, row), to, false, cells);
        if (layer.kind == DPDE_ADD) kernels_.scale(1, other.row(channel, row), to, true, cells);
      });
    case DPDE_CONCAT:
      copy_channels(team_, input, 0, result, 0, channels, false);
      return copy_channels(team_, other, 0, result, channels, other.shape->channels, false);
    case DPDE_MEAN_POOL: return mean_pool(team_, layer.stride, input, result);
    case DPDE_MAX_POOL: return max_pool(team_, layer.stride, input, input, result);
    case DPDE_UPSAMPLE: return upsample(team_, layer.stride, input, result);
    case DPDE_REORIENT: return reorient(team_, step, input, result);
    default: return fix_sum(team_, factor, input, result, false);
  }
}

template class Engine<float>;
template class Engine<double>;

}  // namespace dpde::nn
