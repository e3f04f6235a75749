// SPDX-License-Identifier: Apache-2.0
// What the ranks of a divided grid say to one another. A rank has a subgrid (layout.h): it is a thread here
// (thread_ranks.h), and may be a machine. Programs know nothing of it, the executor does: a fill takes the halo at a
// seam from the neighbour, sums are those of all ranks.
//
// Each call is one that all ranks make, in the same order. They do, since they run the same programs; what they decide
// by (the largest speed, a value that is not finite) they ask for by such a call, too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace dpde {

/// Of the two sides of an axis.
template <class T>
struct SidesOf {
  T low{}, high{};
};

class Communicator {
 public:
  /// The ranks make a grid themselves: so many along each axis, and this one at a place of it.
  Communicator(const std::array<int64_t, 3>& ranks, const std::array<int64_t, 3>& place)
      : ranks_(ranks), place_(place) {}
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;
  virtual ~Communicator() = default;

  const std::array<int64_t, 3>& ranks() const { return ranks_; }
  const std::array<int64_t, 3>& place() const { return place_; }

  /// Sends to the neighbours along an axis and gets what they send; behind the last rank the first one comes. Nothing
  /// is sent across the ends of the grid where both of these ranks give nothing.
  virtual void exchange(std::size_t axis, const SidesOf<std::span<const std::byte>>& to,
                        const SidesOf<std::span<std::byte>>& from) = 0;

  /// Along these axes.
  using Axes = std::array<bool, 3>;
  static constexpr Axes all_axes{true, true, true};
  /// Each value becomes its sum over the ranks whose places differ from this one's along `over` only, in the order of
  /// their places, x fastest: the same bits at all of them, in each run.
  virtual void sum(std::span<double> values, const Axes& over = all_axes) = 0;
  /// The largest of them; not a number where one is none.
  virtual void largest(std::span<double> values, const Axes& over = all_axes) = 0;

 private:
  std::array<int64_t, 3> ranks_, place_;
};

/// Of one value, at all ranks; the value itself where there is no communicator.
double largest_of(Communicator* ranks, double value);

}  // namespace dpde
