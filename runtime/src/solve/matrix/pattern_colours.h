// SPDX-License-Identifier: Apache-2.0
// Colours of cells for a stencil with few entries: no row has two cells of one colour.
//
// The colour of (x, y, z) is (a*x + b*y + c*z) mod m; it differs for two entries of a row if it differs for their
// offsets (Goldfarb and Toint, Math. Comp. 43, 1984, 69). One factor is 1; the others, and m, are the smallest
// possible. A 3-D star of 31 points between walls needs fewer than 60 colours; colouring by boxes around cells would
// need 11^3. On a periodic axis colours are consistent if m divides a*(its cells). Otherwise the last cells of the axis
// have separate colours, which doubles the number for each such axis.
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

  /// Empty if more than `most` colours of that kind are needed.
  static std::optional<PatternColours> of(std::vector<Offset> offsets, const std::array<std::int64_t, 3>& cells,
                                          const std::array<bool, 3>& periodic, std::int64_t most);

  const std::vector<Offset>& offsets() const { return offsets_; }
  std::int64_t count() const { return modulus_ << seams_.size(); }
  std::int64_t colour(const GridPlace& cell) const;
  /// Index of the offset at which the row of a cell has an entry of that colour; -1: none.
  int entry(const GridPlace& cell, std::int64_t colour) const;

 private:
  struct Seam {  // on a periodic axis: cells from `begin` on have other colours
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
  std::vector<int> entry_;  // by colour of the offset
};

}  // namespace dpde
