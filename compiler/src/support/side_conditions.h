// SPDX-License-Identifier: Apache-2.0
// Conditions at the sides of bounded axes: the words they are written in, and the row of numbers that says what a fill
// puts beyond a side. A new condition is a row of the table in side_conditions.cpp, and a rule where it is no
// a*u + b*du/dn = c; all levels, derivatives and back ends follow from these.
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

/// fixed + per_distance*m, for a place m cells away from its mirror image.
struct GhostNumber {
  double fixed = 0, per_distance = 0;
  double at(double way) const { return fixed + per_distance * way; }
  bool operator==(const GhostNumber&) const = default;
};

/// Coefficients of a condition: a, b.
constexpr int side_coefficients = 2;

/// What holds between v at a place beyond a side, u at its image, w one cell farther inside, and c:
///   the sum over all coefficients of coefficient*(place*v + image*u + behind*w) = rate*c.
/// The image of layer k lies first + step*k cells inside.
struct GhostRow {
  struct Term {
    GhostNumber place, image, behind;
    bool operator==(const Term&) const = default;
  };
  std::array<Term, side_coefficients> terms{};
  GhostNumber rate{};
  int first = 0, step = 0;
  bool operator==(const GhostRow&) const = default;
};
/// `of_few` on axes with fewer than `least` cells.
struct GhostRows {
  GhostRow row;
  int least = 1;
  GhostRow of_few = {};
  const GhostRow& on(int cells) const { return cells < least ? of_few : row; }
  bool operator==(const GhostRows&) const = default;
};
/// Place -1-k of the low side and n+k of the high one are layer k, m = 2k+1. On walls, -1 and n-1 are layer 0, on the
/// walls, made by `wall`, and those beyond have m = 2k. A row without a place makes nothing: what is there stays.
/// `turns`: at a pole, where what lies beyond a side is what lies half a turn away, the images are those cells: along
/// the other one of the axes x and y, which runs around the pole, cells/2 farther on (rounded down).
struct GhostRule {
  bool on_walls = false;
  GhostRows wall, beyond;
  bool turns = false;
  bool operator==(const GhostRule&) const = default;
};

/// The halo value as weight*u + farther*w + rate*c.
struct GhostWeights {
  double weight = 0, farther = 0, rate = 0;
};
bool makes_nothing(const GhostRow& row);
GhostWeights weights_of(const GhostRow& row, const std::array<double, side_coefficients>& coefficients, double way);

/// a*u + b*du/dn = c and how much of it a person writes: WORD(a, b, c), of these what is given.
struct SideCondition {
  enum class Part { zero, one, given };
  /// Whose words it is one of.
  enum class Level { both, models, programs };
  SideKind kind;
  std::string_view word;  // "": c alone
  Part a, b, c;
  const GhostRule *between_cells, *on_walls;
  std::string_view usage;  // as hints have it
  Level level = Level::both;

  /// At a pole.
  bool turns() const { return between_cells->turns; }
  /// Nothing is given.
  bool is_word_alone() const { return a != Part::given && b != Part::given && c != Part::given; }
  /// As it is written with these arguments.
  std::string text(const std::vector<std::string>& given) const;
  /// u = c
  bool gives_value() const { return a == Part::one && b == Part::zero && c == Part::given; }
  /// du/dn = c
  bool gives_slope() const { return a == Part::zero && b == Part::one && c == Part::given && !takes_rate(); }
  /// dt(u) + c*du/dn = 0: c is a speed, and the slope follows from the rate of the field.
  bool takes_rate() const { return kind == SideKind::radiating; }
  /// A slope is given, or follows from what is: something flows through the side.
  bool has_slope() const { return b != Part::zero && c == Part::given; }
  /// Of a field that is the same across the side, with c = 0: so it is beyond.
  bool keeps_constants() const;
  /// Where all else is 0, the spacing is no part of it.
  bool has_spacing() const { return b != Part::zero && (!keeps_constants() || c != Part::zero); }
  /// The values on a wall are those of the field itself. Those on a low wall are not stored.
  bool keeps_wall() const { return makes_nothing(on_walls->wall.row); }
  const GhostRule& rule(bool on_wall) const { return on_wall ? *on_walls : *between_cells; }
};
std::span<const SideCondition> side_condition_table();
const SideCondition& condition_of(SideKind kind);
/// By its word in models or in programs; nullptr where it is none of theirs.
const SideCondition* find_condition(std::string_view word, SideCondition::Level level);
/// `periodic`, or a condition that is written without arguments.
bool is_side_word(std::string_view word);

/// What a person gives of a side with a, b and value, in the order in which it is written.
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
