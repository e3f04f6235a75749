// SPDX-License-Identifier: Apache-2.0
#include "limits/steps_by_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "stability/eigenvalues/eigenvalues.h"

namespace dpde::testing {

namespace {

/// In units of the largest value of a field. Central differences err by its square, and by rounding over it.
constexpr double disturbance = 1e-5, error_of_differences = 1e-10;
/// A double eigenvalue, as of multistep methods at their limit, has an error of the square root of that.
constexpr double error_of_double = 1e-5;
constexpr double small_growth = 1e-6;  // ln |g|: a run takes 100000 steps to see it
constexpr double hundredfold = 100;
constexpr int first_doublings = 9, doublings_of_parts = 3;
constexpr double still = 1e-9;        // a step of nearly length 0, relative to the tried steps
constexpr double small_field = 1e-3;  // it is 0 but for rounding: values of scenes are of order one
constexpr double largest_power = 1e140;
/// Behind the first steps of methods with a memory, and not where what is done every second or third step happens.
constexpr int number_of_step = 4;

/// Fixed steps: neither a Courant number nor an error tolerance splits them.
RolloutSetup setup(driver::Session& session, double step) {
  RolloutSetup result = session.engine().setup();
  result.dt = step;
  result.rate = result.trial = nullptr;
  result.rate_field.clear();
  return result;
}

/// The error of ln |eigenvalue|.
double error_of(const Eigen::MatrixXd& part, std::complex<double> value) {
  const double error = error_of_differences * stability::sensitivity(part, value) / std::abs(value);
  return std::isfinite(error) ? std::min(error, error_of_double) : error_of_double;
}

Eigen::Index count_growing(const Eigen::MatrixXd& part, double least) {
  return std::ranges::count_if(stability::eigenvalues(part), [&](const std::complex<double> value) {
    const double growth = std::log(std::abs(value));
    return growth > least && growth > error_of(part, value);
  });
}

}  // namespace

StepsByRuns::StepsByRuns(driver::Session& session, double step, const StepsByRuns* without_events) : session_(session) {
  const model::Problem& problem = session.problem();
  Rollout& run = session.rollout();
  for (int s = 0; s < run.state_count(); ++s) {
    begin_.push_back(session.initial(s));
    const model::State* state = problem.find_state(run.state_name(s));
    remembers_ = remembers_ || (state != nullptr && !state->history_of.empty());
  }
  // As steps leave states, whatever a scene begins with.
  Rollout first(setup(session, still * step));
  session.engine().begin_other(first);
  first.set_begin(problem.t_begin);
  begin_ = after(first, begin_);
  for (const std::vector<double>& values : begin_) {
    double largest = 0;
    for (std::size_t cell = 0; cell < values.size(); ++cell) {
      largest = std::max(largest, std::abs(values[cell]));
      is_finite_ = is_finite_ && std::isfinite(values[cell]);
      places_.push_back({scales_.size(), cell});
    }
    scales_.push_back(largest > small_field ? largest : 1);
  }
  // Events of some steps are known by the number of the step, which times in between have not.
  const bool is_counted =
      std::ranges::any_of(problem.events, [](const model::Event& event) { return !event.after_step; });
  for (const double part : is_counted ? std::vector{0.0} : std::vector{0.0, 0.31, 0.62, 0.93})
    times_.push_back(problem.t_begin + part * problem.steps * problem.step);
  if (!is_finite_) return;
  find_groups(step);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    for (const double time : times_) {
      const Eigen::MatrixXd brief = part_of(tangent(still * step, time), groups_[g]);
      groups_[g].by_events = std::max(groups_[g].by_events, growth(brief, false).low);
      if (without_events == nullptr) measure(groups_[g], step, time);
    }
    if (without_events == nullptr) continue;
    // Events may tie groups together: the fastest of them.
    for (const Group& plain : without_events->groups_) {
      const bool is_part = std::ranges::find(groups_[g].states, plain.states.front()) != groups_[g].states.end();
      if (!is_part) continue;
      groups_[g].rate = {std::max(groups_[g].rate.low, plain.rate.low),
                         std::max(groups_[g].rate.high, plain.rate.high)};
      groups_[g].lasting += plain.lasting;
    }
  }
}

/// By which states a step makes others of.
void StepsByRuns::find_groups(double step) {
  const std::size_t count = begin_.size();
  std::vector<std::vector<bool>> acts(count, std::vector<bool>(count, false));
  for (const double time : times_) {
    const Eigen::MatrixXd g = tangent(step, time);
    for (Eigen::Index i = 0; i < size(); ++i) {
      for (Eigen::Index j = 0; j < size(); ++j) {
        if (!(std::abs(g(i, j)) < error_of_differences * (1 + g.norm())))
          acts[places_[static_cast<std::size_t>(j)].state][places_[static_cast<std::size_t>(i)].state] = true;
      }
    }
  }
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) acts[i][j] = acts[i][j] || (acts[i][k] && acts[k][j]);
    }
  }
  std::vector<bool> is_known(count, false);
  for (std::size_t i = 0; i < count; ++i) {
    if (is_known[i]) continue;
    Group group;
    for (std::size_t j = i; j < count; ++j) {
      if (j != i && !(acts[i][j] && acts[j][i])) continue;
      group.states.push_back(j);
      is_known[j] = true;
    }
    groups_.push_back(std::move(group));
  }
}

Eigen::MatrixXd StepsByRuns::part_of(const Eigen::MatrixXd& tangent, const Group& group) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < size(); ++i) {
    if (std::ranges::find(group.states, places_[static_cast<std::size_t>(i)].state) != group.states.end())
      rows.push_back(i);
  }
  return tangent(rows, rows);
}

void StepsByRuns::measure(Group& group, double step, double time) const {
  const Range rate = rate_at(group, step, time);
  group.rate = {std::max(group.rate.low, rate.low), std::max(group.rate.high, rate.high)};
}

/// Of steps of a 16th, 64th and 256th: at least of the first order in the step, a rate has an error that falls by four
/// from one to the next. That of differences grows by four.
StepsByRuns::Range StepsByRuns::rate_at(Group& group, double step, double time) const {
  Range best{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()}, before = best;
  for (const double parts : {16.0, 64.0, 256.0}) {
    const double length = step / parts;
    const Eigen::MatrixXd g = part_of(tangent(length, time), group);
    if (!g.allFinite()) continue;
    const Range grown = growth(g, true);
    const Range now{(grown.low - group.by_events) / length, (grown.high - group.by_events) / length};
    if (before.width() == std::numeric_limits<double>::infinity()) group.lasting = count_lasting(g, parts);
    if (std::isfinite(before.high)) {
      const double last = 0.5 * (before.low + before.high), middle = 0.5 * (now.low + now.high);
      const double limit = middle + (middle - last) / 3;
      const double error = 0.5 * now.width() + 0.2 * before.width() + std::abs(middle - last) / 3;
      if (2 * error < best.width()) best = {limit - error, limit + error};
    }
    before = now;
  }
  return best;
}

StepsByRuns::States StepsByRuns::after(Rollout& run, const States& states) const {
  for (std::size_t s = 0; s < states.size(); ++s) run.initial(static_cast<int>(s)).copy_in(states[s]);
  run.restart(number_of_step);
  run.advance(1);
  States result = states;
  for (std::size_t s = 0; s < states.size(); ++s) copy_out(session_.workspace().layout(), run.present()[s], result[s]);
  return result;
}

Eigen::MatrixXd StepsByRuns::tangent(double step, double time) const {
  Rollout run(setup(session_, step));
  session_.engine().begin_other(run);
  run.set_begin(std::max(session_.problem().t_begin, time - number_of_step * step));
  Eigen::MatrixXd result(size(), size());
  for (Eigen::Index j = 0; j < size(); ++j) {
    const auto [state, cell] = places_[static_cast<std::size_t>(j)];
    const double by = disturbance * scales_[state];
    States more = begin_, less = begin_;
    more[state][cell] += by;
    less[state][cell] -= by;
    more = after(run, more);
    less = after(run, less);
    for (Eigen::Index i = 0; i < size(); ++i) {
      const auto [other, at] = places_[static_cast<std::size_t>(i)];
      result(i, j) = (more[other][at] - less[other][at]) / (2 * by) * scales_[state] / scales_[other];
    }
  }
  return result;
}

/// Multistep methods have parasitic eigenvalues, in short steps far from 1: -1 of leapfrog, 0 of Adams-Bashforth.
bool StepsByRuns::may_be_of_equations(std::complex<double> eigenvalue) const {
  return !remembers_ || std::abs(eigenvalue - 1.0) < 0.5;
}

/// Eigenvalues that do not decay, by more than nothing in the step of which this one is a part.
Eigen::Index StepsByRuns::count_lasting(const Eigen::MatrixXd& part, double parts) const {
  return std::ranges::count_if(stability::eigenvalues(part), [&](const std::complex<double> value) {
    const double growth = std::log(std::abs(value));
    return may_be_of_equations(value) && growth > -error_of_double &&
           (growth > 0 || growth > -small_growth / parts - error_of(part, value));
  });
}

StepsByRuns::Range StepsByRuns::growth(const Eigen::MatrixXd& part, bool of_equations) const {
  std::complex<double> largest = 0;
  for (const std::complex<double> value : stability::eigenvalues(part)) {
    if (std::abs(value) > std::abs(largest) && (!of_equations || may_be_of_equations(value))) largest = value;
  }
  if (std::abs(largest) == 0) return {-50, -50};
  const double size = std::abs(largest), sure = error_of(part, largest);
  return {std::log(size) - sure, std::log(size) + sure};
}

double StepsByRuns::excess(double step) const {
  double most = -std::numeric_limits<double>::infinity();
  for (const double time : times_) {
    const Eigen::MatrixXd g = tangent(step, time);
    if (!g.allFinite()) return std::numeric_limits<double>::infinity();
    for (const Group& group : groups_)
      most = std::max(
          most, growth(part_of(g, group), false).low - group.by_events - 2 * std::max(0.0, group.rate.low) * step);
  }
  return most;
}

double StepsByRuns::on_the_way(const Group& group, const Eigen::MatrixXd& part, double step, double time) const {
  const double allowed_rate = 2 * std::max(0.0, group.rate.low), length = std::exp2(-doublings_of_parts) * step;
  Eigen::MatrixXd power = std::exp(-group.by_events - allowed_rate * step) * part;
  Eigen::MatrixXd of_parts = std::exp(-group.by_events - allowed_rate * length) * part_of(tangent(length, time), group);
  double most = 0, most_of_parts = 1;
  for (int doubling = 0; doubling <= first_doublings + doublings_of_parts; ++doubling) {
    if (doubling <= first_doublings) most = std::max(most, power.norm());
    most_of_parts = std::max(most_of_parts, of_parts.norm());
    if (!(most_of_parts < largest_power)) return 0;
    if (most < largest_power) power = (power * power).eval();
    of_parts = (of_parts * of_parts).eval();
  }
  return most / (hundredfold * most_of_parts);
}

StepsByRuns::Answer StepsByRuns::answer(const Group& group, const Eigen::MatrixXd& tangent_of_step, double step,
                                        double time) const {
  const Eigen::MatrixXd part = part_of(tangent_of_step, group);
  const Range found = growth(part, false);
  const double low = group.by_events + 2 * std::max(0.0, group.rate.low) * step,
               high = group.by_events + 2 * std::max(0.0, group.rate.high) * step;
  const double way = on_the_way(group, part, step, time);
  const bool is_counted = group.rate.low > 0 && group.by_events < small_growth;
  const auto are_more = [&](double least) { return is_counted && count_growing(part, least) > group.lasting; };
  if (found.low > high || way > 1.1 || are_more(small_growth)) return Answer::grows;
  return found.high > low + small_growth || way > 0.9 || are_more(0) ? Answer::unclear : Answer::stable;
}

StepsByRuns::Answer StepsByRuns::answer(double step) const {
  Answer result = Answer::stable;
  for (const double time : times_) {
    const Eigen::MatrixXd g = tangent(step, time);
    if (!g.allFinite()) return Answer::grows;
    for (const Group& group : groups_) result = std::max(result, answer(group, g, step, time));
  }
  return result;
}

std::string StepsByRuns::text() const {
  std::string result = fmt::format("{} values", size());
  for (const Group& group : groups_)
    result += fmt::format(", {} states rate {:.4g} .. {:.4g} events {:.4g}", group.states.size(), group.rate.low,
                          group.rate.high, group.by_events);
  return result;
}

}  // namespace dpde::testing
