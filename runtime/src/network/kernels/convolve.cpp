// SPDX-License-Identifier: Apache-2.0
#include "network/kernels/convolve.h"

#include <algorithm>

namespace dpde::nn {
namespace {

constexpr int64_t flops_per_cost = 60;  // floating-point operations of a thread in a nanosecond, approximately

template <class Real>
int64_t cost_of(const Product& product, int64_t cells) {
  int64_t channels = 0;
  for (const Block& block : product.blocks) channels += block.width;
  return channels * static_cast<int64_t>(product.offsets.size()) * cells * 2 / flops_per_cost;
}

/// Index of a phase from its indices along the axes.
int64_t phase_index(const Convolution& convolution, const Axes& phase) {
  const auto count = [&](size_t axis) { return static_cast<int64_t>(convolution.from[axis].size()); };
  return (phase[2] * count(1) + phase[1]) * count(0) + phase[0];
}

/// Calls `f(row of the plane, y and z of the input's row or -1 in either, positions read along x)` for each row of one
/// phase, margins included.
template <class F>
void for_each_phase_row(const Convolution& convolution, const Axes& phase, const F& f) {
  const auto from = [&](size_t axis) -> const std::vector<int64_t>& {
    return convolution.from[axis][static_cast<size_t>(phase[axis])];
  };
  const Shape& shape = convolution.phases;
  for (size_t z = 0; z < from(2).size(); ++z) {
    for (size_t y = 0; y < from(1).size(); ++y) {
      const int64_t place = (static_cast<int64_t>(y) - shape.margin[1]) * shape.stride[1] +
                            (static_cast<int64_t>(z) - shape.margin[2]) * shape.stride[2];
      f(place - shape.margin[0], from(1)[y], from(2)[z], from(0));
    }
  }
}

template <class F>
void for_each_phase(const Convolution& convolution, const F& f) {
  for (int64_t z = 0; z < static_cast<int64_t>(convolution.from[2].size()); ++z) {
    for (int64_t y = 0; y < static_cast<int64_t>(convolution.from[1].size()); ++y) {
      for (int64_t x = 0; x < static_cast<int64_t>(convolution.from[0].size()); ++x) f(Axes{x, y, z});
    }
  }
}

}  // namespace

template <class Real>
void pack(const Product& product, const double* weights, Real* packed) {
  std::transform(product.weights.begin(), product.weights.end(), packed,
                 [&](int64_t place) { return static_cast<Real>(weights[place]); });
}

template <class Real>
void convolve(const Team& team, const Product& product, const Real* packed, const View<Real>& source,
              const Target<Real>& target, const Range& range, const Ends<Real>& ends) {
  const Shape &from = *source.shape, &to = *target.result.shape;
  ConvolveCall<Real> call{};
  call.input = source.data;
  call.output = target.result.plane(target.first_plane) + range.first[0] + range.first[1] * to.stride[1] +
                range.first[2] * to.stride[2];
  call.first_x = range.first[0];
  call.cells = range.cells[0];
  call.rows_y = range.cells[1];
  for (size_t axis = 0; axis < 2; ++axis) {
    call.first[axis] = range.first[axis + 1];
    call.input_stride[axis] = from.stride[axis + 1];
    call.output_stride[axis] = to.stride[axis + 1];
  }
  call.output_plane = to.plane * target.plane_step;
  call.offsets = product.offsets.data();
  call.terms = static_cast<int64_t>(product.offsets.size());
  call.weights = packed;
  call.bias = ends.bias;
  if (ends.base.data) {
    const Shape& base = *ends.base.shape;
    call.base = ends.base.data + range.first[0] + range.first[1] * base.stride[1] + range.first[2] * base.stride[2];
    call.base_plane = base.plane;
    for (size_t axis = 0; axis < 2; ++axis) call.base_stride[axis] = base.stride[axis + 1];
  }
  call.blocks = product.blocks.data();
  call.block_count = static_cast<int64_t>(product.blocks.size());
  call.activation = ends.activation;
  call.factor = ends.factor;
  const int64_t rows = range.cells[1] * range.cells[2], cost = cost_of<Real>(product, rows * range.cells[0]);
  const Kernels<Real>& code = kernels<Real>();
  if (rows > 1) {
    parallel_pieces(team, rows, 1, cost, [&](int64_t begin, int64_t end) { code.convolve(call, begin, end); });
    return;
  }
  constexpr int64_t whole_lines = 48 * 16;
  parallel_pieces(team, range.cells[0], whole_lines, cost, [&](int64_t begin, int64_t end) {
    ConvolveCall<Real> part = call;
    part.first_x += begin;
    part.output += begin;
    if (part.base) part.base += begin;
    part.cells = end - begin;
    code.convolve(part, 0, 1);
  });
}

template <class Real>
void add_weight_gradient(const Team& team, const Product& forward, const View<Real>& source, const View<Real>& seeds,
                         double* bars) {
  WeightGradientCall<Real> call{};
  const Shape& shape = *seeds.shape;
  call.seeds = seeds.data;
  call.values = source.data;
  call.cells = shape.cells[0];
  call.rows_y = shape.cells[1];
  call.rows = shape.rows();
  call.seed_plane = shape.plane;
  for (size_t axis = 0; axis < 2; ++axis) {
    call.seed_stride[axis] = shape.stride[axis + 1];
    call.value_stride[axis] = source.shape->stride[axis + 1];
  }
  call.offsets = forward.offsets.data();
  call.terms = static_cast<int64_t>(forward.offsets.size());
  call.bars = bars;
  // Each piece reads all seeds or all values once more: as few pieces as keep the threads busy.
  constexpr int64_t least_terms = 24, pieces_per_thread = 2;
  const auto blocks = static_cast<int64_t>(forward.blocks.size());
  const int64_t wanted = team.threads() > 1 ? team.threads() * pieces_per_thread : 1;
  const int64_t pieces = std::clamp<int64_t>(call.terms / least_terms, 1, wanted),
                groups = std::clamp<int64_t>(wanted / pieces, 1, blocks);
  const Kernels<Real>& code = kernels<Real>();
  parallel(team, pieces * groups, cost_of<Real>(forward, call.rows * call.cells), [&](int64_t task) {
    const int64_t piece = task % pieces, group = task / pieces;
    const Block* const first = forward.blocks.data();
    code.weight_gradient(call, first + blocks * group / groups, first + blocks * (group + 1) / groups,
                         call.terms * piece / pieces, call.terms * (piece + 1) / pieces);
  });
}

template <class Real>
void make_phases(const Team& team, const Convolution& convolution, const View<Real>& input, const View<Real>& phases) {
  const Shape &from = *input.shape, &to = convolution.phases;
  parallel(team, from.channels, to.channels * to.rows() * to.cells[0], [&](int64_t channel) {
    for_each_phase(convolution, [&](const Axes& phase) {
      Real* const plane = phases.plane(channel * convolution.phase_count + phase_index(convolution, phase));
      for_each_phase_row(convolution, phase,
                         [&](int64_t place, int64_t y, int64_t z, const std::vector<int64_t>& along_x) {
                           Real* const row = plane + place;
                           std::fill(row, row + to.stride[1], Real(0));
                           if (y < 0 || z < 0) return;
                           const Real* const cells = input.plane(channel) + y * from.stride[1] + z * from.stride[2];
                           for (size_t x = 0; x < along_x.size(); ++x)
                             row[x] = along_x[x] < 0 ? Real(0) : cells[along_x[x]];
                         });
    });
  });
}

template <class Real>
void add_phases_adjoint(const Team& team, const Convolution& convolution, const View<Real>& phases_bar,
                        const View<Real>& input_bar) {
  const Shape& to = *input_bar.shape;
  const Shape& from = convolution.phases;
  parallel(team, to.channels, from.channels * from.rows() * from.cells[0], [&](int64_t channel) {
    for_each_phase(convolution, [&](const Axes& phase) {
      const Real* const plane = phases_bar.plane(channel * convolution.phase_count + phase_index(convolution, phase));
      for_each_phase_row(convolution, phase,
                         [&](int64_t place, int64_t y, int64_t z, const std::vector<int64_t>& along_x) {
                           if (y < 0 || z < 0) return;
                           const Real* const row = plane + place;
                           Real* const cells = input_bar.plane(channel) + y * to.stride[1] + z * to.stride[2];
                           for (size_t x = 0; x < along_x.size(); ++x) {
                             if (along_x[x] >= 0) cells[along_x[x]] += row[x];
                           }
                         });
    });
  });
}

template void pack(const Product&, const double*, float*);
template void pack(const Product&, const double*, double*);
template void convolve(const Team&, const Product&, const float*, const View<float>&, const Target<float>&,
                       const Range&, const Ends<float>&);
template void convolve(const Team&, const Product&, const double*, const View<double>&, const Target<double>&,
                       const Range&, const Ends<double>&);
template void add_weight_gradient(const Team&, const Product&, const View<float>&, const View<float>&, double*);
template void add_weight_gradient(const Team&, const Product&, const View<double>&, const View<double>&, double*);
template void make_phases(const Team&, const Convolution&, const View<float>&, const View<float>&);
template void make_phases(const Team&, const Convolution&, const View<double>&, const View<double>&);
template void add_phases_adjoint(const Team&, const Convolution&, const View<float>&, const View<float>&);
template void add_phases_adjoint(const Team&, const Convolution&, const View<double>&, const View<double>&);

}  // namespace dpde::nn
