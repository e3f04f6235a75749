// SPDX-License-Identifier: Apache-2.0
#include "support/side_conditions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "support/assert.h"

namespace dpde {

namespace {

/// a*(u + v)/2 + b*(v - u)/m = c, multiplied by 2m.
constexpr GhostRow mirrored_row(int first) {
  return {.terms = {{{.ghost = {0, 1}, .mirror = {0, 1}}, {.ghost = {2}, .mirror = {-2}}}},
          .rate = {0, 2},
          .first = first,
          .step = 1};
}
constexpr GhostRule mirrored{.beyond = {mirrored_row(0)}};
/// With the one-sided derivative (3v - 4u + w)/2; with v - u for two cells.
constexpr GhostRule mirrored_on_walls{
    .on_walls = true,
    .wall = {.row = {.terms = {{{.ghost = {2}}, {.ghost = {3}, .mirror = {-4}, .second = {1}}}}, .rate = {2}},
             .least = 3,
             .of_few = {.terms = {{{.ghost = {1}}, {.ghost = {1}, .mirror = {-1}}}}, .rate = {1}}},
    .beyond = {mirrored_row(-1)}};

/// Centred at the cell next to the side: (v - u)/((m + 1)*h) = c, with u as far inside as v is outside. Outgoing waves
/// then have the error of a central difference, wherever the condition applies. With one cell it is centred at the
/// side.
constexpr GhostRule mirrored_at_cell{
    .beyond = {.row = {.terms = {{{}, {.ghost = {1}, .mirror = {-1}}}}, .rate = {1, 1}, .first = 1, .step = 1},
               .least = 2,
               .of_few = mirrored_row(0)}};

/// Linear extrapolation from the two cells next to the side, 2v = (m + 3)*u - (m + 1)*w; v = u for a single cell.
constexpr GhostRule continued{.beyond = {.row = {.terms = {{{}, {.ghost = {2}, .mirror = {-3, -1}, .second = {1, 1}}}}},
                                         .least = 2,
                                         .of_few = {.terms = {{{}, {.ghost = {1}, .mirror = {-1}}}}}}};
/// The same if cells beyond the side are a times as wide as those inside, 2v = 2u + a*(m + 1)*(u - w).
constexpr GhostRule continued_by{
    .beyond = {.row = {.terms = {{{.mirror = {-1, -1}, .second = {1, 1}}, {.ghost = {2}, .mirror = {-2}}}}},
               .least = 2,
               .of_few = continued.beyond.of_few}};
/// Linear extrapolation beyond the wall from the point on it, 2v = (m + 2)*u - m*w.
constexpr GhostRule continued_on_walls{
    .on_walls = true,
    .wall = {.row = {.terms = {{{}, {.ghost = {1}, .mirror = {-2}, .second = {1}}}}},
             .least = 3,
             .of_few = {.terms = {{{}, {.ghost = {1}, .mirror = {-1}}}}}},
    .beyond = {{.terms = {{{}, {.ghost = {2}, .mirror = {-2, -1}, .second = {0, 1}}}}, .first = -1}}};

/// Linear beyond the wall as above; the point on the wall follows the field's own equation.
constexpr GhostRule open_on_walls{.on_walls = true, .wall = {}, .beyond = continued_on_walls.beyond};

/// v = u for a scalar; v = -u for vector components, whose directions reverse across a pole.
constexpr GhostRule across_pole{
    .beyond = {.row = {.terms = {{{}, {.ghost = {1}, .mirror = {-1}}}}, .first = 0, .step = 1}}, .turns = true};
constexpr GhostRule turned_across_pole{
    .beyond = {.row = {.terms = {{{.ghost = {1}, .mirror = {1}}, {}}}, .first = 0, .step = 1}}, .turns = true};

using enum SideCondition::Part;
using Level = SideCondition::Level;

constexpr std::array<SideCondition, 11> conditions{
    {{SideKind::value, "", one, zero, given, &mirrored, &mirrored_on_walls, "a value"},
     {SideKind::zero_gradient, "zero_gradient", zero, one, zero, &mirrored, &mirrored_on_walls, "zero_gradient"},
     {SideKind::gradient, "gradient", zero, one, given, &mirrored, &mirrored_on_walls,
      "gradient(g), the derivative along the outward normal"},
     {SideKind::mixed, "mixed", given, given, given, &mirrored, &mirrored_on_walls,
      "mixed(a, b, c) for a*u + b*du/dn = c, n the outward normal"},
     {SideKind::linear, "linear", zero, one, zero, &continued, &continued_on_walls, "linear"},
     {SideKind::outflow, "outflow", zero, one, zero, &continued, &open_on_walls, "outflow"},
     {SideKind::gradient_at_cell, "gradient_at_cell", zero, one, given, &mirrored_at_cell, &mirrored_on_walls,
      "gradient_at_cell(g), the derivative along the outward normal at the centre of the cell", Level::programs},
     {SideKind::radiating, "radiating", zero, one, given, &mirrored_at_cell, &mirrored_on_walls,
      "radiating(c) for dt(u) + c*du/dn = 0, n the outward normal", Level::models},
     {SideKind::line, "line", given, one, zero, &continued_by, &continued_on_walls,
      "line(a), the straight line goes on where cells beyond the side are a times as long", Level::programs},
     {SideKind::pole, "pole", zero, one, zero, &across_pole, &mirrored_on_walls, "pole"},
     {SideKind::opposite_pole, "opposite_pole", one, zero, zero, &turned_across_pole, &mirrored_on_walls,
      "opposite_pole, of a component of a vector", Level::programs}}};

}  // namespace

bool makes_nothing(const GhostRow& row) {
  return std::ranges::all_of(row.terms, [](const GhostRow::Term& term) { return term.ghost == GhostNumber{}; });
}

GhostWeights weights_of(const GhostRow& row, const std::array<double, side_coefficients>& coefficients, double way) {
  double ghost = 0, mirror = 0, second = 0;
  for (int t = 0; t < side_coefficients; ++t) {
    const GhostRow::Term& term = row.terms[t];
    ghost += coefficients[t] * term.ghost.at(way);
    mirror += coefficients[t] * term.mirror.at(way);
    second += coefficients[t] * term.second.at(way);
  }
  return {-mirror / ghost, -second / ghost, row.rate.at(way) / ghost};
}

bool SideCondition::keeps_constants() const {
  const GhostRow::Term& of_a = between_cells->beyond.row.terms[0];
  const auto sum = [&](double way) { return of_a.ghost.at(way) + of_a.mirror.at(way) + of_a.second.at(way); };
  return a == Part::zero || (sum(0) == 0 && sum(1) == 0);
}

std::string SideCondition::text(const std::vector<std::string>& given) const {
  if (word.empty()) return given.front();
  return given.empty() ? std::string(word) : fmt::format("{}({})", word, fmt::join(given, ", "));
}

std::span<const SideCondition> side_condition_table() { return conditions; }

const SideCondition& condition_of(SideKind kind) {
  const auto found = std::ranges::find(conditions, kind, &SideCondition::kind);
  require(found != conditions.end(), "each kind of side is in the table");
  return *found;
}

const SideCondition* find_condition(std::string_view word, Level level) {
  const auto found = std::ranges::find(conditions, word, &SideCondition::word);
  if (word.empty() || found == conditions.end()) return nullptr;
  return found->level == Level::both || found->level == level ? &*found : nullptr;
}

bool is_side_word(std::string_view word) {
  const auto is_it = [&](const SideCondition& known) { return known.word == word && known.is_word_alone(); };
  return word == "periodic" || std::ranges::any_of(conditions, is_it);
}

}  // namespace dpde
