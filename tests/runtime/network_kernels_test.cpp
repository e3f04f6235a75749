// SPDX-License-Identifier: Apache-2.0
// The kernels of every instruction set of this processor, against plain loops.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "network/kernels/kernel_sets.h"
#include "network_run.h"

namespace dpde {
namespace {

using nn::Block;
using nn::Kernels;

struct Set {
  std::string name;
  Kernels<float> single{};
  Kernels<double> full{};

  template <class Real>
  const Kernels<Real>& of() const {
    if constexpr (sizeof(Real) == 4)
      return single;
    else
      return full;
  }
};

std::vector<Set> sets() {
  std::vector<Set> result;
  const auto add = [&](const std::string& name, void (*fill)(Kernels<float>&, Kernels<double>&)) {
    Set& set = result.emplace_back();
    set.name = name;
    fill(set.single, set.full);
  };
  add("portable", nn::kernels_portable);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) add("v3", nn::kernels_v3);
  if (__builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) add("v4", nn::kernels_v4);
#endif
  return result;
}

/// Planes of random numbers with a margin of 4 cells and room for whole vectors; cell (0, 0, 0) is inside.
template <class Real>
struct Planes {
  static constexpr int64_t row = 128, rows = 16, plane = row * rows;
  std::vector<Real> values;

  Planes(int64_t channels, uint32_t seed) : values(static_cast<size_t>((channels + 1) * plane)) {
    const std::vector<double> random = test::random_values(values.size(), seed);
    for (size_t i = 0; i < values.size(); ++i) values[i] = static_cast<Real>(random[i]);
  }
  Real* data() { return values.data() + 4 * row + 16; }
};

template <class Real>
void check(const Set& set) {
  const Kernels<Real>& code = set.of<Real>();
  const double tolerance = sizeof(Real) == 4 ? 2e-5 : 1e-13;
  constexpr int64_t plane = Planes<Real>::plane, row = Planes<Real>::row, channels = 15, inputs = 3;
  std::vector<int64_t> offsets;
  for (int64_t term = 0; term < inputs * 9; ++term)
    offsets.push_back(term / 9 * plane + (term / 3 % 3 - 1) * row + term % 3 - 1);
  const auto terms = std::ssize(offsets);
  std::vector<Block> blocks;
  std::vector<Real> weights, bias;
  for (int64_t first = 0; first < channels;) {
    int64_t width = code.widest_block;
    while (width > channels - first) width /= 2;
    blocks.push_back({first, width, 0, first * terms});
    first += width;
  }
  for (const double value : test::random_values(static_cast<size_t>(channels * terms), 5))
    weights.push_back(static_cast<Real>(value));
  for (const double value : test::random_values(static_cast<size_t>(channels), 6))
    bias.push_back(static_cast<Real>(value));
  for (const int64_t cells : {3, 17, 33, 64, 100}) {
    const std::string what = set.name + ", " + std::to_string(cells) + " cells";
    Planes<Real> in(inputs, 1), out(channels, 2);
    const Planes<Real> before = out;
    nn::ConvolveCall<Real> call{};
    call.input = in.data();
    call.output = out.data();
    call.base = out.data();
    call.cells = cells;
    call.rows_y = 6;
    for (int64_t* stride : {call.input_stride, call.output_stride, call.base_stride}) {
      stride[0] = row;
      stride[1] = plane;
    }
    call.output_plane = call.base_plane = plane;
    call.offsets = offsets.data();
    call.terms = terms;
    call.weights = weights.data();
    call.bias = bias.data();
    call.blocks = blocks.data();
    call.block_count = std::ssize(blocks);
    call.activation = DPDE_TANH;
    code.convolve(call, 0, 2);
    code.convolve(call, 2, 6);
    Planes<Real> seeds(channels, 3);
    for (int64_t c = 0; c < channels; ++c) {
      for (int64_t y = 0; y < 6; ++y)
        std::fill_n(seeds.data() + c * plane + y * row + cells, row - 16 - cells, Real(0));
    }
    std::vector<double> bars(static_cast<size_t>(channels * terms), 1.0);
    const nn::WeightGradientCall<Real> gradient{seeds.data(), in.data(),    cells,          6,     6,          plane,
                                                {row, plane}, {row, plane}, offsets.data(), terms, bars.data()};
    code.weight_gradient(gradient, blocks.data(), blocks.data() + 1, 0, terms);
    code.weight_gradient(gradient, blocks.data() + 1, blocks.data() + blocks.size(), 0, 7);
    code.weight_gradient(gradient, blocks.data() + 1, blocks.data() + blocks.size(), 7, terms);
    double error = 0, bar_error = 0;
    for (const Block& block : blocks) {
      for (int64_t c = 0; c < block.width; ++c) {
        const int64_t channel = block.first + c;
        std::vector<double> expected(static_cast<size_t>(terms), 1.0);
        for (int64_t y = 0; y < 6; ++y) {
          for (int64_t x = 0; x < cells; ++x) {
            const int64_t place = y * row + x;
            double sum = static_cast<double>(bias[static_cast<size_t>(channel)]) +
                         static_cast<double>(const_cast<Planes<Real>&>(before).data()[channel * plane + place]);
            for (int64_t t = 0; t < terms; ++t) {
              const auto value = static_cast<double>(in.data()[place + offsets[static_cast<size_t>(t)]]);
              sum += static_cast<double>(weights[static_cast<size_t>(block.weights + t * block.width + c)]) * value;
              expected[static_cast<size_t>(t)] += static_cast<double>(seeds.data()[channel * plane + place]) * value;
            }
            error =
                std::max(error, std::abs(std::tanh(sum) - static_cast<double>(out.data()[channel * plane + place])));
          }
        }
        for (int64_t t = 0; t < terms; ++t)
          bar_error = std::max(
              bar_error, std::abs(expected[static_cast<size_t>(t)] - bars[static_cast<size_t>(channel * terms + t)]));
      }
    }
    EXPECT_LE(error, tolerance) << what;
    EXPECT_LE(bar_error, 10 * tolerance) << what;
  }
}

TEST(NetworkKernels, EveryInstructionSetIsRight) {
  const std::vector<Set> all = sets();
  for (const Set& set : all) {
    check<double>(set);
    check<float>(set);
  }
}

/// Up to rounding: values and tangents of all activations, against the portable ones as the reference
/// (network_value_test.cpp).
TEST(NetworkKernels, ActivationsAgree) {
  const std::vector<Set> all = sets();
  std::vector<double> values, rates(256, 1.0);
  for (int i = 0; i < 256; ++i) values.push_back(0.1 * (i - 128));
  for (const Set& set : all) {
    for (int kind = DPDE_RELU; kind <= DPDE_SILU; ++kind) {
      std::vector<double> a(256), b(256), c(256), d(256);
      set.full.activate(kind, 0.2, values.data(), a.data(), 256);
      all[0].full.activate(kind, 0.2, values.data(), b.data(), 256);
      set.full.activation_rate(kind, 0.2, values.data(), rates.data(), c.data(), false, 256);
      all[0].full.activation_rate(kind, 0.2, values.data(), rates.data(), d.data(), false, 256);
      for (size_t i = 0; i < 256; ++i) {
        EXPECT_NEAR(a[i], b[i], 1e-14 * std::max(1.0, std::abs(b[i]))) << set.name << kind;
        EXPECT_NEAR(c[i], d[i], 1e-14) << set.name << kind;
      }
    }
  }
}

}  // namespace
}  // namespace dpde
