// SPDX-License-Identifier: Apache-2.0
#include "stability/trial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "stability/step_capabilities.h"

namespace dpde::stability {

namespace {

constexpr double disturbance = 1e-6, single_disturbance = 1e-3;  // of the largest value of a field
constexpr double roundings = 16;    // times sqrt(steps) rounding units: the difference that rounding may make
constexpr double cell_steps = 2e7;  // a run
constexpr int fewest_steps = 500, most_steps = 100'000, most_steps_with_solves = 4000;
constexpr int looks = 64;              // comparisons in a run; early ones each time the step count grew by a sixteenth
constexpr double out_of_bounds = 1e4;  // factor over the first disturbance, beyond the growth of the equations
constexpr double most_growth = 60;     // ln of the growth of the equations in a run
constexpr double most_of_others = 12;  // the same for other groups of states, whose rounding is in the differences
constexpr double tolerated = 1.25;     // growth over half a run

double largest_difference(const dpde_layout& layout, const std::vector<void*>& a, const std::vector<void*>& b,
                          const std::vector<double>& scales, std::vector<double>& first, std::vector<double>& second) {
  double largest = 0;
  for (std::size_t s = 0; s < a.size(); ++s) {
    if (scales[s] == 0) continue;
    copy_out(layout, a[s], first);
    copy_out(layout, b[s], second);
    double sum = 0;
    for (std::size_t i = 0; i < first.size(); ++i) sum += (first[i] - second[i]) * (first[i] - second[i]);
    const double difference = std::sqrt(sum / static_cast<double>(first.size())) / scales[s];
    largest = difference > largest || std::isnan(difference) ? difference : largest;
  }
  return std::isfinite(largest) ? largest : std::numeric_limits<double>::infinity();
}

/// Whether the state is the stored history of a multistep scheme.
bool is_memory(driver::Session& session, int state) {
  const model::State* known = session.problem().find_state(session.rollout().state_name(state));
  return known != nullptr && !known->history_of.empty();
}

/// The plain and the disturbed run.
class Pair {
 public:
  Pair(driver::Session& session, double step, const TrialOptions& options)
      : session_(session), plain_(setup(session, step)), disturbed_(setup(session, step)) {
    session.engine().begin_other(plain_);
    session.engine().begin_other(disturbed_);
    std::mt19937_64 random(options.seed);
    std::uniform_real_distribution<double> noise(-1, 1);
    const std::size_t cells = session.workspace().cell_count();
    first_.resize(cells);
    second_.resize(cells);
    const bool is_single = session.problem().scheme.real == Precision::f32;
    for (int s = 0; s < plain_.state_count(); ++s) {
      std::vector<double> values = session.initial(s);
      plain_.initial(s).copy_in(values);
      disturbed_.initial(s).copy_in(values);
      scales_.push_back(0);
      // Histories, of steps that were not made, and states of other groups stay undisturbed.
      if (is_memory(session, s) || !is_in(options.group, plain_.state_name(s))) continue;
      double scale = 0;
      for (const double v : values) scale = std::max(scale, std::abs(v));
      scales_.back() = scale > 0 ? scale : 1;
      std::vector<double> shares(cells);  // without a mean, whose drift may be physical
      for (double& share : shares) share = noise(random);
      const double mean = std::accumulate(shares.begin(), shares.end(), 0.0) / static_cast<double>(cells);
      for (std::size_t i = 0; i < cells; ++i)
        values[i] +=
            (is_single ? single_disturbance : disturbance) * scales_.back() * (shares[i] - (cells > 1 ? mean : 0));
      disturbed_.initial(s).copy_in(values);
    }
    plain_.restart();
    disturbed_.restart();
  }

  /// False if a solve finds no solution.
  bool advance(int steps) {
    try {
      plain_.advance(steps);
      disturbed_.advance(steps);
      return true;
    } catch (const NoSolution&) {
      return false;
    }
  }
  double difference() {
    return largest_difference(session_.workspace().layout(), plain_.present(), disturbed_.present(), scales_, first_,
                              second_);
  }

 private:
  /// Fixed steps: neither a Courant number nor an error tolerance splits them.
  static RolloutSetup setup(driver::Session& session, double step) {
    RolloutSetup result = session.engine().setup();
    result.dt = step;
    result.rate = result.trial = nullptr;
    result.rate_field.clear();
    return result;
  }

  driver::Session& session_;
  Rollout plain_, disturbed_;
  std::vector<double> scales_, first_, second_;
};

/// The number of steps that take some seconds; a solve costs about ten times the rest.
int steps_of_run(driver::Session& session) {
  const stencil::Module& module = session.compiled().stencil;
  StepCapabilities found;
  survey(module, module.find_program(session.compiled().step_name())->body, found);
  const double cells = static_cast<double>(session.workspace().cell_count());
  return static_cast<int>(
      std::clamp<double>(cell_steps / cells, fewest_steps, found.solves ? most_steps_with_solves : most_steps));
}

/// Whether growth is linear in time, as of a mean that drifts physically: the quarters of the run then end at ratios
/// 1 : 2 : 3 : 4. Exponential growth has the same factor from each quarter to the next.
bool is_drift(const std::array<double, 4>& quarters) {
  const double first = quarters[2] / quarters[1], second = quarters[3] / quarters[2];
  return first < 1.6 && second < 0.95 * first;
}

}  // namespace

std::optional<Trial> try_step(driver::Session& session, double step, const TrialOptions& options) {
  int wanted = options.steps > 0 ? options.steps : steps_of_run(session);
  const double by_right = options.growth_rate * step + options.growth_by_events;
  if (by_right > 0)  // longer runs could overflow by physical growth
    wanted = std::min(wanted, std::max(2, static_cast<int>(std::min(1e9, most_growth / by_right))));
  if (options.largest_rate > options.growth_rate)
    wanted =
        std::min(wanted, std::max(2, static_cast<int>(std::min(1e9, most_of_others / (options.largest_rate * step)))));
  wanted = std::min(wanted, std::max(2, static_cast<int>(std::min(1e9, options.most_time / step))));
  Pair pair(session, step, options);
  const double begin = pair.difference();
  Trial result{step, true, 1, 0};
  double last = begin;
  std::array<double, 4> quarters{};  // the largest difference in each
  while (result.steps < wanted) {
    if (options.stop != nullptr && options.stop->load()) return std::nullopt;
    const int now = std::min({std::max(1, std::min(result.steps / 16, wanted / looks)), wanted - result.steps});
    const bool has_solution = pair.advance(now);
    if (options.stop != nullptr && options.stop->load())
      return std::nullopt;  // one run may have stopped before the other
    result.steps += now;
    const double allowed = (by_right + options.growth_rate * step) * result.steps;
    const double difference = has_solution ? pair.difference() : std::numeric_limits<double>::infinity();
    if (!(difference < begin * out_of_bounds * std::exp(allowed))) {
      result.growth =
          std::isfinite(difference) ? std::pow(difference / last, 1.0 / now) : std::numeric_limits<double>::infinity();
      result.is_stable = false;
      return result;
    }
    last = difference;
    double& largest = quarters[static_cast<std::size_t>(4.0 * (result.steps - 1) / wanted)];
    largest = std::max(largest, difference);
  }
  const double half = 0.5 * wanted;
  const double unit = session.problem().scheme.real == Precision::f64 ? 0x1p-53 : 0x1p-24;
  const double rounding = unit * std::max(1.0, roundings * std::sqrt(wanted));
  if (quarters[3] > rounding) result.growth = std::pow(quarters[3] / std::max(quarters[1], rounding), 1 / half);
  const double allowed = std::log(tolerated) + (by_right + options.growth_rate * step) * half;
  result.is_stable = std::log(result.growth) * half <= allowed || is_drift(quarters);
  return result;
}

Search search_limit(driver::Session& session, double guess, double precision, double range, const TrialOptions& options,
                    const std::function<void(const Trial&)>& tell) {
  Search result;
  const auto is_stable = [&](double step) {
    const std::optional<Trial> trial = try_step(session, step, options);
    result.was_stopped = result.was_stopped || !trial;
    if (!trial) return false;
    result.trials.push_back(*trial);
    (trial->is_stable ? result.largest : result.smallest_unstable) = step;
    if (tell) tell(*trial);
    return trial->is_stable;
  };
  if (is_stable(guess)) {
    for (double step = guess * 1.1; step <= guess * range && is_stable(step); step *= 1.3) {
    }
  } else {
    for (double step = guess / 1.1; step >= guess / range && !result.was_stopped && !is_stable(step); step /= 1.3) {
    }
  }
  while (!result.was_stopped && result.largest > 0 && result.smallest_unstable > 0 &&
         result.smallest_unstable - result.largest > precision * result.largest) {
    is_stable(0.5 * (result.largest + result.smallest_unstable));
  }
  std::ranges::sort(result.trials, {}, &Trial::step);
  return result;
}

}  // namespace dpde::stability
