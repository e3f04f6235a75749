// SPDX-License-Identifier: Apache-2.0
#include "analysis/run/gradient_growth.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace dpde::analysis {

namespace {

constexpr int most_looks = 256;
constexpr double work_of_pair = 1e9;  // cells times samples
constexpr int fewest_pairs = 64, most_pairs = 2048;
constexpr double same_rate = 0.7;  // relative to the growth rate at half the step
/// A gradient depends on the states' divergence; its relative change is about thirty times that of the states.
constexpr double sensitivity_of_gradients = 30;
constexpr std::uint64_t seed_of_pair = 20261125;

double unit_rounding(Precision real) { return real == Precision::f64 ? 0x1p-53 : 0x1p-24; }

/// Times, and logarithms of growth, which itself may overflow.
using Logarithms = std::vector<std::pair<double, double>>;

/// Least-squares slope, and the largest rise above the first value.
std::optional<Growth> fit(const Logarithms& line) {
  const auto n = static_cast<double>(line.size());
  double mean_t = 0, mean_y = 0, products = 0, squares = 0;
  for (const auto& [t, y] : line) {
    mean_t += t / n;
    mean_y += y / n;
  }
  Growth growth;
  for (const auto& [t, y] : line) {
    products += (t - mean_t) * (y - mean_y);
    squares += (t - mean_t) * (t - mean_t);
    growth.logarithm = std::max(growth.logarithm, y - line.front().second);
  }
  if (n < 3 || squares == 0) return std::nullopt;
  growth.rate = products / squares;
  return growth;
}

/// The session's run from its initial state, and a run from a perturbed start.
class Pair {
 public:
  Pair(driver::Session& session, int parts)
      : layout_(session.workspace().layout()),
        own_(setup_of(session, parts)),
        other_(setup_of(session, parts)),
        part_(std::sqrt(unit_rounding(session.problem().scheme.real))) {
    session.engine().begin_other(own_);
    session.engine().begin_other(other_);
    const auto cells = static_cast<std::size_t>(session.workspace().cell_count());
    states_.assign(static_cast<std::size_t>(own_.state_count()), std::vector<double>(cells));
    beside_ = states_;
    // Separately chosen steps would differ by more than the perturbation.
    if (session.problem().substeps.control) other_.follow(&own_.record());
    perturb();
  }

  double size() const { return norm_of(states_); }

  /// Growth of the difference over `steps` steps. Then rescales the difference to its first relative size. Not finite
  /// if a run is not.
  double advance(int steps) {
    if (own_.advance(steps).blow_up || other_.advance(steps).blow_up) return INFINITY;
    const double before = distance_;
    look();
    const double growth = distance_ / before;
    if (!(growth > 0) || !std::isfinite(growth)) return growth;
    const double scale = part_ * size() / distance_;
    for (std::size_t s = 0; s < states_.size(); ++s) {
      for (std::size_t i = 0; i < states_[s].size(); ++i)
        beside_[s][i] = states_[s][i] + (beside_[s][i] - states_[s][i]) * scale;
      copy_in(layout_, other_.present()[s], beside_[s]);
    }
    look();
    return growth;
  }

 private:
  static RolloutSetup setup_of(driver::Session& session, int parts) {
    RolloutSetup setup = session.engine().setup();
    setup.dt /= parts;
    setup.steps = setup.steps * parts;
    return setup;
  }

  static double norm_of(const std::vector<std::vector<double>>& states) {
    double sum = 0;
    for (const std::vector<double>& values : states) {
      for (const double v : values) sum += v * v;
    }
    return std::sqrt(sum);
  }

  void perturb() {
    std::mt19937_64 random(seed_of_pair);
    std::normal_distribution<double> normal;
    for (int s = 0; s < own_.state_count(); ++s) {
      std::vector<double>& values = states_[static_cast<std::size_t>(s)];
      own_.initial(s).copy_out(values);
      const double scale = norm_of({values}) / std::sqrt(static_cast<double>(values.size()));
      for (double& v : values) v += part_ * (scale > 0 ? scale : 1) * normal(random);
      other_.initial(s).copy_in(values);
    }
    own_.restart();
    other_.restart();
    look();
  }

  void look() {
    double sum = 0;
    for (std::size_t s = 0; s < states_.size(); ++s) {
      copy_out(layout_, own_.present()[s], states_[s]);
      copy_out(layout_, other_.present()[s], beside_[s]);
      for (std::size_t i = 0; i < states_[s].size(); ++i) {
        const double d = beside_[s][i] - states_[s][i];
        sum += d * d;
      }
    }
    distance_ = std::sqrt(sum);
  }

  dpde_layout layout_;
  Rollout own_, other_;
  std::vector<std::vector<double>> states_, beside_;
  double part_;  // initial size of the difference relative to the state
  double distance_ = 0;
};

}  // namespace

AdjointWatch::AdjointWatch(driver::Session& session, int steps) : session_(session) {
  session.engine().watch_gradients(
      [this](const GradientProgress& now) {
        if (!now.is_back) return true;
        const double norm = session_.rollout().adjoint_norm();
        if (norm > 0 && std::isfinite(norm)) looks_.push_back({now.time, norm});
        return true;
      },
      std::max(1, 2 * steps / most_looks));
}

AdjointWatch::~AdjointWatch() { session_.engine().watch_gradients({}, 1); }

std::optional<Growth> growth_of_adjoint(const std::vector<AdjointWatch::Look>& looks) {
  Logarithms line;
  for (const AdjointWatch::Look& look : looks) line.emplace_back(-look.time, std::log(look.norm));
  return fit(line);
}

std::optional<PerturbationGrowth> growth_of_perturbation(driver::Session& session, int steps, int parts) {
  Pair pair(session, parts);
  const double cells = static_cast<double>(session.workspace().cell_count());
  const int pairs = std::min(steps, std::clamp(static_cast<int>(work_of_pair / cells), fewest_pairs, most_pairs));
  const double first_size = pair.size();
  double logarithm = 0;
  int done = 0;
  Logarithms line{{0, 0}}, course{{0, 0}};
  for (int i = 1; i <= pairs; ++i) {
    const int next = static_cast<int>(static_cast<std::int64_t>(steps) * i / pairs);
    const double growth = pair.advance((next - done) * parts);
    if (!(growth > 0) || !std::isfinite(growth)) return std::nullopt;
    done = next;
    logarithm += std::log(growth);
    line.emplace_back(done * session.problem().step, logarithm);
    course.emplace_back(line.back().first, logarithm + std::log(first_size / pair.size()));
  }
  const std::optional<Growth> growth = fit(line);
  if (!growth) return std::nullopt;
  return PerturbationGrowth{*growth, course.back().second, course};
}

double time_within(const std::vector<std::pair<double, double>>& course, double most) {
  double smallest = 0, within = 0;
  for (const auto& [time, logarithm] : course) {
    smallest = std::min(smallest, logarithm);
    if (logarithm - smallest > most) break;
    within = time;
  }
  return within;
}

std::optional<bool> GradientGrowth::is_of_equations() const {
  if (!perturbation || !at_half_step) return std::nullopt;
  return at_half_step->growth.rate > same_rate * perturbation->growth.rate;
}

std::optional<GradientGrowth> gradient_growth(driver::Session& session, const std::vector<AdjointWatch::Look>& looks,
                                              const std::function<double()>& beside) {
  const std::optional<Growth> adjoint = growth_of_adjoint(looks);
  if (!adjoint) return std::nullopt;
  GradientGrowth result;
  result.adjoint = *adjoint;
  const model::Problem& problem = session.problem();
  int steps = 0;
  for (const model::Loss& loss : problem.task->losses) steps = std::max(steps, session.steps_of(loss.when).back());
  result.window = steps * problem.step;
  const double unit = unit_rounding(problem.scheme.real);
  if (adjoint->logarithm + std::log(unit) < std::log(1e-3 * largest_rounding)) return result;
  result.perturbation = growth_of_perturbation(session, steps);
  if (!result.perturbation) return result;
  result.rounding = std::exp(std::min(std::log(unit) + result.perturbation->relative, 0.0));
  double sensitivity = sensitivity_of_gradients;
  if (!result.is_lost() && beside != nullptr) {
    const double of_gradient = std::min(beside(), 1.0);
    sensitivity = std::max(sensitivity, of_gradient / result.rounding);
    result.is_of_gradient = of_gradient > std::max(result.rounding, largest_rounding);
    result.rounding = std::max(result.rounding, of_gradient);
  }
  if (!result.is_lost()) return result;
  if (problem.controls.empty() && problem.events.empty() && !problem.has_parts())
    result.at_half_step = growth_of_perturbation(session, steps, 2);
  result.safe_window = time_within(result.perturbation->course, std::log(largest_rounding / (sensitivity * unit)));
  return result;
}

}  // namespace dpde::analysis
