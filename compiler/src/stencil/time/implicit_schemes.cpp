// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/implicit_schemes.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "model/analyse/implicit_part.h"
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/time/newton_stages.h"
#include "stencil/time/projections.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

using model::AdditiveTableau;
using Weight = model::AdditiveWeight;

/// A combination of stored values: weights of R_k - u and of U_k - R_k, k = 1, 2, ...
struct Changes {
  model::AdditiveWeights of_right{}, of_solution{};

  void add(Weight weight, const Changes& other) {
    for (std::size_t k = 0; k < of_right.size(); ++k) {
      of_right[k] += weight * other.of_right[k];
      of_solution[k] += weight * other.of_solution[k];
    }
  }
};

/// R_i = u + h*(sum of b_ij*L U_j) + h*(sum of a_ij*N(U_j), j < i - 1) + h*of_rest*N(U_(i-1)).
struct RightSide {
  Changes of_solved, known;  // the first sum; both sums
  Weight of_rest;            // a_i(i-1)
};

/// The right side of a row from the stages whose h*N(U_j) are known.
RightSide known_side(const AdditiveTableau& tableau, const model::AdditiveRow& row, const std::vector<Changes>& rests) {
  RightSide right{{}, {}, 0};
  for (std::size_t j = 0; j < rests.size(); ++j) right.of_solved.of_solution[j] = row.of_solved[j] / tableau.own;
  right.known = right.of_solved;
  for (std::size_t j = 0; j < rests.size(); ++j) right.known.add(row.of_rest[j], rests[j]);
  return right;
}

/// Right sides of all stages, then of the embedded result. Later rows use h*N(U_(i-1)) = (R_i - u - known)/a_i(i-1).
std::vector<RightSide> right_sides(const AdditiveTableau& tableau) {
  std::vector<RightSide> result;
  std::vector<Changes> rests;  // h*N(U_j)
  for (std::size_t i = 0; i < tableau.rows.size(); ++i) {
    RightSide right = known_side(tableau, tableau.rows[i], rests);
    right.of_rest = tableau.rows[i].of_rest[i];
    Changes rest;
    rest.of_right[i] = 1 / right.of_rest;
    rest.add(-1 / right.of_rest, right.known);
    rests.push_back(rest);
    result.push_back(right);
  }
  if (tableau.embedded != nullptr) result.push_back(known_side(tableau, *tableau.embedded, rests));
  return result;
}

Expr weighted(Weight weight, const Expr& value) { return weight == 1 ? value : static_cast<double>(weight) * value; }
Expr plus(const Expr& sum, Weight weight, const Expr& value) {
  if (weight == 0) return sum;
  return weight < 0 ? sum - weighted(-weight, value) : sum + weighted(weight, value);
}

Expr time_after(Weight steps) {
  if (steps == 0) return param("t");
  if (steps == 0.5) return param("t") + param("dt") / 2.0;
  return param("t") + weighted(steps, param("dt"));
}

struct Equation {
  const Advance& advance;
  model::LinearPart parts;
  bool is_projected = false;             // a constraint changes it
  std::vector<std::string> rights = {};  // R_1, R_2, ...; for a state that is not solved for: U_1, ...
  std::vector<std::string> values = {};  // U_1, U_2, ...
  std::string unknown = {};              // of Newton's method, in the last stage
  std::vector<std::string> left = {};    // U_1, U_2, ... before projection: used in the sums, so that the last
  // projection includes all effects of constraints on the step

  bool is_solved() const { return !is_literal(parts.part, 0); }
  bool has_rest() const { return !is_literal(parts.rest, 0); }
  bool is_at_rest() const { return !is_solved() && !has_rest() && !is_projected; }
};

class ImplicitScheme {
 public:
  ImplicitScheme(Lowering& lowering, const std::vector<Advance>& advances, std::string name, bool is_projected)
      : lowering_(lowering), name_(std::move(name)), is_projected_(is_projected) {
    for (const Advance& advance : advances)
      equations_.push_back({advance, model::implicit_part(lowering.problem(), advance.state, advance.rate),
                            is_projected && lowering.problem().is_projected(advance.state)});
  }

  std::vector<Stage> by(const AdditiveTableau& tableau, const FieldsOfStates& embedded) {
    std::vector<Stage> stages;
    const std::vector<RightSide> sides = right_sides(tableau);
    const std::size_t count = tableau.rows.size();
    for (std::size_t i = 0; i < count; ++i) {
      name_values(i + 1 == count);
      Stage right = right_side(sides[i], i == 0 ? 0 : tableau.rows[i - 1].time);
      if (!right.kernel.stores.empty()) stages.push_back(std::move(right));
      add_solution(stages, tableau.own, tableau.rows[i].time, 0);
    }
    if (!embedded.empty()) add_embedded(stages, sides[count], embedded);
    return stages;
  }

  /// R = u + h/2*(L u + N at t), (1 - h/2*L) U = R + h/2*N at t + h.
  std::vector<Stage> trapezoidal() {
    name_values(true);
    Discretiser at_point = lowering_.discretiser();
    Kernel kernel = lowering_.kernel(kernel_name("right"));
    for (Equation& equation : equations_) {
      if (equation.is_at_rest()) continue;
      const std::string& state = equation.advance.state;
      equation.rights.push_back(lowering_.fresh_field(state + "_right1"));
      const Expr rate = at_point(equation.advance.rate, lowering_.placement_of(state));
      const Expr value = access(state) + scaled(param("dt") / 2.0, rate);
      kernel.stores.push_back({equation.rights.back(), false, value, equation.advance.origin});
    }
    std::vector<Stage> stages{Lowering::stage(std::move(kernel), at_point)};
    add_solution(stages, 0.5, 1, 0.5);
    return stages;
  }

 private:
  std::size_t number() const { return equations_.front().values.size(); }
  std::string kernel_name(const char* kind) const { return name_ + "_" + kind + std::to_string(number()); }

  /// Names the fields of the next stage.
  void name_values(bool is_last) {
    const std::string suffix = std::to_string(number() + 1);
    for (Equation& equation : equations_) {
      const Advance& advance = equation.advance;
      equation.values.push_back(is_last                 ? advance.into
                                : equation.is_at_rest() ? advance.state
                                                        : lowering_.field_beside(advance.state, suffix));
      into_[advance.state] = equation.values.back();
    }
    if (!is_last) {
      for (const model::Projection& projection : lowering_.problem().projections) into_.erase(projection.multiplier);
    }
    is_last_ = is_last;
    const FieldsOfStates left = is_projected_ ? before_projection(lowering_, into_, is_last) : into_;
    for (Equation& equation : equations_) {
      const auto found = left.find(equation.advance.state);
      equation.left.push_back(found == left.end() ? equation.advance.state : found->second);
    }
  }

  void add_solution(std::vector<Stage>& stages, Weight own, Weight time, Weight of_rest) {
    if (uses_newton()) add_newton(stages, own, time, of_rest);
    stages.push_back(solution(own, time, of_rest));
    if (stages.back().kernel.stores.empty()) stages.pop_back();
    if (!is_projected_) return;
    FieldsOfStates left;
    for (const Equation& equation : equations_) left[equation.advance.state] = equation.left.back();
    std::ranges::move(projection_stages(lowering_, {kernel_name("stage"), left, into_, time_after(time),
                                                    weighted(time, param("dt")), param("dt"), is_last_}),
                      std::back_inserter(stages));
  }

  /// The embedded result of the pair.
  void add_embedded(std::vector<Stage>& stages, const RightSide& side, const FieldsOfStates& into) {
    const std::string name = name_ + "_embedded";
    const FieldsOfStates left = is_projected_ ? before_projection(lowering_, into) : into;
    Kernel kernel = lowering_.kernel(name);
    for (const Equation& equation : equations_) {
      const auto field = left.find(equation.advance.state);
      if (field == left.end()) continue;
      kernel.stores.push_back({field->second, false, right_value(equation, side), equation.advance.origin});
    }
    stages.push_back({std::move(kernel), time_after(1), {}});
    if (!is_projected_) return;
    std::ranges::move(projection_stages(lowering_, {name, left, into, time_after(1), param("dt"), param("dt")}),
                      std::back_inserter(stages));
  }

  static Expr right_value(const Equation& equation, const RightSide& side) {
    const Changes& known = equation.has_rest() ? side.known : side.of_solved;
    const Expr begin = access(equation.advance.state);
    Expr sum = begin;
    for (std::size_t k = 0; k < equation.rights.size(); ++k) {
      const Expr right = access(equation.rights[k]);
      sum = plus(sum, known.of_right[k], right - begin);
      if (equation.is_solved()) sum = plus(sum, known.of_solution[k], access(equation.left[k]) - right);
    }
    return sum;
  }

  /// R of all states, from the previous stage, at `time`. For a state that is not solved for, R is U.
  Stage right_side(const RightSide& side, Weight time) {
    Environment reading;
    reading.time = time_after(time);
    for (const Equation& equation : equations_) {
      if (number() > 1) reading.fields[equation.advance.state] = equation.values[number() - 2];
    }
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(kernel_name("right"));
    for (Equation& equation : equations_) {
      if (equation.is_at_rest()) continue;
      const std::string& state = equation.advance.state;
      Expr value = right_value(equation, side);
      if (equation.has_rest()) {
        const Expr rest = at_point(equation.parts.rest, lowering_.placement_of(state));
        value = side.of_rest < 0 ? value - scaled(weighted(-side.of_rest, param("dt")), rest)
                                 : value + scaled(weighted(side.of_rest, param("dt")), rest);
      }
      const bool is_begin = equation.is_solved() && !uses_newton() && value == access(state);
      equation.rights.push_back(is_begin               ? state
                                : equation.is_solved() ? lowering_.fresh_field(state + "_right" + suffix())
                                                       : equation.left.back());
      if (!is_begin) kernel.stores.push_back({equation.rights.back(), false, value, equation.advance.origin});
    }
    return Lowering::stage(std::move(kernel), at_point, reading.time);
  }

  std::string suffix() const { return std::to_string(number()); }

  /// U of all states that are not computed yet, from R + h*of_rest*N at `time`.
  Stage solution(Weight own, Weight time, Weight of_rest) {
    Environment reading;
    reading.time = time_after(time);
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(kernel_name("stage"));
    for (const Equation& equation : equations_) {
      const Advance& advance = equation.advance;
      const std::string& into = equation.left.back();
      if (into == advance.state || (!equation.is_at_rest() && into == equation.rights.back())) continue;
      model::Expr value = model::field(equation.is_at_rest() ? advance.state : equation.rights.back(), advance.origin);
      if (uses_newton() && equation.is_solved()) {
        kernel.stores.push_back({into, false, access(equation.unknown), advance.origin});
        continue;
      }
      if (of_rest != 0) value = model::binary(BinaryOp::add, value, times_step(of_rest, equation.parts.rest));
      if (equation.is_solved()) value = solved(equation, own, value);
      kernel.stores.push_back({into, false, at_point(value, lowering_.placement_of(advance.state)), advance.origin});
    }
    return Lowering::stage(std::move(kernel), at_point, reading.time);
  }

  bool uses_newton() const { return lowering_.problem().scheme.implicit != model::Implicit::linear; }

  /// Newton's method for all unknown fields together; fields that are not solved for are computed already.
  void add_newton(std::vector<Stage>& stages, Weight own, Weight time, Weight of_rest) {
    Environment reading;
    reading.time = time_after(time);
    std::vector<NewtonEquation> solved;
    for (Equation& equation : equations_) {
      const Advance& advance = equation.advance;
      if (!equation.is_solved()) {
        if (!equation.is_at_rest()) reading.fields[advance.state] = equation.left.back();
        continue;
      }
      equation.unknown = lowering_.fresh_field(advance.state + "_solved");
      NewtonEquation one{advance.state, equation.rights.back(), equation.unknown, {}, advance.origin};
      one.parts.emplace_back(weighted(own, param("dt")), moving_part(advance.state, equation.parts.part));
      if (of_rest != 0 && equation.has_rest())
        one.parts.emplace_back(weighted(of_rest, param("dt")), moving_part(advance.state, equation.parts.rest));
      solved.push_back(std::move(one));
    }
    if (solved.empty()) return;
    hold(stages, solved, reading.time);
    std::ranges::move(newton_stages(lowering_, kernel_name("newton"), solved, std::move(reading)),
                      std::back_inserter(stages));
  }

  /// Terms are 0 where a mask constrains the state.
  model::Expr moving_part(const std::string& name, const model::Expr& part) const {
    const model::State& state = *lowering_.problem().find_state(name);
    return state.held ? model::select(state.held->inside, 0.0, part) : part;
  }

  /// Sets right sides inside masks to the constrained values, in new fields. Later stages use the original right sides,
  /// whose values inside masks have no effect.
  void hold(std::vector<Stage>& stages, std::vector<NewtonEquation>& solved, const Expr& time) {
    Environment reading;
    reading.time = time;
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(kernel_name("held"));
    for (NewtonEquation& one : solved) {
      const model::State& state = *lowering_.problem().find_state(one.state);
      if (!state.held) continue;
      const model::Placement placement = lowering_.placement_of(one.state);
      const Expr inside = at_point(state.held->inside, placement), value = at_point(state.held->value, placement);
      const std::string right = lowering_.fresh_field(one.right + "_held");
      kernel.stores.push_back({right, false, select(inside, value, access(one.right)), one.origin});
      one.right = right;
    }
    if (!kernel.stores.empty()) stages.push_back(Lowering::stage(std::move(kernel), at_point, time));
  }

  static model::Expr times_step(Weight weight, const model::Expr& e) {
    const model::Expr factor = static_cast<double>(weight);
    return model::binary(BinaryOp::multiply, model::binary(BinaryOp::multiply, factor, model::param("dt")), e);
  }

  /// The field U with the boundary of the state for which U - h*own*L U = `right`; inside a mask U is the constrained
  /// value.
  model::Expr solved(const Equation& equation, Weight own, const model::Expr& right) const {
    const model::State& state = *lowering_.problem().find_state(equation.advance.state);
    const model::Expr free = model::field(state.name);
    model::Expr operation = model::binary(BinaryOp::subtract, free, times_step(own, equation.parts.part)),
                value = right;
    if (state.held) {
      operation = model::select(state.held->inside, free, operation);
      value = model::select(state.held->inside, state.held->value, value);
    }
    return model::solve({state.name, operation, value, state.boundary}, equation.advance.origin);
  }

  Lowering& lowering_;
  std::string name_;
  bool is_projected_;
  std::vector<Equation> equations_;
  FieldsOfStates into_;  // of the current stage
  bool is_last_ = true;
};

}  // namespace

std::vector<Stage> implicit_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                                   bool is_projected, const FieldsOfStates& embedded) {
  ImplicitScheme scheme(lowering, advances, name, is_projected);
  const model::TimeScheme time = lowering.problem().scheme.time;
  return model::is_trapezoidal(time) ? scheme.trapezoidal() : scheme.by(time->additive, embedded);
}

}  // namespace dpde::stencil
