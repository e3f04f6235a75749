// SPDX-License-Identifier: Apache-2.0
// SplitMix64 (Steele, Lea, Flood: Fast splittable pseudorandom number generators, 2014). The same numbers on every
// machine, unlike the distributions of std.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <vector>

namespace dpde::testing {

class SplitMix {
 public:
  explicit SplitMix(std::uint64_t seed) : state_(seed) {}

  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  /// 0 <= result < n
  int below(int n) { return static_cast<int>(next() % static_cast<std::uint64_t>(n)); }
  bool percent(int chance) { return below(100) < chance; }
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(next() >> 11) * 0x1p-53); }
  std::vector<double> uniform(std::size_t count, double low, double high) {
    std::vector<double> values(count);
    for (double& v : values) v = uniform(low, high);
    return values;
  }
  /// A random index with these weights.
  int weighted(std::initializer_list<int> weights) {
    int total = 0;
    for (const int w : weights) total += w;
    int place = below(total), index = 0;
    for (const int w : weights) {
      if (place < w) break;
      place -= w;
      ++index;
    }
    return index;
  }

 private:
  std::uint64_t state_;
};

}  // namespace dpde::testing
