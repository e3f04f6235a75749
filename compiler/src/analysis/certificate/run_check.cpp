// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/run_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <utility>

#include "analysis/certificate/rounding_of_run.h"
#include "analysis/certificate/solve_tolerance.h"
#include "analysis/certificate/taylor.h"
#include "analysis/generic_point.h"
#include "analysis/kinks.h"
#include "dpde/runtime/error.h"
#include "driver/memory/cpu_time.h"
#include "driver/scene/window_start.h"
#include "network/symmetrise.h"

namespace dpde::analysis {

namespace {

constexpr int fewest_steps = 3, most_steps = 12;
constexpr std::uint64_t first_seed = 20240229, other_seeds[] = {20240301, 20240302, 20240303};

/// The smallest grid that is wider than most stencils.
std::vector<int> cells_of_run(const driver::Compiled& compiled) {
  constexpr int cells[3][3] = {{6}, {5, 4}, {4, 3, 2}};
  const std::size_t rank = compiled.problem->axes.size();
  return network::grid_for(compiled.stencil.networks, std::vector<int>(cells[rank - 1], cells[rank - 1] + rank));
}

/// Enough steps to fill the history of multistep schemes and to reach, if near, the second interval of every control
/// and event.
int steps_of_run(const model::Problem& problem) {
  int steps = fewest_steps;
  const auto reach = [&](int every) {
    if (every < most_steps) steps = std::max(steps, every + 1);
  };
  for (const model::Control& control : problem.controls) reach(control.every);
  for (const model::Coefficient& coefficient : problem.coefficients) reach(coefficient.every);
  for (const model::Event& event : problem.events) reach(event.every);
  return std::min(steps, problem.steps);
}

/// Steps and tolerances of difference quotients in a precision.
struct Precisions {
  std::vector<double> steps;
  double spacing, unit, rounding_of_derivative, largest_error;
};

Precisions precisions_of(const driver::Compiled& compiled) {
  Precisions result{{}, 1e-8, 0x1p-52, 1e-11, largest_quotient_error};
  for (double h = 1e-2; h > 1e-8; h /= 4) result.steps.push_back(h);
  if (!compiled.is_single()) return result;
  result = {{}, 1e-4, 0x1p-24, 1e-4, largest_single_quotient_error};
  for (double h = 0.2; h > 1e-3; h /= 2) result.steps.push_back(h);
  return result;
}

class RunChecker {
 public:
  /// Rounding at a point along a direction.
  using Rounding = std::function<RunRounding(const Eigen::VectorXd&, const Eigen::VectorXd&)>;

  /// The check must end `seconds` after `start`. `stop`: the session's stop flag.
  RunChecker(driver::Session& session, driver::Inverse& inverse, Rounding rounding, double start, double seconds,
             std::atomic<bool>& stop, RunCheck& result)
      : session_(session),
        inverse_(inverse),
        rounding_(std::move(rounding)),
        stop_(stop),
        precisions_(precisions_of(session.compiled())),
        seconds_(seconds),
        start_(start),
        result_(result),
        may_jump_(has_jumps(session.compiled())) {}

  /// Returns false if the run is impossible or there is no time for it.
  bool check();

 private:
  double spent() const { return driver::thread_cpu_seconds() - start_; }
  double not_at_rest(const SteadyAdjoint& adjoint) const;
  bool comes_to_rest();
  void watch_steady();
  bool begin(std::uint64_t seed);
  double loss_at(const Eigen::VectorXd& x);
  bool begin_elsewhere();
  QuotientEvidence evidence_for(const driver::Inverse::Part* part);
  Line line_along(const Eigen::VectorXd& direction);
  Eigen::VectorXd direction_in(const driver::Inverse::Part* part) const;
  bool jumps(const driver::Inverse::Part* part);
  void check_direction(const driver::Inverse::Part* part);
  bool check_directions(const std::string& what);
  void leave_out(const std::string& what, const std::string& why) { result_.left_out.push_back(what + ": " + why); }
  std::string run_text() const;
  std::optional<SolveNote> stopped_early() const;

  driver::Session& session_;
  driver::Inverse& inverse_;
  Rounding rounding_;
  std::atomic<bool>& stop_;
  Precisions precisions_;
  double seconds_;
  double start_;
  RunCheck& result_;
  Point point_;
  Eigen::VectorXd gradient_;
  double seconds_a_loss_ = 0;
  double moved_at_end_ = 0;  // for a run until steady: uncertainty of the steady state in a loss
  bool may_jump_;
  bool is_out_of_time_ = false;
};

/// Bound of the difference between the loss at the end of a run until steady and that of the steady state. The last
/// change may be anywhere between 0 and the tolerance; the error is proportional to it.
double RunChecker::not_at_rest(const SteadyAdjoint& adjoint) const {
  const double change = adjoint.state.change, tolerance = session_.problem().steady;
  return change > 0 ? std::abs(adjoint.unsteady) * std::max(1.0, tolerance / change) : 0;
}

/// Whether the run until steady ends in time; its number of steps is not known beforehand. The gradient takes such a
/// run and a reverse sweep, the check at least one more run.
bool RunChecker::comes_to_rest() {
  constexpr int steps_between_looks = 16;
  inverse_.assign(point_.x);
  const double before = spent();
  const RunResult run = session_.rollout().run(
      {.every = steps_between_looks, .call = [&](const Snapshot&) { stop_ = spent() > seconds_; }});
  stop_ = false;
  is_out_of_time_ = run.stopped || spent() + 2 * (spent() - before) > seconds_;
  return !is_out_of_time_;
}

/// Limits the time of the gradient: the adjoint of a steady state is a linear solve of unknown duration, and so are
/// runs near the point.
void RunChecker::watch_steady() {
  const auto has_time = [this](const GradientProgress&) {
    is_out_of_time_ = is_out_of_time_ || spent() > seconds_;
    return !is_out_of_time_;
  };
  session_.engine().watch_gradients(has_time, 1);
}

/// Sets the point and its gradient. Returns false if that is not finite or there is no time for it.
bool RunChecker::begin(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  point_ = generic_point(session_, inverse_, random);
  gradient_ = Eigen::VectorXd::Zero(inverse_.size());
  try {
    inverse_.hold_steps(false);
    if (result_.is_steady && !comes_to_rest()) return false;
    if (result_.is_steady) watch_steady();
    const double loss = inverse_.value_and_gradient(point_.x, gradient_);
    if (!std::isfinite(loss) || is_out_of_time_) return false;
    inverse_.hold_steps(true);
    moved_at_end_ = inverse_.last().steady ? not_at_rest(*inverse_.last().steady) : 0;
    const double before = spent();
    const bool finite = gradient_.allFinite() && std::isfinite(loss_at(point_.x));
    seconds_a_loss_ = spent() - before;
    return finite;
  } catch (const NoSolution&) {
    return false;
  }
}

/// NaN if a solve has no solution for the made-up values.
double RunChecker::loss_at(const Eigen::VectorXd& x) {
  try {
    return inverse_.value(x);
  } catch (const NoSolution&) {
    return std::nan("");
  }
}

/// Tries other points. Returns false, back at the first point, if none of them is finite.
bool RunChecker::begin_elsewhere() {
  for (const std::uint64_t seed : other_seeds) {
    if (begin(seed)) return true;
  }
  begin(first_seed);
  return false;
}

/// Direction in one unknown, or in all of them.
Eigen::VectorXd RunChecker::direction_in(const driver::Inverse::Part* part) const {
  if (part == nullptr) return point_.direction;
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(point_.direction.size());
  direction.segment(part->offset, part->size) = point_.direction.segment(part->offset, part->size);
  return direction;
}

Line RunChecker::line_along(const Eigen::VectorXd& direction) {
  return [this, direction](double step) { return loss_at(point_.x + step * direction); };
}

/// Whether the loss jumps near the point, so that quotients of larger steps converge to another number.
bool RunChecker::jumps(const driver::Inverse::Part* part) {
  if (!may_jump_) return false;
  const Eigen::VectorXd direction = direction_in(part);
  const Line loss = line_along(direction);
  const std::optional<JumpOnLine> jump = jump_beside(loss, gradient_.dot(direction), precisions_.steps,
                                                     rounding_of(loss, precisions_.spacing, precisions_.unit));
  if (!jump) return false;
  const std::string name = part == nullptr ? "all unknowns" : part->name;
  leave_out(name, fmt::format("the loss of {} jumps by {:.2e}", run_text(), jump->size));
  return true;
}

QuotientEvidence RunChecker::evidence_for(const driver::Inverse::Part* part) {
  const Eigen::VectorXd direction = direction_in(part);
  const Line loss = line_along(direction);
  const double terms = gradient_.cwiseAbs().dot(direction.cwiseAbs());
  // A state may not move at all if each step changes it by less than its rounding; values at close points do not show
  // that.
  const double size = std::max(std::abs(loss(0)), gradient_.cwiseAbs().dot(point_.x.cwiseAbs()));
  const double standstill = (1 + result_.steps) * precisions_.unit * size;
  const double rounding =
      std::max({rounding_of(loss, precisions_.spacing, precisions_.unit), standstill, moved_at_end_});
  DirectionalDerivative derivative{gradient_.dot(direction), precisions_.rounding_of_derivative * terms};
  std::vector<Quotient> quotients = quotients_of(loss, precisions_.steps, rounding);
  const QuotientEvidence found = judge(quotients, derivative);
  if (!found.is_elsewhere || result_.is_steady) return found;
  const RunRounding of_terms = rounding_(point_.x, direction);  // the sizes above miss terms that cancel
  derivative.rounding += of_terms.derivative;
  for (Quotient& quotient : quotients) quotient.rounding = std::max(quotient.rounding, of_terms.loss / quotient.step);
  return judge(quotients, derivative);
}

/// An error counts only if it occurs at two points: at one of them a kink may be nearer than any step. Reports nothing
/// if time runs out.
void RunChecker::check_direction(const driver::Inverse::Part* part) {
  const std::string name = part == nullptr ? "all unknowns" : part->name;
  QuotientEvidence found = evidence_for(part);
  if (found.is_elsewhere) {
    if (!begin_elsewhere() && !is_out_of_time_) {
      result_.is_in_doubt = true;
      return leave_out(name, fmt::format("at one point quotients and gradient differ by {:.2e}, and no other is finite",
                                         found.error.value_or(NAN)));
    }
    found = evidence_for(part);
  }
  if (is_out_of_time_) return;
  if (const std::optional<SolveNote> note = found.is_elsewhere ? stopped_early() : std::nullopt) {
    result_.stops_early = true;
    return leave_out(
        name, fmt::format("the solve for {} {} with {:.3g} of the right side left: the gradient is off by {:.2e}",
                          note->unknown, note->missed > 0 ? "was stopped early, as warn says," : "ends", note->residual,
                          found.error.value_or(NAN)));
  }
  if (jumps(part) || is_out_of_time_) return;
  if (found.is_elsewhere) {
    result_.wrong = fmt::format("difference quotients of {} and the gradient by {} differ by {:.2e}", run_text(), name,
                                found.error.value_or(NAN));
  } else if (!found.is_resolved(precisions_.largest_error)) {
    leave_out(name, gradient_.dot(direction_in(part)) == 0
                        ? fmt::format("the loss of {} does not change with it beside the point, and its derivative is "
                                      "0: {}",
                                      run_text(), causes_of_zero(session_.compiled()))
                    : moved_at_end_ > 0 ? "the tolerance of until steady hides what it does to the loss; a smaller one "
                                          "shows it"
                                        : "rounding hides what it does to the loss of " + run_text());
  } else if (!found.proves(precisions_.largest_error)) {
    leave_out(name, "difference quotients settle on no number, as where kinks or jumps are dense");
  } else {
    ++result_.directions;
    std::erase_if(result_.untested,
                  [&](const std::string& unknown) { return part == nullptr || unknown == part->name; });
    result_.rounding = std::max(result_.rounding, found.rounding);
    if (!result_.unknown.empty() && *found.error <= result_.error) return;
    result_.unknown = name;
    result_.error = *found.error;
  }
}

std::string RunChecker::run_text() const {
  return result_.is_steady ? fmt::format("runs until steady on {} cells", result_.grid)
                           : fmt::format("{} steps on {} cells", result_.steps, result_.grid);
}

/// A solve, forward or adjoint, that missed its tolerance with a warning, or that has a loose tolerance.
std::optional<SolveNote> RunChecker::stopped_early() const {
  const bool are_loose = has_loose_solves(session_.compiled());
  std::optional<SolveNote> worst;
  for (const auto& notes : {session_.rollout().solve_notes(), session_.rollout().adjoint_solve_notes()}) {
    for (const SolveNote& note : notes) {
      const bool is_left = note.missed > 0 || (are_loose && note.iterations > 0);
      if (is_left && (!worst || note.residual > worst->residual)) worst = note;
    }
  }
  return worst;
}

bool RunChecker::check() {
  const std::string what = result_.is_steady ? "the steady state" : "the whole run";
  if (!begin(first_seed)) {
    result_.lacked_time = is_out_of_time_;
    leave_out(what, is_out_of_time_     ? "no time"
                    : result_.is_steady ? "on a few cells it does not become steady, or its gradient is not finite"
                                        : "on a few cells its loss or its gradient is not finite");
    return false;
  }
  const double seconds_a_direction = seconds_a_loss_ * (9.0 + 2.0 * static_cast<double>(precisions_.steps.size()));
  const auto affords = [&](std::size_t directions) {
    return spent() + static_cast<double>(directions) * seconds_a_direction <= seconds_;
  };
  result_.lacked_time = !affords(inverse_.parts().size());
  if (!affords(1)) {
    leave_out(what, "no time");
    return false;
  }
  return check_directions(what);
}

/// Time suffices for at least one direction, as estimated from a loss. Returns false if time ran out before any was
/// certified.
bool RunChecker::check_directions(const std::string& what) {
  if (result_.lacked_time) {
    leave_out("each unknown by itself", "no time");
    check_direction(nullptr);
  } else {
    for (const driver::Inverse::Part& part : inverse_.parts()) {
      if (!is_out_of_time_) check_direction(&part);
      if (!result_.wrong.empty()) return true;
      if (is_out_of_time_ && result_.directions > 0) leave_out(part.name, "no time");
    }
  }
  if (!is_out_of_time_) return true;
  result_.lacked_time = true;
  if (result_.directions == 0) leave_out(what, "no time");
  return result_.directions > 0;
}

/// Checks a run of `steps` steps; nullopt: until steady. Returns false if it is impossible or there is no time for it.
bool check_steps(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                 std::optional<int> steps, double start, double seconds, RunCheck& result) {
  const driver::FirstWindow window = driver::first_window(*compiled, source);
  if (!window.missing.empty())
    result.left_out.push_back("windows of the data: no frame is at hand, runs begin as the scene does: " +
                              window.missing);
  driver::SessionOptions options;
  options.window = window.start;
  options.cells = cells_of_run(*compiled);
  options.steps = steps;
  options.made_up = true;
  std::atomic<bool> stop{false};
  options.stop = &stop;
  DiagnosticSink silent;  // the later run reports errors of the input
  const auto session = driver::Session::open(source, compiled, options, silent);
  const auto inverse = session ? driver::Inverse::open(*session, source, silent) : nullptr;
  if (!inverse) {
    result.left_out.emplace_back("the whole run: it does not start on a few cells");
    return false;
  }
  result.untested = unknowns_of(*compiled);
  result.steps = session->steps();
  result.is_steady = session->is_until_steady();
  result.grid = fmt::format("{}", fmt::join(options.cells, " x "));
  result.window = window.start ? driver::text_of(*window.start) : "";
  const auto rounding = [&](const Eigen::VectorXd& x, const Eigen::VectorXd& direction) {
    return rounding_of_run(source, *compiled, options, x, direction);
  };
  return RunChecker(*session, *inverse, rounding, start, seconds, stop, result).check();
}

/// Checks the run with the code as compiled.
RunCheck check_own_run(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                       double seconds) {
  const double start = driver::thread_cpu_seconds();
  RunCheck result;
  if (!compiled->problem || !compiled->problem->task) return result;
  const model::Problem& problem = *compiled->problem;
  if (problem.task->unknowns.empty() || problem.task->losses.empty()) return result;
  result.untested = unknowns_of(*compiled);
  const double of_steady = seconds / 2;  // if that is not enough, a short run has the other half
  if (problem.steady > 0 && check_steps(source, compiled, std::nullopt, start, of_steady, result)) return result;
  const bool lacked_time = result.lacked_time;
  check_steps(source, compiled, steps_of_run(problem), start, seconds, result);
  result.lacked_time = result.lacked_time || lacked_time;
  return result;
}

}  // namespace

std::vector<std::string> unknowns_of(const driver::Compiled& compiled) {
  std::vector<std::string> names;
  if (!compiled.problem || !compiled.problem->task) return names;
  for (const model::Unknown& unknown : compiled.problem->task->unknowns) names.push_back(unknown.name);
  return names;
}

std::string causes_of_zero(const driver::Compiled& compiled) {
  const char* const of_single = compiled.is_single() ? ", or below what f32 holds (--set real=f64)" : "";
  return fmt::format(
      "an unknown may act after the loss looks, behind a clamp that holds, or in a ramp narrower than a step or a cell "
      "(write that wider){}",
      of_single);
}

RunCheck check_run(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled, double seconds) {
  RunCheck result = check_own_run(source, compiled, seconds);
  if (!result.stops_early || !result.wrong.empty()) return result;
  DiagnosticSink silent;
  std::optional<driver::Compiled> done = driver::compile(source, with_solves_done(*compiled), silent);
  if (done)
    result.wrong = check_own_run(source, std::make_shared<const driver::Compiled>(std::move(*done)), seconds).wrong;
  return result;
}

}  // namespace dpde::analysis
