// SPDX-License-Identifier: Apache-2.0
#include "stability/step_limit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/waves/step_of_rates.h"
#include "stability/waves/waves_of_point.h"

namespace dpde::stability {

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double first_try = 0.1, last_try = 1e3, smallest_try = 1e-9;  // in units of 1 / largest rate
constexpr double last_of_scene = 256;  // in scene steps: implicit steps of fast terms may have a distant limit
constexpr double many_growths = 20;    // the longest step, in e-folding times of the physical growth
constexpr double factor_up = 1.25, factor_along_flow = 1.06;  // the damping of interpolation varies with the step
constexpr double windows[] = {0.02, 0.05};                    // cells that the flow passes between two tried steps
constexpr double farthest_windows = 8;                        // cells
constexpr double factor_with_solves = 2;                      // or means: slow to check, and often without a limit
constexpr double first_pole = 0.3, last_pole = 4;             // of s dt: an implicit step has poles, as 1/(1 - s dt)
constexpr double factor_near_poles = 1.05;
constexpr double rounding_of_mean = 1e-6;  // see is_too_long() of waves
constexpr double cut = 1e-9;               // largest |g| of a wave that dealiasing removes
/// For one state, two, and more: rounding splits a multiple eigenvalue, by up to the root of the rounding error.
constexpr double tolerances[] = {1e-12, 1e-9, 3e-7};
/// Largest order of growth by a scheme. A higher order is found only for very long waves, whose damping falls faster.
constexpr double most_order = 5;
constexpr double short_step = 1e-3;      // in units of 1 / largest rate
constexpr std::size_t most_kept = 4096;  // eigenvalues of waves

LinearisedStep sum(const LinearisedStep& a, const LinearisedStep& b, double factor) {
  LinearisedStep result{{}, a.waves};
  const int offset = static_cast<int>(a.waves.size());
  for (std::size_t i = 0; i < a.rows.size(); ++i)
    result.rows.push_back(a.rows[i].plus(b.rows[i].renumbered(offset).times(factor)));
  for (WaveSum wave : b.waves) {
    for (WaveSum::Term& term : wave.terms) term.form = term.form.renumbered(offset);
    result.waves.push_back(std::move(wave));
  }
  return result;
}

/// The largest growth rate of the factors of a short step near 1. Multistep schemes have parasitic factors elsewhere.
double rate_by_step(const Eigen::VectorXcd& factors, double step) {
  double largest = -infinite;
  for (const std::complex<double> g : factors) {
    if (std::abs(g - 1.0) < 0.5) largest = std::max(largest, std::log(std::abs(g)) / step);
  }
  return largest;
}

bool is_identity(const LinearisedStep& response) {
  const std::vector<LinearForm>& rows = response.rows;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double own = 0;
    for (const LinearForm::Term& term : rows[i].terms()) {
      if (term.key == static_cast<std::int64_t>(i)) own = term.coefficient;
      if (term.key != static_cast<std::int64_t>(i) && term.coefficient != 0) return false;
    }
    if (own != 1) return false;
  }
  return true;
}

}  // namespace

std::optional<Amplification> FrozenAnalysis::at(double step) const {
  const std::optional<LinearisedStep> rows = linear_->response(point_, step, stages_);
  return rows ? std::optional(Amplification(*rows, rank_)) : std::nullopt;
}

std::optional<LinearisedStep> FrozenAnalysis::plain_response(double step) const {
  return plain_->response(point_, step, plain_stages_);
}

double growth_tolerance(const LinearStep& linear) {
  return tolerances[std::min<std::size_t>(linear.states().size(), 3) - 1];
}

std::optional<StepGrowth> growth_in_step(const LinearStep& linear, const FrozenPoint& point, int rank, double step) {
  FrozenStages stages;
  const std::optional<LinearisedStep> rows = linear.response(point, step, stages);
  if (!rows) return std::nullopt;
  Amplification g(*rows, rank);
  g.expect_many_waves();
  StepGrowth result;
  const Largest largest = largest_over_waves(linear, point, rank, [&](const Angles& a) {
    const Eigen::VectorXcd values = g.eigenvalues(a);
    result.change = std::max(result.change, (values.array() - 1.0).abs().maxCoeff());
    return values.cwiseAbs().maxCoeff();
  });
  result.growth = std::log(largest.value);  // -infinity if the step depends on no state, as for a pressure
  return result.growth < std::numeric_limits<double>::infinity() ? std::optional(result) : std::nullopt;
}

/// dG/d(dt) by differences of order 6 about dt = 0: rounding and truncation are both near 1e-13 of the largest rate.
bool FrozenAnalysis::differentiate(double step) {
  constexpr double weights[] = {45.0 / 60, -9.0 / 60, 1.0 / 60};
  LinearisedStep sum_of_all{std::vector<LinearForm>(linear_->states().size())};
  for (int i = 0; i < 3; ++i) {
    for (const double sign : {1.0, -1.0}) {
      const std::optional<LinearisedStep> rows = plain_response(sign * (i + 1) * step);
      if (!rows) return false;
      sum_of_all = sum(sum_of_all, *rows, sign * weights[i] / step);
    }
  }
  rates_.emplace(sum_of_all, rank_);
  rate_ = over_waves([&](const Angles& a) { return rates_->spectral_radius(a); }).value;
  return std::isfinite(rate_);
}

/// The scale of rates, from the change between half the step and the step. Not from length 0: there the step may jump,
/// as the taps of interpolations do.
bool FrozenAnalysis::estimate(double step) {
  const double from = 0.5 * step;
  const std::optional<LinearisedStep> rest = plain_response(from), rows = plain_response(step);
  if (!rest || !rows) return false;
  const double part = 1 / (step - from);
  const LinearisedStep none{std::vector<LinearForm>(linear_->states().size())};
  Amplification rates(sum(sum(none, *rows, part), *rest, -part), rank_);
  rates.expect_many_waves();
  rate_ = over_waves([&](const Angles& a) { return rates.spectral_radius(a); }).value;
  return std::isfinite(rate_);
}

/// G is the identity at dt = 0, except for multistep schemes and for steps that damp at any length. For these the
/// scale is that of the change with dt, and eigenvalues of a short step near 1 are those of the equations.
bool FrozenAnalysis::measure_rates(double step) {
  const std::optional<LinearisedStep> at_rest = plain_response(0);
  if (at_rest && is_identity(*at_rest) && !linear_->is_semi_lagrangian()) {
    // With a step that is long for some waves the rates found may be arbitrarily wrong: shorten it until they settle.
    for (double length = short_step * step, next = 0;; length = next) {
      if (!differentiate(length)) return false;
      next = rate_ > 0 ? std::max(short_step / rate_, 0.01 * length) : length;
      if (next > 0.5 * length && (next < 2 * length || rate_ == 0)) return true;
      if (next >= 2 * length) return differentiate(next);
    }
  }
  short_ = short_step * step;
  for (int pass = 0; pass < 8; ++pass) {
    if (!estimate(short_)) return false;
    // The geometric mean of both: if changes go as dt^2, the rate found is proportional to dt.
    const double found = rate_ > 0 ? std::sqrt(short_ * short_step / rate_) : short_;
    const bool is_settled = found > 0.5 * short_ && found < 2 * short_;
    short_ = found;
    if (is_settled || rate_ == 0) break;
  }
  if (const std::optional<LinearisedStep> rows = plain_response(short_))
    short_step_.emplace(*rows, rank_).expect_many_waves();
  return short_step_.has_value();
}

/// Takes L from Euler's method if the step is a function of L: a wave's eigenvalues then serve steps of all lengths.
/// Each step that is tried is checked to be that function. For one or two states closed forms are as fast.
bool FrozenAnalysis::take_rates_of(const Equations& equations) {
  constexpr std::size_t of_closed_forms = 2;
  if (plain_ != linear_ || linear_->is_semi_lagrangian() || linear_->states().size() <= of_closed_forms) return false;
  step_of_rates_ = equations.step_of_rates();
  const std::optional<LinearisedStep> rates = step_of_rates_.is_known() ? equations.rates_at(point_) : std::nullopt;
  const double size = rates ? magnitude_of(*rates) : 0;
  if (size > 0) {
    rates_.emplace(*rates, rank_);
    places_ = equations.places_in(*linear_);
    const double step = 1 / size;
    const std::optional<Amplification> g = at(step);
    if (g && is_made_of_rates(*g, step)) {
      rates_->expect_many_waves();
      rate_ = over_waves([&](const Angles& a) { return own_eigenvalues(a).cwiseAbs().maxCoeff(); }).value;
      if (std::isfinite(rate_)) return true;
    }
  }
  rates_.reset();
  step_of_rates_ = {};
  of_rates_.clear();
  own_eigenvalues_.clear();
  return false;
}

bool FrozenAnalysis::is_made_of_rates(const Amplification& g, double step) const {
  if (!step_of_rates_.is_known() || !step_of_rates_.makes(g, *rates_, places_, step)) return false;
  of_rates_.insert(step);
  return true;
}

/// For steps of all lengths. An explicit step with frozen coefficients is a polynomial of dt of degree at most 7, one
/// for each stage: two such polynomials that agree at eight lengths are equal. Formulas may contain dt, too, but
/// is_rational_in_step excludes dependences that differ between ranges of dt.
bool FrozenAnalysis::is_known_to_be_of_rates() const {
  constexpr std::size_t enough = 8;
  return of_rates_.size() >= enough && linear_->is_rational_in_step(stages_);
}

bool FrozenAnalysis::is_of_rates(double step) const {
  const std::optional<Amplification> g = at(step);
  return g && is_made_of_rates(*g, step);
}

std::optional<FrozenAnalysis::Factors> FrozenAnalysis::factors_of(double step) const {
  const auto by_rates = [this, step](const Angles& a) { return step_of_rates_.factors(step * own_eigenvalues(a)); };
  if (is_known_to_be_of_rates()) return by_rates;
  const std::optional<Amplification> g = at(step);
  if (!g) return std::nullopt;
  if (is_made_of_rates(*g, step)) return by_rates;
  const auto by_step = std::make_shared<Amplification>(*g);
  by_step->expect_many_waves();
  return [by_step](const Angles& a) { return by_step->eigenvalues(a); };
}

/// The physical growth rate: of resolved waves by the differences; of others the smaller of the rates by the
/// differences and by the equations (Symbol). With Fourier series both are equal.
void FrozenAnalysis::measure_growth(const Equations* equations) {
  const auto rate_of = [&](const Angles& a) { return growth_rate_of(a); };
  const double of_mean = growth_rate_of({}), of_all = over_waves(rate_of).value;
  if (of_all > no_growth * rate_)
    growth_ = over_waves([&](const Angles& a) { return is_resolved(a) ? rate_of(a) : -infinite; }).value;
  growth_ = std::max(growth_, of_mean > rounding_of_mean * rate_ ? of_mean : 0.0);
  const double told_apart = (rates_ ? rounding_of_mean : short_step) * rate_;
  if (equations != nullptr && equations->are_spectral()) {
    growth_ = std::max(growth_, of_all);
  } else if (equations != nullptr && !linear_->is_semi_lagrangian() && of_all > growth_ + told_apart) {
    const std::optional<Symbol> symbol = equations->about(point_);
    const auto rate_of_both = [&](const Angles& a) { return std::min(rate_of(a), symbol->growth_rate(a)); };
    if (symbol) growth_ = std::max(growth_, over_waves(rate_of_both).value);
  }
  if (growth_ > 0) growth_ = std::min(growth_, growth_on_ring());
  if (!(growth_ > no_growth * rate_)) growth_ = 0;
  if (growth_ > 0 && short_step_ && !linear_->is_semi_lagrangian() && is_growth_of_steps()) growth_ = 0;
}

/// The largest growth rate on a periodic grid: of its modes next to the fastest growing wave, its longest modes, and
/// its mean. Infinite on other grids, which have all waves.
double FrozenAnalysis::growth_on_ring() const {
  constexpr int longest = 3;
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank_); ++axis) {
    if (!(point_.cells[axis] > 1) || point_.longest_wave[axis] != point_.cells[axis]) return infinite;
  }
  const Angles most = over_waves([&](const Angles& a) { return growth_rate_of(a); }).angles;
  double growth = std::max(0.0, growth_rate_of({}));
  const auto look = [&](const std::array<int, 3>& waves) {
    Angles angles{};
    for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank_); ++axis)
      angles[axis] = std::remainder(2 * std::numbers::pi * waves[axis] / point_.cells[axis], 2 * std::numbers::pi);
    growth = std::max(growth, growth_rate_of(angles));
  };
  std::array<int, 3> nearest{};
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(rank_); ++axis)
    nearest[axis] = static_cast<int>(std::lround(most[axis] * point_.cells[axis] / (2 * std::numbers::pi)));
  const int along_z = rank_ > 2 ? 1 : 0, along_y = rank_ > 1 ? 1 : 0;
  for (int z = -along_z; z <= along_z; ++z) {
    for (int y = -along_y; y <= along_y; ++y) {
      for (int x = -1; x <= 1; ++x) look({nearest[0] + x, nearest[1] + y, nearest[2] + z});
    }
  }
  for (int z = 0; z <= longest * along_z; ++z) {
    for (int y = 0; y <= longest * along_y; ++y) {
      for (int x = 0; x <= longest; ++x) look({x, y, z});
    }
  }
  return growth;
}

/// Whether the growth is the scheme's, for steps without a derivative at dt = 0. In half the step the growth of a
/// multistep scheme has a fraction of the rate, and that of a held value twice the rate.
bool FrozenAnalysis::is_growth_of_steps() const {
  const std::optional<LinearisedStep> rows = plain_response(0.5 * short_);
  if (!rows) return false;
  Amplification half(*rows, rank_);
  half.expect_many_waves();
  const auto rate_of = [&](const Angles& a) { return rate_by_step(half.eigenvalues(a), 0.5 * short_); };
  const double by_halves = std::max(over_waves(rate_of).value, rate_of({}));
  return by_halves < 0.6 * growth_ || by_halves > 1.6 * growth_;
}

/// In semi-Lagrangian steps interpolation damps at any step length, so the growth rate of single waves is not known.
double FrozenAnalysis::allowed_rate(const Angles& wave) const {
  if (growth_ == 0) return 0;
  return linear_->is_semi_lagrangian() ? 2 * growth_ : allowed().rate_of(wave, growth_rate_of(wave));
}

/// Slower decay may become growth by the errors of a step.
double FrozenAnalysis::rate_of_decay() const {
  return std::max(allowed().slowest_decay(), (rates_ ? no_growth : short_step) * rate_);
}

double FrozenAnalysis::allowed_to_events(const Angles& wave) const {
  return events_ ? std::max(0.0, std::log(events_->spectral_radius(wave))) : 0;
}

/// ln of the largest factor after as many as the wave has rates that do not decay; -infinity if there is none.
/// Otherwise physical growth would hide that a decaying solution grows in long steps.
double FrozenAnalysis::growth_of_decaying(const Eigen::VectorXcd& factors, const Angles& wave) const {
  if (growth_ == 0 || events_) return -infinite;
  std::size_t others = 0;
  const double decay = rate_of_decay();
  if (rates_) {
    for (const std::complex<double> rate : own_eigenvalues(wave)) others += rate.real() > -decay ? 1 : 0;
  } else {
    for (const std::complex<double> factor : own_eigenvalues(wave)) {
      const bool is_of_equations = std::abs(factor - 1.0) < 0.5, is_cut = std::abs(factor) < cut;
      if (!is_of_equations && !is_cut) return -infinite;  // parasitic, of a multistep scheme
      others += is_of_equations && std::log(std::abs(factor)) / short_ > -decay ? 1 : 0;
    }
  }
  return growth_behind(others, factors);
}

double FrozenAnalysis::growth_by_events() const {
  const auto growth_of = [&](const Angles& a) { return allowed_to_events(a); };
  return events_ ? std::max(over_waves(growth_of).value, growth_of({})) : 0;
}

Largest FrozenAnalysis::over_waves(const std::function<double(const Angles&)>& f) const {
  return largest_over_waves(*linear_, point_, rank_, f);
}

/// Cached, as steps of all lengths check the same waves.
const Eigen::VectorXcd& FrozenAnalysis::own_eigenvalues(const Angles& given) const {
  const Amplification& step = rates_ ? *rates_ : *short_step_;
  const Angles wave = step.representative(given);
  const auto known = own_eigenvalues_.find(wave);
  if (known != own_eigenvalues_.end()) return known->second;
  if (own_eigenvalues_.size() >= most_kept) own_eigenvalues_.clear();
  return own_eigenvalues_[wave] = step.eigenvalues(wave);
}

double FrozenAnalysis::growth_rate_of(const Angles& wave) const {
  if (!rates_) return rate_by_step(own_eigenvalues(wave), short_);
  double largest = -infinite;
  for (const std::complex<double> rate : own_eigenvalues(wave)) largest = std::max(largest, rate.real());
  return largest;
}

std::optional<FrozenAnalysis> FrozenAnalysis::make(const LinearStep& linear, const FrozenPoint& point, int rank,
                                                   double step, const Equations* equations) {
  FrozenAnalysis result(linear, equations == nullptr ? nullptr : equations->without_events(), point, rank);
  result.longest_ = std::max(last_of_scene * step, equations == nullptr ? 0 : equations->length_of_run());
  result.are_all_resolved_ = equations != nullptr && equations->are_spectral();
  const bool are_taken = equations != nullptr && result.take_rates_of(*equations);
  if (!are_taken && !result.measure_rates(step)) return std::nullopt;
  if (result.plain_ != result.linear_) result.events_ = result.at(0);
  result.measure_growth(equations);
  const bool is_exponential = equations != nullptr && equations->are_stepped_exponentially();
  if (result.growth_ > 0 && is_exponential) result.longest_ = std::max(result.longest_, many_growths / result.growth_);
  return result;
}

Largest FrozenAnalysis::excess(double step) const {
  const auto known = excess_.find(step);
  return known != excess_.end() ? known->second : excess_[step] = find_excess(step);
}

Largest FrozenAnalysis::find_excess(double step) const {
  const std::optional<Factors> factors_at = factors_of(step);
  if (!factors_at) return {{}, linear_->is_semi_lagrangian() ? 0 : infinite};  // the flow carries too far
  return over_waves([&](const Angles& a) {
    const Eigen::VectorXcd factors = (*factors_at)(a);
    const double growth = std::log(factors.cwiseAbs().maxCoeff());
    const double beyond = growth - allowed_rate(a) * step - allowed_to_events(a);
    return std::isnan(growth) ? infinite : std::max(beyond, growth_of_decaying(factors, a));
  });
}

bool FrozenAnalysis::is_stable(double step) const { return !(excess(step).value > growth_tolerance(*linear_)); }

Eigen::VectorXcd FrozenAnalysis::factors(const Angles& wave, double step) const {
  const std::optional<Factors> factors_at = factors_of(step);
  return factors_at ? (*factors_at)(wave) : Eigen::VectorXcd();
}

double FrozenAnalysis::growth_of(const Angles& wave, double step) const {
  const Eigen::VectorXcd of_wave = factors(wave, step);
  return of_wave.size() > 0 ? of_wave.cwiseAbs().maxCoeff() : infinite;
}

std::size_t FrozenAnalysis::largest_share(const Angles& wave, double step) const {
  const std::optional<Amplification> g = at(step);
  if (!g || g->size() == 1) return 0;
  return static_cast<std::size_t>(largest_component(g->at(wave)));
}

StepLimit FrozenAnalysis::bisect(double stable, double unstable, double precision) const {
  Largest grows = excess(unstable);
  while (unstable - stable > precision * unstable) {
    const double middle = 0.5 * (stable + unstable);
    const Largest now = excess(middle);
    const bool is_unstable = now.value > growth_tolerance(*linear_);
    (is_unstable ? unstable : stable) = middle;
    if (is_unstable) grows = now;
  }
  // Beyond a limit growth is soon large. If it is still small, it rises from 0 as a power of the step.
  const double beyond = excess(1.1 * stable).value / growth_tolerance(*linear_),
               order = std::log(beyond) / std::log(1.1);
  if (order > 1 && order < most_order)
    return {StepLimit::Kind::never, 0, order, grows.angles, largest_share(grows.angles, unstable)};
  return {StepLimit::Kind::limit, stable, 0, grows.angles, largest_share(grows.angles, unstable)};
}

/// Below a step that is unstable: either there is a limit, or growth goes on as a power of the step.
StepLimit FrozenAnalysis::descend(double unstable, double precision) const {
  std::vector<double> steps, growths;
  for (double step = unstable; step > smallest_try / rate_; step /= 2) {
    const Largest now = excess(step);
    const std::size_t n = growths.size();
    if (n >= 3 && now.value < 30 * growth_tolerance(*linear_)) {
      const double order = std::log2(growths[n - 2] / growths[n - 1]);
      if (std::abs(order - std::log2(growths[n - 3] / growths[n - 2])) < 0.25)
        return {StepLimit::Kind::never, 0, order, now.angles, largest_share(now.angles, step)};
    }
    if (!(now.value > growth_tolerance(*linear_))) {
      const double order = n >= 2 ? std::log2(growths[n - 2] / growths[n - 1]) : 0;
      // Growth that still falls as a power has only become smaller than rounding.
      if (order > 1 && order < most_order && std::abs(now.value * std::exp2(order) / growths[n - 1] - 1) < 0.25)
        return {StepLimit::Kind::never, 0, order, now.angles, largest_share(now.angles, step)};
      return bisect(step, steps.empty() ? 2 * step : steps.back(), precision);
    }
    steps.push_back(step);
    growths.push_back(now.value);
  }
  const std::size_t n = growths.size();
  const Largest last = excess(steps.back());
  return {StepLimit::Kind::never, 0, std::log2(growths[n - 2] / growths[n - 1]), last.angles,
          largest_share(last.angles, steps.back())};
}

/// The next longer step to try. Interpolation damps least where departure points are cell centres, and it changes the
/// phase of waves. So other terms may be unstable in narrow intervals of steps, one for each cell that is passed.
double FrozenAnalysis::next_step(double step) const {
  const bool is_near_pole = growth_ * step > first_pole && growth_ * step < last_pole;
  const double with_solves = is_near_pole ? factor_near_poles : factor_with_solves;
  if (!linear_->is_semi_lagrangian()) return step * (linear_->solves() || linear_->reduces() ? with_solves : factor_up);
  const std::optional<LinearisedStep> rows = linear_->response(point_, step, stages_);
  const double cells = rows ? rows->displacement : 0;
  const bool is_fine = cells > 0 && cells < farthest_windows && rank_ < 3;
  return step * (is_fine ? std::min(factor_along_flow, 1 + windows[rank_ - 1] / cells) : factor_along_flow);
}

/// The limit of a linear step that does not depend on dt, as with held values alone.
StepLimit FrozenAnalysis::limit_of_any_step() const {
  const Largest now = excess(longest_);
  if (!(now.value > growth_tolerance(*linear_))) return {};
  return {StepLimit::Kind::never, 0, 0, now.angles, largest_share(now.angles, longest_)};
}

StepLimit FrozenAnalysis::limit(double most, double precision) const {
  if (rate_ == 0) return limit_of_any_step();
  double step = first_try / rate_;
  if (!is_stable(step)) return descend(step, precision);
  const double end = std::min(std::max(last_try / rate_, longest_), most);
  for (double next = step; step < end; step = next) {
    next = next_step(step);
    if (!is_stable(next)) return bisect(step, next, precision);
  }
  return {};
}

}  // namespace dpde::stability
