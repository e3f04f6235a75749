// SPDX-License-Identifier: Apache-2.0
#include "network/kernels/convolution_plan.h"

#include <algorithm>
#include <cstdlib>

namespace dpde::nn {
namespace {

/// floor(a/b)
int64_t floored(int64_t a, int64_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// An offset of the kernel: its phase, and its shift against the result's cell in that phase.
struct Tap {
  int64_t phase = 0;
  Axes shift{};
};

std::vector<Tap> taps_of(const dpde_layer& layer, int32_t rank) {
  std::vector<Tap> taps;
  const int64_t extent = layer.extent, centre = extent / 2, stride = layer.stride;
  const int64_t ny = rank > 1 ? extent : 1, nz = rank > 2 ? extent : 1;
  for (int64_t z = 0; z < nz; ++z) {
    for (int64_t y = 0; y < ny; ++y) {
      for (int64_t x = 0; x < extent; ++x) {
        const Axes place{x, y, z};
        Tap tap;
        for (size_t axis = 3; axis-- > 0;) {
          if (static_cast<int32_t>(axis) >= rank) continue;
          const int64_t offset = layer.dilation * (place[axis] - centre);
          tap.shift[axis] = floored(offset, stride);
          tap.phase = tap.phase * stride + offset - tap.shift[axis] * stride;
        }
        taps.push_back(tap);
      }
    }
  }
  return taps;
}

int64_t distance(const Axes& shift, const Axes& stride) {
  return shift[0] * stride[0] + shift[1] * stride[1] + shift[2] * stride[2];
}

/// Divides the channels of each group into blocks of 8, 4, 2 and 1.
void add_blocks(Product& product, int64_t groups, int64_t channels, int64_t group_input, int64_t terms,
                int64_t widest) {
  int64_t packed = 0;
  for (int64_t group = 0; group < groups; ++group) {
    for (int64_t channel = 0; channel < channels;) {
      int64_t width = widest;
      while (width > channels - channel) width /= 2;
      product.blocks.push_back({group * channels + channel, width, group * group_input, packed});
      packed += width * terms;
      channel += width;
    }
  }
}

/// Calls `place(channel, term)` for each packed weight.
template <class Place>
void add_weights(Product& product, const Place& place) {
  for (const Block& block : product.blocks) {
    for (int64_t term = 0; term < static_cast<int64_t>(product.offsets.size()); ++term) {
      for (int64_t c = 0; c < block.width; ++c) product.weights.push_back(place(block.first + c, term));
    }
  }
}

struct Sizes {
  int64_t groups, in, out, taps;  // in, out: channels of a group
  int64_t weights;
  int64_t place(int64_t out_channel, int64_t in_channel, int64_t tap) const {
    return weights + (out_channel * in + in_channel) * taps + tap;
  }
};

Product forward_of(const Sizes& sizes, const std::vector<Tap>& taps, const Shape& source, int64_t phases,
                   int64_t widest) {
  Product product;
  for (int64_t channel = 0; channel < sizes.in; ++channel) {
    for (const Tap& tap : taps)
      product.offsets.push_back((channel * phases + tap.phase) * source.plane + distance(tap.shift, source.stride));
  }
  add_blocks(product, sizes.groups, sizes.out, sizes.in * phases * source.plane,
             static_cast<int64_t>(product.offsets.size()), widest);
  add_weights(product, [&](int64_t channel, int64_t term) {
    return sizes.place(channel, term / sizes.taps, term % sizes.taps);
  });
  return product;
}

Product reverse_of(const Sizes& sizes, const std::vector<Tap>& taps, const Shape& seeds, int64_t phase,
                   int64_t widest) {
  Product product;
  std::vector<int64_t> own;
  for (int64_t tap = sizes.taps; tap-- > 0;) {  // reversed, so that reads go forward in memory
    if (taps[static_cast<size_t>(tap)].phase == phase) own.push_back(tap);
  }
  for (int64_t channel = 0; channel < sizes.out; ++channel) {
    for (const int64_t tap : own)
      product.offsets.push_back(channel * seeds.plane - distance(taps[static_cast<size_t>(tap)].shift, seeds.stride));
  }
  add_blocks(product, sizes.groups, sizes.in, sizes.out * seeds.plane, static_cast<int64_t>(product.offsets.size()),
             widest);
  const auto count = static_cast<int64_t>(own.size());
  add_weights(product, [&](int64_t channel, int64_t term) {
    return sizes.place(channel / sizes.in * sizes.out + term / count, channel % sizes.in,
                       own[static_cast<size_t>(term % count)]);
  });
  return product;
}

}  // namespace

void set_reach(Convolution& convolution, const dpde_layer& layer, int32_t rank) {
  convolution.phased = layer.stride > 1;
  for (int32_t axis = 0; axis < rank; ++axis) convolution.phase_count *= layer.stride;
  for (const Tap& tap : taps_of(layer, rank)) {
    for (size_t axis = 0; axis < 3; ++axis)
      convolution.reach[axis] = std::max(convolution.reach[axis], std::abs(tap.shift[axis]));
  }
}

void plan_convolution(const Plan& plan, Step& step, const Value& result, int64_t widest_block) {
  const dpde_layer& layer = step.layer;
  Convolution& convolution = step.convolution;
  const Value& input = plan.values[static_cast<size_t>(layer.input)];
  const std::vector<Tap> taps = taps_of(layer, plan.network.rank);
  if (convolution.phased) {
    const int64_t line = 64 / (plan.network.real == DPDE_F32 ? 4 : 8);
    convolution.phases =
        make_shape(input.channels * convolution.phase_count, result.cells, convolution.reach, plan.padding, line);
    for (size_t axis = 0; axis < 3; ++axis) {
      const int64_t stride = static_cast<int32_t>(axis) < plan.network.rank ? layer.stride : 1,
                    reach = convolution.reach[axis];
      for (int64_t phase = 0; phase < stride; ++phase) {
        std::vector<int64_t>& from = convolution.from[axis].emplace_back();
        for (int64_t cell = -reach; cell < result.cells[axis] + reach; ++cell) {
          from.push_back(padded(plan.padding[axis], stride * cell + phase, input.cells[axis]));
        }
      }
    }
  }
  const Shape& source = convolution.phased ? convolution.phases : input.shape;
  const Sizes sizes{layer.groups, input.channels / layer.groups, layer.channels / layer.groups,
                    static_cast<int64_t>(taps.size()), layer.weights};
  convolution.forward = forward_of(sizes, taps, source, convolution.phase_count, widest_block);
  for (int64_t phase = 0; phase < convolution.phase_count; ++phase) {
    convolution.reverse.push_back(reverse_of(sizes, taps, result.adjoint, phase, widest_block));
  }
}

}  // namespace dpde::nn
