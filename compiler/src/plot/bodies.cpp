// SPDX-License-Identifier: Apache-2.0
#include "plot/bodies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "model/build.h"
#include "support/maths/evaluate.h"

namespace dpde::plot {

namespace {

using Place = std::array<double, 3>;

/// Values of formulas; NaN with parts other than numbers, parameters, coordinates and t.
class MaskValue {
 public:
  MaskValue(const model::Problem& problem, double time) : problem_(problem), time_(time) {}

  double of(const model::Expr& e, const Place& place) const {
    const auto value = [&](const model::Expr& part) { return of(part, place); };
    if (const auto* n = std::get_if<model::Number>(&e->kind)) return n->value;
    if (const auto* c = std::get_if<model::Coordinate>(&e->kind)) return place[static_cast<std::size_t>(c->axis)];
    if (const auto* p = std::get_if<model::Param>(&e->kind)) return parameter(p->name);
    if (const auto* n = std::get_if<model::Neg>(&e->kind)) return -value(n->operand);
    if (const auto* b = std::get_if<model::Binary>(&e->kind))
      return evaluate_binary(b->op, value(b->left), value(b->right));
    if (const auto* c = std::get_if<model::Call>(&e->kind)) return evaluate_call_of(c->fn, c->arguments, value);
    if (const auto* s = std::get_if<model::Select>(&e->kind)) return value(value(s->condition) != 0 ? s->yes : s->no);
    return NAN;
  }

 private:
  double parameter(const std::string& name) const {
    if (name == "t") return time_;
    const auto found = std::ranges::find(problem_.params, name, &model::Parameter::name);
    return found == problem_.params.end() || problem_.find_control(name) != nullptr ? NAN : found->value;
  }

  const model::Problem& problem_;
  double time_;
};

/// The formulas of the masks that states are held in: 1 inside. A mask that moves is stored by an operator.
std::vector<model::Expr> masks_of(const model::Problem& problem) {
  std::vector<model::Expr> masks;
  const auto add = [&](const model::Expr& formula) {
    if (std::ranges::find(masks, formula) == masks.end()) masks.push_back(formula);
  };
  for (const model::State& state : problem.states) {
    if (!state.held) continue;
    any_part(state.held->inside, [&](const model::Expr& part) {
      if (const auto* apply = std::get_if<model::Apply>(&part->kind))
        add(apply->function.body[static_cast<std::size_t>(apply->component)]);
      const auto* field = std::get_if<model::Field>(&part->kind);
      const model::Coefficient* mask = field == nullptr ? nullptr : problem.find_coefficient(field->name);
      if (mask != nullptr && mask->is_mask && mask->value.formula) add(*mask->value.formula);
      return false;  // to the end
    });
  }
  return masks;
}

/// Whether each cell of the plane is inside, x fastest.
std::vector<bool> cells_inside(const MaskValue& value, const model::Expr& mask, const std::vector<model::Axis>& axes,
                               const Plane& plane) {
  Place place{};
  if (plane.across) place[*plane.across] = axes[*plane.across].centre(axes[*plane.across].cells / 2);
  std::vector<bool> inside;
  for (int j = 0; j < axes[plane.b].cells; ++j) {
    place[plane.b] = axes[plane.b].centre(j);
    for (int i = 0; i < axes[plane.a].cells; ++i) {
      place[plane.a] = axes[plane.a].centre(i);
      inside.push_back(value.of(mask, place) > 0.5);
    }
  }
  return inside;
}

}  // namespace

std::vector<Polyline> outlines(const model::Problem& problem, const std::vector<model::Axis>& axes, const Plane& plane,
                               double time) {
  const MaskValue value(problem, time);
  const model::Axis &a = axes[plane.a], &b = axes[plane.b];
  std::vector<Polyline> lines;
  for (const model::Expr& mask : masks_of(problem)) {
    const std::vector<bool> inside = cells_inside(value, mask, axes, plane);
    const auto at = [&](int i, int j) { return inside[std::size_t(j) * std::size_t(a.cells) + std::size_t(i)]; };
    for (int j = 0; j < b.cells; ++j) {
      for (int i = 0; i < a.cells; ++i) {
        if (i > 0 && at(i, j) != at(i - 1, j)) lines.push_back({{a.face(i), b.face(j)}, {a.face(i), b.face(j + 1)}});
        if (j > 0 && at(i, j) != at(i, j - 1)) lines.push_back({{a.face(i), b.face(j)}, {a.face(i + 1), b.face(j)}});
      }
    }
  }
  return lines;
}

}  // namespace dpde::plot
