// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/random.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace dpde {
namespace {

constexpr int rounds = 10;
constexpr std::array<std::uint32_t, 2> multipliers{0xD2511F53, 0xCD9E8D57}, key_steps{0x9E3779B9, 0xBB67AE85};

std::uint32_t low(std::uint64_t value) { return static_cast<std::uint32_t>(value); }
std::uint32_t high(std::uint64_t value) { return static_cast<std::uint32_t>(value >> 32); }
/// The upper 53 bits of two words, the low one first.
double bits_of(std::uint32_t first, std::uint32_t second) {
  return static_cast<double>((std::uint64_t{second} << 32 | first) >> 11);
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t first = std::uint64_t{multipliers[0]} * counter[0],
                        second = std::uint64_t{multipliers[1]} * counter[2];
    counter = {high(second) ^ counter[1] ^ key[0], low(second), high(first) ^ counter[3] ^ key[1], low(first)};
    for (std::size_t i = 0; i < key.size(); ++i) key[i] += key_steps[i];
  }
  return counter;
}

double normal(std::uint64_t seed, std::uint64_t cell, std::uint64_t stream) {
  const auto words = philox({low(cell), high(cell), low(stream), high(stream)}, {low(seed), high(seed)});
  const double a = bits_of(words[0], words[1]), b = bits_of(words[2], words[3]);
  return std::sqrt(-2 * std::log((a + 1) * 0x1p-53)) * std::cos(2 * std::numbers::pi * (b * 0x1p-53));
}

void fill_noise(const dpde_layout& layout, void* base, std::uint64_t seed, std::uint64_t stream) {
  std::vector<double> dense;
  dense.reserve(static_cast<std::size_t>(cell_count(layout)));
  for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
    for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
      const std::int64_t row = (z + layout.first[2]) * layout.global[1] + y + layout.first[1];
      const std::int64_t cell = row * layout.global[0] + layout.first[0];
      for (std::int64_t x = 0; x < layout.cells[0]; ++x)
        dense.push_back(normal(seed, static_cast<std::uint64_t>(cell + x), stream));
    }
  }
  copy_in(layout, base, dense);
}

}  // namespace dpde
