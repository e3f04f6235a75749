// SPDX-License-Identifier: Apache-2.0
#include "stability/report/local_character.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <iterator>
#include <numbers>

#include "stability/equations.h"
#include "stability/frozen/consistent_start.h"
#include "stability/frozen/frozen_points.h"
#include "stability/waves/amplification.h"
#include "stability/waves/courant_number.h"
#include "stability/waves/step_of_rates.h"

namespace dpde::stability {

namespace {

using Complex = std::complex<double>;

constexpr double every_step = std::numeric_limits<double>::infinity();
constexpr double negative = -1e-12;  // of the largest weight: rounding
constexpr double negative_of_sums = -1e-11;
constexpr double shortest_try = 1e-6, first_positive_try = 1e-3, last_positive_try = 1e4, step_factor = 1.1,
                 step_factor_with_solves = 2;  // in units of 1 / largest rate
constexpr double step_precision = 1e-7;

bool is_positive(const LinearisedStep& response) {
  double smallest = 0, largest = 0;
  for (const LinearForm& row : response.rows) {
    for (const LinearForm::Term& term : row.terms()) {
      smallest = std::min(smallest, term.coefficient);
      largest = std::max(largest, std::abs(term.coefficient));
    }
  }
  return smallest >= negative * largest;
}

/// The product of two linear steps: each offset that a row of `outer` reads is replaced by the row of `inner` there.
LinearisedStep applied_to(const LinearisedStep& outer, const LinearisedStep& inner) {
  LinearisedStep result;
  FormSum sum;
  for (const LinearForm& row : outer.rows) {
    for (const LinearForm::Term& term : row.terms()) {
      const LinearForm& read = inner.rows[static_cast<std::size_t>(LinearForm::component_of(term.key))];
      sum.add(read, LinearForm::offset_of(term.key), term.coefficient);
    }
    result.rows.push_back(sum.take());
  }
  return result;
}

/// The weights of a step that is a polynomial of L (see step_of_rates.h). Powers of L are computed once for steps of
/// all lengths.
class WeightsByLength {
 public:
  WeightsByLength(const LinearisedStep& rates, const std::vector<double>& polynomial) {
    std::vector<LinearisedStep> powers(1);
    for (std::size_t row = 0; row < rates.rows.size(); ++row) powers[0].rows.emplace_back(static_cast<int>(row));
    while (powers.size() < polynomial.size()) powers.push_back(applied_to(rates, powers.back()));
    std::vector<std::vector<std::int64_t>> places;  // offsets that some power reads, for each row
    for (std::size_t row = 0; row < rates.rows.size(); ++row) {
      std::vector<std::int64_t>& of_row = places.emplace_back();
      for (const LinearisedStep& power : powers)
        std::ranges::transform(power.rows[row].terms(), std::back_inserter(of_row), &LinearForm::Term::key);
      std::ranges::sort(of_row);
      of_row.erase(std::unique(of_row.begin(), of_row.end()), of_row.end());
    }
    by_powers_.setZero(count_of(places), std::ssize(polynomial));
    Eigen::Index first = 0;
    for (std::size_t row = 0; row < places.size(); first += std::ssize(places[row++])) {
      for (std::size_t k = 0; k < powers.size(); ++k) {
        auto place = places[row].begin();  // terms are in their order
        for (const LinearForm::Term& term : powers[k].rows[row].terms()) {
          place = std::find(place, places[row].end(), term.key);
          by_powers_(first + (place - places[row].begin()), static_cast<Eigen::Index>(k)) =
              polynomial[k] * term.coefficient;
        }
      }
    }
  }

  bool are_positive(double length) const {
    Eigen::VectorXd powers = Eigen::VectorXd::Ones(by_powers_.cols());
    for (Eigen::Index k = 1; k < powers.size(); ++k) powers[k] = powers[k - 1] * length;
    const Eigen::VectorXd weights = by_powers_ * powers;
    return weights.minCoeff() >= negative * weights.cwiseAbs().maxCoeff();
  }

 private:
  static Eigen::Index count_of(const std::vector<std::vector<std::int64_t>>& places) {
    Eigen::Index count = 0;
    for (const std::vector<std::int64_t>& of_row : places) count += std::ssize(of_row);
    return count;
  }

  Eigen::MatrixXd by_powers_;  // a line each
};

/// Inverse Fourier transform, axis by axis: from values of waves to values in the cells of a ring.
void add_up_waves(std::vector<Complex>& values, int along, int rank) {
  std::size_t stride = 1;
  const auto count = static_cast<std::size_t>(along);
  std::vector<Complex> line(count);
  for (int axis = 0; axis < rank; ++axis, stride *= count) {
    for (std::size_t first = 0; first < values.size(); ++first) {
      if (first / stride % count != 0) continue;
      for (std::size_t k = 0; k < count; ++k) {
        line[k] = 0;
        for (std::size_t wave = 0; wave < count; ++wave)
          line[k] += values[first + wave * stride] *
                     std::polar(1.0 / along, 2 * std::numbers::pi * static_cast<double>(wave * k % count) / along);
      }
      for (std::size_t k = 0; k < count; ++k) values[first + k * stride] = line[k];
    }
  }
}

/// The same for a step with solves: its weights extend to all cells, here of a small ring.
bool is_positive(const Amplification& step, int rank) {
  constexpr int cells_along[] = {64, 16, 8};
  const int along = cells_along[rank - 1];
  const auto count = static_cast<std::size_t>(std::lround(std::pow(along, rank)));
  std::vector<Eigen::MatrixXcd> waves;
  for (std::size_t i = 0; i < count; ++i) {
    Angles angles{};
    std::size_t rest = i;
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank); ++axis, rest /= static_cast<std::size_t>(along))
      angles[axis] = 2 * std::numbers::pi * static_cast<double>(rest % static_cast<std::size_t>(along)) / along;
    waves.push_back(step.at(angles));
  }
  double smallest = 0, largest = 0;
  std::vector<Complex> weights(count);
  for (Eigen::Index entry = 0; entry < waves.front().size(); ++entry) {
    for (std::size_t i = 0; i < count; ++i) weights[i] = waves[i].data()[entry];
    add_up_waves(weights, along, rank);
    for (const Complex& weight : weights) {
      smallest = std::min(smallest, weight.real());
      largest = std::max(largest, std::abs(weight.real()));
    }
  }
  return smallest >= negative_of_sums * largest;
}

/// The largest rate of a step with solves, from a short step.
double rate_of(const LinearStep& linear, const FrozenPoint& point, int rank, double step) {
  const double dt = shortest_try * step;
  const std::optional<LinearisedStep> rows = linear.response(point, dt);
  if (!rows) return 0;
  const Amplification short_step(*rows, rank);
  const auto change = [&](const Angles& angles) {
    const Eigen::MatrixXcd at = short_step.at(angles);
    return (at - Eigen::MatrixXcd::Identity(at.rows(), at.cols())).cwiseAbs().maxCoeff();
  };
  return largest_over_waves(rank, change).value / dt;
}

/// The largest change of the states in a step.
double change_of(const LinearisedStep& rows) {
  LinearisedStep change;
  for (std::size_t row = 0; row < rows.rows.size(); ++row)
    change.rows.push_back(rows.rows[row].plus(LinearForm(static_cast<int>(row)).times(-1)));
  return magnitude_of(change);
}

/// The largest step up to which `holds` is true, for rates of at most `rate`.
double largest_step_where(double rate, double factor, const std::function<bool(double)>& holds) {
  if (rate == 0) return every_step;
  if (!holds(shortest_try / rate)) return 0;
  double low = first_positive_try / rate;
  if (!holds(low)) return 0;
  double high = low;
  while (holds(high)) {
    low = high;
    if (high > last_positive_try / rate) return every_step;
    high *= factor;
  }
  while (high - low > step_precision * high) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace

namespace {

/// The step of a problem at its points, if it is a polynomial of L.
class StepsByLength {
 public:
  StepsByLength(const model::Problem& problem, const LinearStep& linear)
      : equations_(problem, linear.group()),
        step_of_rates_(equations_.step_of_rates()),
        polynomial_(step_of_rates_.polynomial()),
        rank_(static_cast<int>(problem.axes.size())) {
    if (!polynomial_.empty()) places_ = equations_.places_in(linear);
  }

  struct Found {
    double rate;  // the largest
    WeightsByLength weights;
  };
  /// `rows`: the response of a step of this length; nullopt if it is no such polynomial.
  std::optional<Found> at(const FrozenPoint& point, const LinearisedStep& rows, double step) const {
    if (polynomial_.empty()) return std::nullopt;
    const std::optional<LinearisedStep> rates = equations_.rates_at(point);
    if (!rates) return std::nullopt;
    if (!step_of_rates_.makes(Amplification(rows, rank_), Amplification(*rates, rank_), places_, step))
      return std::nullopt;
    return Found{magnitude_of(*rates), WeightsByLength(*rates, polynomial_)};
  }

 private:
  Equations equations_;
  StepOfRates step_of_rates_;
  std::vector<double> polynomial_;
  std::vector<StepOfRates::Place> places_;
  int rank_;
};

/// The largest rate, from a short step: the change in a long Runge-Kutta step contains higher powers of the rate.
double rate_by_short_step(const LinearStep& linear, const FrozenPoint& point, const LinearisedStep& rows, double step) {
  const double by_step = change_of(rows) / step, short_step = by_step > 0 ? shortest_try / by_step : step;
  const std::optional<LinearisedStep> short_rows = linear.response(point, std::min(step, short_step));
  return short_rows ? change_of(*short_rows) / std::min(step, short_step) : 0;
}

/// For the step of a problem, which is the session's or the same with another scheme.
Positivity positivity_of(driver::Session& session, const model::Problem& problem, const LinearStep& linear,
                         double step) {
  Positivity found;
  const int rank = static_cast<int>(session.axes().size());
  const StepsByLength by_length(problem, linear);
  std::vector<FrozenPoint> points;
  std::vector<std::optional<WeightsByLength>> weights;  // of the points at which the step is a polynomial of L
  double rate = 0;
  for (const ScenePoint& at : frozen_points(session, linear)) {
    points.push_back(flat(at.point));
    weights.emplace_back();
    const std::optional<LinearisedStep> rows = linear.response(points.back(), step);
    if (!rows) continue;
    if (linear.solves()) {
      rate = std::max(rate, rate_of(linear, points.back(), rank, step));
      continue;
    }
    if (!rows->waves.empty()) {
      found.why = linear.reduces() ? "a mean reaches all cells"
                                   : "a Fourier series reaches all cells, with weights of both signs";
      return found;
    }
    if (std::optional<StepsByLength::Found> of_rates = by_length.at(points.back(), *rows, step)) {
      rate = std::max(rate, of_rates->rate);
      weights.back() = std::move(of_rates->weights);
    } else {
      rate = std::max(rate, rate_by_short_step(linear, points.back(), *rows, step));
    }
  }
  if (linear.solves() && rate == 0) {
    found.why = "a solve is in it";
    return found;
  }
  std::vector<FrozenStages> stages(points.size());
  const auto holds = [&](double dt) {
    return std::ranges::all_of(points, [&](const FrozenPoint& point) {
      const auto number = static_cast<std::size_t>(&point - points.data());
      if (weights[number]) return weights[number]->are_positive(dt);
      const std::optional<LinearisedStep> rows = linear.response(point, dt, stages[number]);
      if (rows && linear.solves()) return is_positive(Amplification(*rows, rank), rank);
      return rows ? is_positive(*rows) : linear.is_semi_lagrangian();  // no rows: the flow carries too far
    });
  };
  found.largest_step = largest_step_where(rate, linear.solves() ? step_factor_with_solves : step_factor, holds);
  // Far above the limit the polynomial of a scheme, as of rk4, may have positive weights again, which mean nothing.
  found.is_kept = step <= found.largest_step * (1 + step_precision) && holds(step);
  return found;
}

/// With limited slopes the weight of the upstream cell grows by at most L/2 times its weight in upwind(1), where L is
/// the steepest slope of the limiter (P. K. Sweby, SIAM J. Numer. Anal. 21 (1984)). An Euler step is positive for
///   1 - dt/dt_1 - L/2*c*dt >= 0
/// that is up to 1/(1/dt_1 + L/2*c), where dt_1 is the largest positive step of upwind(1) and c dt the Courant number.
/// A method with an SSP coefficient C consists of such steps, each of length at most dt/C.
Positivity positivity_with_limiter(driver::Session& session, double step, const StateGroup& group) {
  const model::Problem& problem = session.problem();
  Positivity found;
  found.why = "its limiter is not linear";
  const double ssp = problem.scheme.time->ssp_coefficient;
  const std::optional<LinearStep> euler = linear_step(by_euler(problem), group);
  if (ssp == 0 || problem.scheme.is_split() || !euler) return found;
  double rate = 0;
  for (const ScenePoint& at : frozen_points(session, *euler)) {
    const std::optional<double> courant = courant_number(problem, at.point, 1, group);
    if (!courant) return found;
    rate = std::max(rate, *courant);
  }
  found = positivity_of(session, by_euler(problem), *euler, step);
  if (!found.why.empty() || found.largest_step == 0) return found;
  found.largest_step = ssp / (1 / found.largest_step + 0.5 * problem.scheme.steepest_slope() * rate);
  found.is_kept = step <= found.largest_step * (1 + step_precision);
  return found;
}

}  // namespace

Positivity positivity_of(driver::Session& session, double step, const StateGroup& group) {
  const ConsistentStart start(session);
  if (session.problem().scheme.has_limiter()) return positivity_with_limiter(session, step, group);
  Positivity found;
  const std::optional<LinearStep> linear = linear_step(session, found.why, group);
  if (!linear) return found;
  if (session.problem().scheme.has_clamp() && linear->is_semi_lagrangian()) {
    found.why = "its clamp is not linear";
    return found;
  }
  return positivity_of(session, session.problem(), *linear, step);
}

std::vector<Wave> waves_of(const driver::Session& session, const FrozenPoint& at, double step,
                           const StateGroup& group) {
  constexpr double lengths[] = {4, 8, 16, 32};
  const int rank = static_cast<int>(session.axes().size());
  std::string why;
  const std::optional<LinearStep> linear = linear_step(session, why, group);
  if (!linear) return {};
  const FrozenPoint point = flat(at);
  const std::optional<LinearisedStep> rows = linear->response(point, step);
  const std::optional<Symbol> equations = Equations(session.problem(), group).about(point);
  if (!rows || !equations) return {};
  const Amplification scheme(*rows, rank);
  std::vector<Wave> result;
  for (int axis = 0; axis < rank; ++axis) {
    for (const double cells : lengths) {
      Angles angle{};
      angle[static_cast<std::size_t>(axis)] = 2 * std::numbers::pi / cells;
      const Eigen::VectorXcd factors = scheme.eigenvalues(angle);
      for (const Complex rate : equations->eigenvalues(angle)) {
        const Complex exact = std::exp(step * rate);
        const auto is_nearer = [&](const Complex& a, const Complex& b) {
          return std::abs(a - exact) < std::abs(b - exact);
        };
        const Complex factor = *std::min_element(factors.begin(), factors.end(), is_nearer);
        Wave wave{axis, cells, std::abs(factor), std::exp(step * rate.real())};
        const double turn = step * rate.imag();
        if (std::abs(turn) > 1e-9) wave.phase = (turn + std::arg(factor * std::exp(Complex(0, -turn)))) / turn;
        result.push_back(wave);
      }
    }
  }
  return result;
}

}  // namespace dpde::stability
