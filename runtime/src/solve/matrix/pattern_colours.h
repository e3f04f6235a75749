// SPDX-License-Identifier: Apache-2.0
// Colours of cells for a stencil with few entries: no row reads two cells of one colour.
//
// The colour of (x, y, z) is (a*x + b*y + c*z) mod m, which differs for two entries of a row if it differs for their
// offsets (Goldfarb and Toint, Math. Comp. 43, 1984, 69). Of the factors one is 1; the others, and m, are the smallest
// that do. A star of 31 points in space between walls has fewer than 60, where boxes around cells have 11^3. Around a
// ring colours go on if m divides a*(cells of it); else the last cells of the ring have colours of their own, and there
// are twice as many for each such axis.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "solve/fourier/grid_place.h"

namespace dpde {

class PatternColours {
 public:
  using Offset = std::array<int, 3>;

  /// Nothing where there are no more than `most` colours of that kind.
  static std::optional<PatternColours> of(std::vector<Offset> offsets, const std::array<std::int64_t, 3>& cells,
                                          const std::array<bool, 3>& periodic, std::int64_t most);

  const std::vector<Offset>& offsets() const { return offsets_; }
  std::int64_t count() const { return modulus_ << seams_.size(); }
  std::int64_t colour(const GridPlace& cell) const;
  /// The number of the offset at which the row of a cell reads one of that colour; -1: nowhere.
  int entry(const GridPlace& cell, std::int64_t colour) const;

 private:
  struct Seam {  // of a ring: cells from `begin` on have other colours
    std::size_t axis;
    std::int64_t begin;
  };
  bool find_factors(std::size_t axis, bool has_first);
  bool are_different();

  std::int64_t linear(const GridPlace& cell) const {
    return (factors_[0] * cell[0] + factors_[1] * cell[1] + factors_[2] * cell[2]) % modulus_;
  }

  std::vector<Offset> offsets_;
  std::array<std::int64_t, 3> cells_{}, factors_{}, reach_{};
  std::array<bool, 3> periodic_{};
  std::int64_t modulus_ = 1;
  std::vector<Seam> seams_;
  std::vector<int> entry_;  // by the colour of an offset
};

}  // namespace dpde
