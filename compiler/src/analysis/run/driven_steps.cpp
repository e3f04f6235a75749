// SPDX-License-Identifier: Apache-2.0
#include "analysis/run/driven_steps.h"

#include <algorithm>
#include <array>
#include <set>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/uses.h"
#include "support/maths/comparisons.h"

namespace dpde::analysis {

namespace {

constexpr int most_moments = 2000;              // sampled times of the run
constexpr std::size_t most_driven_parts = 400;  // subexpressions of formulas
constexpr std::size_t most_driven_steps = 32;

/// Replaces parameters and coordinates by numbers, and t by the first coordinate.
model::Expr of_time(const model::Expr& e, const model::Problem& problem, const std::array<double, 3>& place) {
  if (const auto* at = as<model::Coordinate>(e))
    return model::number(place[static_cast<std::size_t>(at->axis)], e->origin);
  if (const auto* param = as<model::Param>(e)) {
    if (param->name == "t") return model::coordinate(0, e->origin);
    const model::Parameter* found = problem.find_param(param->name);
    return found == nullptr ? e : model::number(found->value, e->origin);
  }
  return map_children(e, [&](const model::Expr& part) { return of_time(part, problem, place); });
}

class DrivenSteps {
 public:
  explicit DrivenSteps(const model::Problem& problem) : problem_(problem) {
    for (int i = 0; i < places; ++i) {  // points on the diagonal
      std::array<double, 3> place{};
      for (std::size_t a = 0; a < problem.axes.size(); ++a) {
        const model::Axis& axis = problem.axes[a];
        place[a] = axis.centre(std::int64_t{axis.cells - 1} * i / (places - 1));
      }
      places_.push_back(place);
    }
  }

  void look_at(const model::Expr& e) {
    if (const auto* apply = as<model::Apply>(e)) {
      for (const model::Expr& body : apply->function.body) look_at(body);
    }
    for_each_child(e, [&](const model::Expr& part) { look_at(part); });
    const bool has_time = any_part(e, [](const model::Expr& part) {
      const auto* param = as<model::Param>(part);
      return param != nullptr && param->name == "t";
    });
    if (!has_time || is<model::Param>(e)) return;
    for (const std::array<double, 3>& place : places_) {
      if (seen_ == most_driven_parts) return;
      const model::Expr formula = of_time(e, problem_, place);
      if (!model::is_formula(formula)) return;
      ++seen_;
      model::is_condition(formula) ? look_for_changes(formula) : look_for_extremes(formula);
      if (!holds_any<model::Coordinate>(e)) return;  // does not depend on the point
    }
  }

  std::vector<int> steps() const {
    const std::vector<int> all(steps_.begin(), steps_.end());
    if (all.size() <= most_driven_steps) return all;
    std::vector<int> some;
    for (std::size_t i = 0; i < most_driven_steps; ++i)
      some.push_back(all[i * (all.size() - 1) / (most_driven_steps - 1)]);
    return some;
  }

 private:
  static constexpr int places = 5;

  double value(const model::Expr& formula, int step) const {
    return model::value_at(formula, problem_.t_begin + step * problem_.step);
  }
  int stride() const { return std::max(1, problem_.steps / most_moments); }

  /// Adds the first step after the first change to each truth value, by bisection.
  void look_for_changes(const model::Expr& formula) {
    std::set<double> met;
    double before = value(formula, 0);
    for (int step = stride(); step <= problem_.steps; step += stride()) {
      const double now = value(formula, step);
      if (now == before) continue;
      int low = step - stride(), high = step;
      while (high - low > 1) {
        const int middle = low + (high - low) / 2;
        (value(formula, middle) == before ? low : high) = middle;
      }
      if (met.insert(now).second) steps_.insert(high);
      before = now;
    }
  }

  /// Adds the steps with extreme values, refined between neighbouring samples by ternary search.
  void look_for_extremes(const model::Expr& formula) {
    for (const double sign : {1.0, -1.0}) {
      int best = 0;
      for (int step = 0; step <= problem_.steps; step += stride()) {
        if (sign * value(formula, step) > sign * value(formula, best)) best = step;
      }
      int low = std::max(0, best - stride()), high = std::min(problem_.steps, best + stride());
      while (high - low > 2) {
        const int first = low + (high - low) / 3, second = high - (high - low) / 3;
        if (sign * value(formula, first) < sign * value(formula, second)) {
          low = first;
        } else {
          high = second;
        }
      }
      steps_.insert(low + (high - low) / 2);
    }
  }

  const model::Problem& problem_;
  std::vector<std::array<double, 3>> places_;
  std::size_t seen_ = 0;
  std::set<int> steps_;
};

}  // namespace

std::vector<int> driven_steps(const model::Problem& problem) {
  DrivenSteps driven(problem);
  model::for_each_formula(problem, [&](const model::Use& use) {
    const model::UseTime time = model::time_of(use.kind);
    if (time == model::UseTime::step || time == model::UseTime::boundary) driven.look_at(use.formula);
  });
  return driven.steps();
}

}  // namespace dpde::analysis
