// SPDX-License-Identifier: Apache-2.0
// Conditions at the sides of bounded axes: their words, and the numbers by which a fill computes ghost values. A new
// condition is a row of the table in side_conditions.cpp, with a new rule if it is not of the form a*u + b*du/dn = c.
// All levels, derivatives and back ends use this table.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dpde {

enum class SideKind {
  value,
  zero_gradient,
  gradient,
  mixed,
  linear,
  outflow,
  gradient_at_cell,
  radiating,
  line,
  pole,
  opposite_pole
};

/// fixed + per_distance*m, for a ghost point m cells away from its mirror cell.
struct GhostNumber {
  double fixed = 0, per_distance = 0;
  double at(double way) const { return fixed + per_distance * way; }
  bool operator==(const GhostNumber&) const = default;
};

/// Coefficients of a condition: a, b.
constexpr int side_coefficients = 2;

/// Equation for the ghost value v, its mirror value u, the value w one cell farther inside, and c:
///   sum over all coefficients of coefficient*(ghost*v + mirror*u + second*w) = rate*c.
/// The mirror cell of layer k is first + step*k cells inside.
struct GhostRow {
  struct Term {
    GhostNumber ghost, mirror, second;
    bool operator==(const Term&) const = default;
  };
  std::array<Term, side_coefficients> terms{};
  GhostNumber rate{};
  int first = 0, step = 0;
  bool operator==(const GhostRow&) const = default;
};
/// `of_few`: for axes with fewer than `least` cells.
struct GhostRows {
  GhostRow row;
  int least = 1;
  GhostRow of_few = {};
  const GhostRow& on(int cells) const { return cells < least ? of_few : row; }
  bool operator==(const GhostRows&) const = default;
};
/// Ghost cells -1-k (low side) and n+k (high side) are layer k, with m = 2k+1. For values on walls, -1 and n-1 are
/// layer 0, on the wall, computed by `wall`; those beyond have m = 2k. A row with ghost = 0 leaves the value unchanged.
/// `turns`: at a pole, where the cells beyond the side are those half a turn away: the mirror cells are shifted by
/// cells/2 (rounded down) along the other one of the axes x and y, which runs around the pole.
struct GhostRule {
  bool on_walls = false;
  GhostRows wall, beyond;
  bool turns = false;
  bool operator==(const GhostRule&) const = default;
};

/// The ghost value as weight*u + second_weight*w + rate*c.
struct GhostWeights {
  double weight = 0, second_weight = 0, rate = 0;
};
bool makes_nothing(const GhostRow& row);
GhostWeights weights_of(const GhostRow& row, const std::array<double, side_coefficients>& coefficients, double way);

/// a*u + b*du/dn = c, and the parts written in the text: WORD(a, b, c) with the given ones.
struct SideCondition {
  enum class Part { zero, one, given };
  /// Level on which the word is allowed.
  enum class Level { both, models, programs };
  SideKind kind;
  std::string_view word;  // "": only c
  Part a, b, c;
  const GhostRule *between_cells, *on_walls;
  std::string_view usage;  // for hints
  Level level = Level::both;

  /// Whether it is a pole condition.
  bool turns() const { return between_cells->turns; }
  /// Whether the text gives no argument.
  bool is_word_alone() const { return a != Part::given && b != Part::given && c != Part::given; }
  /// Text with these arguments.
  std::string text(const std::vector<std::string>& given) const;
  /// u = c
  bool gives_value() const { return a == Part::one && b == Part::zero && c == Part::given; }
  /// du/dn = c
  bool gives_slope() const { return a == Part::zero && b == Part::one && c == Part::given && !takes_rate(); }
  /// dt(u) + c*du/dn = 0: c is a speed, and the slope follows from the field's time derivative.
  bool takes_rate() const { return kind == SideKind::radiating; }
  /// Whether a slope is given, directly or indirectly, so that there is a flux through the side.
  bool has_slope() const { return b != Part::zero && c == Part::given; }
  /// Whether, with c = 0, constant values are continued as constants beyond the side.
  bool keeps_constants() const;
  /// Whether the spacing matters when all other terms are 0.
  bool has_spacing() const { return b != Part::zero && (!keeps_constants() || c != Part::zero); }
  /// Whether values on a wall follow the field's own equation. Those on a low wall are not stored.
  bool keeps_wall() const { return makes_nothing(on_walls->wall.row); }
  const GhostRule& rule(bool on_wall) const { return on_wall ? *on_walls : *between_cells; }
};
std::span<const SideCondition> side_condition_table();
const SideCondition& condition_of(SideKind kind);
/// The condition of a word in models or in programs; nullptr if there is none.
const SideCondition* find_condition(std::string_view word, SideCondition::Level level);
/// Whether it is `periodic` or a condition without arguments.
bool is_side_word(std::string_view word);

/// The parts that the text gives for a side with a, b and value, in the order of the text.
template <class Side>
auto given_parts(Side& side) {
  using Part = SideCondition::Part;
  const SideCondition& condition = condition_of(side.kind);
  std::vector<decltype(&side.value)> parts;
  if (condition.a == Part::given) parts.push_back(&side.a);
  if (condition.b == Part::given) parts.push_back(&side.b);
  if (condition.c == Part::given) parts.push_back(&side.value);
  return parts;
}

}  // namespace dpde
