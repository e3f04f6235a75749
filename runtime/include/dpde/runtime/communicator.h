// SPDX-License-Identifier: Apache-2.0
// Communication between the ranks of a grid that is divided into subgrids (layout.h), one for each rank. Here ranks are
// threads (thread_ranks.h); they may be machines. Programs do not know about ranks; the executor does: a fill takes the
// halo at a subdomain interface from the neighbour, and sums are over all ranks.
//
// All ranks make each call, in the same order. This holds since they run the same programs, and since the values on
// which they branch (the largest speed, a value that is not finite) are also obtained by such a call.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace dpde {

/// One value for each side of an axis.
template <class T>
struct SidesOf {
  T low{}, high{};
};

class Communicator {
 public:
  /// The ranks form a grid with `ranks` of them along each axis; this rank is at `place`.
  Communicator(const std::array<int64_t, 3>& ranks, const std::array<int64_t, 3>& place)
      : ranks_(ranks), place_(place) {}
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;
  virtual ~Communicator() = default;

  const std::array<int64_t, 3>& ranks() const { return ranks_; }
  const std::array<int64_t, 3>& place() const { return place_; }

  /// Sends to both neighbours along an axis and receives from them; the ranks are periodic along it. Nothing is sent
  /// across the ends of the grid if both ranks there pass empty spans.
  virtual void exchange(std::size_t axis, const SidesOf<std::span<const std::byte>>& to,
                        const SidesOf<std::span<std::byte>>& from) = 0;

  /// The axes along which ranks are combined.
  using Axes = std::array<bool, 3>;
  static constexpr Axes all_axes{true, true, true};
  /// Replaces each value by its sum over the ranks whose places differ from this one's only along `over`. Summed in the
  /// order of the places, x fastest: all ranks get the same bits in each run.
  virtual void sum(std::span<double> values, const Axes& over = all_axes) = 0;
  /// The same with the largest value; NaN if any of them is NaN.
  virtual void largest(std::span<double> values, const Axes& over = all_axes) = 0;

 private:
  std::array<int64_t, 3> ranks_, place_;
};

/// The largest of one value over all ranks; the value itself if there is no communicator.
double largest_of(Communicator* ranks, double value);

}  // namespace dpde
