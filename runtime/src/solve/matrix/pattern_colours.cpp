// SPDX-License-Identifier: Apache-2.0
#include "solve/matrix/pattern_colours.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace dpde {

std::optional<PatternColours> PatternColours::of(std::vector<Offset> offsets, const std::array<std::int64_t, 3>& cells,
                                                 const std::array<bool, 3>& periodic, std::int64_t most) {
  PatternColours colours;
  colours.offsets_ = std::move(offsets);
  colours.cells_ = cells;
  colours.periodic_ = periodic;
  for (const Offset& offset : colours.offsets_) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      colours.reach_[axis] = std::max<std::int64_t>(colours.reach_[axis], std::abs(offset[axis]));
  }
  std::vector<std::size_t> rings;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!periodic[axis] || colours.reach_[axis] == 0) continue;
    if (cells[axis] <= 4 * colours.reach_[axis]) return std::nullopt;
    rings.push_back(axis);
  }
  std::optional<PatternColours> best;
  for (std::size_t choice = std::size_t{1} << rings.size(); choice-- > 0;) {
    colours.seams_.clear();
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const std::size_t axis = rings[i];
      if ((choice >> i & 1) != 0) colours.seams_.push_back({axis, cells[axis] - 2 * colours.reach_[axis]});
    }
    for (auto m = static_cast<std::int64_t>(colours.offsets_.size()); m << colours.seams_.size() <= most; ++m) {
      colours.modulus_ = m;
      colours.factors_ = {};
      if (!colours.find_factors(0, false)) continue;
      most = colours.count() - 1;
      best = colours;
      break;
    }
  }
  return best;
}

/// Search from `axis` on. The first axis along which the stencil extends has the factor 1.
bool PatternColours::find_factors(std::size_t axis, bool has_first) {
  if (axis == 3) return are_different();
  if (reach_[axis] == 0) return find_factors(axis + 1, has_first);
  const bool is_seam = std::ranges::find(seams_, axis, &Seam::axis) != seams_.end();
  for (std::int64_t factor = 1; factor < (has_first ? modulus_ : 2); ++factor) {
    if (periodic_[axis] && !is_seam && factor * cells_[axis] % modulus_ != 0) continue;
    factors_[axis] = factor;
    if (find_factors(axis + 1, true)) return true;
  }
  return false;
}

bool PatternColours::are_different() {
  entry_.assign(static_cast<std::size_t>(modulus_), -1);
  for (std::size_t k = 0; k < offsets_.size(); ++k) {
    const Offset& offset = offsets_[k];
    const std::int64_t sum = factors_[0] * offset[0] + factors_[1] * offset[1] + factors_[2] * offset[2];
    int& known = entry_[static_cast<std::size_t>((sum % modulus_ + modulus_) % modulus_)];
    if (known >= 0) return false;
    known = static_cast<int>(k);
  }
  return true;
}

std::int64_t PatternColours::colour(const GridPlace& cell) const {
  std::int64_t set = 0;
  for (std::size_t i = 0; i < seams_.size(); ++i) {
    if (cell[seams_[i].axis] >= seams_[i].begin) set |= std::int64_t{1} << i;
  }
  return linear(cell) + modulus_ * set;
}

int PatternColours::entry(const GridPlace& cell, std::int64_t colour_wanted) const {
  const std::int64_t apart = colour_wanted % modulus_ - linear(cell);
  const int k = entry_[static_cast<std::size_t>(apart < 0 ? apart + modulus_ : apart)];
  if (k < 0) return -1;
  GridPlace place{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t& i = place[axis] = cell[axis] + offsets_[static_cast<std::size_t>(k)][axis];
    if (i >= 0 && i < cells_[axis]) continue;
    if (!periodic_[axis]) return -1;
    i += i < 0 ? cells_[axis] : -cells_[axis];
  }
  return colour(place) == colour_wanted ? k : -1;
}

}  // namespace dpde
