// SPDX-License-Identifier: Apache-2.0
#include "chart/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>

#include "model/print/print_model.h"
#include "stability/stability_report.h"

namespace dpde::chart {

namespace {

constexpr int most_parts = 64;                              // of a step, for stability on finer cells
constexpr double smallest_tolerance = SolveBy{}.tolerance;  // for solves
constexpr int fewest_coarse = 4;                            // cells along an axis
constexpr double least_order = 0.25, largest_order = 12;    // outside, differences do not follow a power law

using Values = std::vector<double>;

Values difference(const Values& a, const Values& b) {
  Values result(a.size());
  std::ranges::transform(a, b, result.begin(), std::minus());
  return result;
}

/// Extrapolates the difference to the next finer run to the limit (Richardson), if differences fall from `size` to
/// `next_size`.
Values extrapolated(Values first, double size, double next_size, double ratio, Budget::Part& part) {
  const double order = next_size > 0 ? std::log(size / next_size) / std::log(ratio) : 0;
  const bool is_power = order >= least_order && order <= largest_order;
  part.order = is_power ? order : 0;
  const double factor = is_power ? 1 / (1 - std::pow(ratio, -order)) : 1;
  for (double& value : first) value *= factor;
  return first;
}

class Companions {
 public:
  Companions(const SourceFile& source, const PointOptions& options, const Point& point)
      : source_(source), options_(options), point_(point), variant_(point.variant) {}

  Budget make() {
    if (!run_all()) return budget_;
    for (const auto& [name, base] : base_) {
      for (const Measure& measure : options_.measures.empty() ? std::vector<Measure>{{name}} : options_.measures) {
        if (measure.state == name && is_measured(measure)) add(measure, base);
      }
    }
    return budget_;
  }

 private:
  /// Whether the point's error has this measure: states without an exact solution, e.g. velocities, may lack one.
  bool is_measured(const Measure& measure) const {
    return point_.errors.empty() || point_.errors.contains(text_of(measure));
  }

  std::unique_ptr<driver::Session> open_at(double cells, int parts, bool to_tolerance = false) {
    Variant variant = variant_;
    const auto solve = variant.resolution.extract("solve");
    variant.resolution.clear();
    if (solve) variant.resolution[solve.key()] = solve.mapped();
    if (!exacter_solves_.empty() && !to_tolerance) variant.resolution["solve"] = exacter_solves_;
    for (std::size_t a = 0; a < axis_names_.size(); ++a)
      variant.resolution["cells." + axis_names_[a]] =
          fmt::format("{}", std::lround(std::floor(point_.cells[a] * cells)));
    variant.resolution["step"] = fmt::format("{}", point_.step / parts);
    if (is_single_) variant.method["real"] = "f64";
    return open(source_, options_, variant, budget_.failure);
  }

  /// Returns false if the run does not reach its end.
  bool run(driver::Session* session, FinalStates& states) {
    if (session == nullptr) return false;
    const RunResult result = session->rollout().run();
    if (result.blow_up) budget_.failure = "a companion run blows up";
    if (result.stopped) budget_.failure = "stopped";
    if (budget_.failure.empty()) states = final_states(*session);
    return budget_.failure.empty();
  }
  bool run(double cells, int parts, FinalStates& states) { return run(open_at(cells, parts).get(), states); }

  /// The smallest power of 2 by which the step must be divided to be stable on cells half as large.
  int parts_for(driver::Session& finer) {
    const stability::StabilityReport verdict = stability::verdict_of(finer);
    int parts = 1;
    while (verdict.is_analysed() && verdict.limit.kind == stability::StepLimit::Kind::limit && verdict.parts == 1 &&
           point_.step / parts > verdict.limit.step && parts < most_parts)
      parts *= 2;
    return parts;
  }

  /// Requires that the session has run.
  void find_exacter_solves(driver::Session& own) {
    const std::deque<SolveNote>& notes = own.rollout().solve_notes();
    const bool by_steps = std::ranges::any_of(
        notes, [](const SolveNote& note) { return note.most_iterations > 0 && note.method != "newton"; });
    SolveBy by = own.problem().scheme.solve;
    by.tolerance = std::max(smallest_tolerance, by.tolerance / 100);
    by.most_iterations = std::max(by.most_iterations, SolveBy{}.most_iterations);
    by.warns = false;
    if (by_steps && by.tolerance < own.problem().scheme.solve.tolerance) exacter_solves_ = model::print(by);
  }

  bool run_all() {
    const std::unique_ptr<driver::Session> own = open(source_, options_, variant_, budget_.failure);
    if (own == nullptr) return false;
    is_single_ = own->compiled().real() == Precision::f32;
    const bool has_grid = own->problem().has_grid;
    for (const model::Axis& axis : own->axes()) {
      if (has_grid) axis_names_.push_back(axis.name);
    }
    if (has_grid && std::ranges::any_of(point_.cells, [](int cells) { return cells / 2 < fewest_coarse; })) {
      budget_.failure = "there are too few cells for a coarser run";
      return false;
    }
    if (!run(own.get(), as_it_is_)) return false;
    find_exacter_solves(*own);
    const std::unique_ptr<driver::Session> finer = open_at(2, 1);
    if (finer == nullptr) return false;
    const int parts = parts_for(*finer);
    if (!exacter_solves_.empty() && !run(open_at(1, 1, true).get(), to_tolerance_)) return false;
    const bool is_as_exact = !is_single_ && exacter_solves_.empty();
    if (is_as_exact) base_ = as_it_is_;
    if (!is_as_exact && !run(1, 1, base_)) return false;
    if (!run(1, 2, half_) || !run(1, 4, quarter_)) return false;
    same_ = coarse_ = fine_ = base_;
    if (!has_grid) return true;
    if (!run(0.5, parts, coarse_)) return false;
    same_ = parts == 1 ? base_ : parts == 2 ? half_ : quarter_;
    if (parts > 4 && !run(1, parts, same_)) return false;
    return parts == 1 ? run(finer.get(), fine_) : run(2, parts, fine_);
  }

  void add(const Measure& measure, const FinalState& base) {
    const std::string& name = measure.state;
    const FinalState& same = same_.at(name);
    const Values exacter = at_points(fine_.at(name), base.axes);
    const double scale = norm_of(exacter, model::ErrorNorm::l2);
    const auto size = [&](const Values& values) { return norm_of(values, measure.norm) / (scale > 0 ? scale : 1); };
    Budget now;
    now.measure = text_of(measure);
    const Values steps = difference(base.values, half_.at(name).values);
    const double next = size(difference(half_.at(name).values, quarter_.at(name).values));
    Values sum = extrapolated(steps, size(steps), next, 2, now.time);
    now.time.error = size(sum);
    const Values cells = difference(same.values, exacter);
    const FinalState& coarse = coarse_.at(name);
    const double before = size(difference(coarse.values, at_points(same, coarse.axes)));
    const Values scaled = extrapolated(cells, before, size(cells), 2, now.space);
    now.space.error = size(scaled);
    std::ranges::transform(sum, scaled, sum.begin(), std::plus());
    const auto add_part = [&](const FinalStates& with, const FinalStates& without) {
      const Values part = difference(with.at(name).values, without.at(name).values);
      std::ranges::transform(sum, part, sum.begin(), std::plus());
      return size(part);
    };
    const FinalStates& in_double = exacter_solves_.empty() ? base_ : to_tolerance_;
    if (is_single_) now.rounding = add_part(as_it_is_, in_double);
    if (!exacter_solves_.empty()) now.solves = add_part(to_tolerance_, base_);
    now.sum = size(sum);
    if (budget_.measure.empty() || now.sum > budget_.sum) budget_ = std::move(now);
  }

  const SourceFile& source_;
  const PointOptions& options_;
  const Point& point_;
  Variant variant_;
  bool is_single_ = false;
  std::vector<std::string> axis_names_;
  std::string exacter_solves_;                                // setting of the scheme; "": no iterative solves
  FinalStates as_it_is_;                                      // the point itself
  FinalStates to_tolerance_;                                  // in double precision
  FinalStates base_, half_, quarter_, same_, coarse_, fine_;  // the same, with exacter solves
  Budget budget_;
};

}  // namespace

std::string Budget::largest() const {
  const std::pair<double, const char*> parts[] = {
      {space.error, "space"}, {time.error, "time"}, {rounding.value_or(0), "rounding"}, {solves.value_or(0), "solves"}};
  return std::ranges::max(parts, {}, &std::pair<double, const char*>::first).second;
}

Budget budget_of(const SourceFile& source, const PointOptions& options, const Point& point) {
  try {
    return Companions(source, options, point).make();
  } catch (const std::exception& error) {
    Budget budget;
    budget.failure = error.what();
    return budget;
  }
}

}  // namespace dpde::chart
