// SPDX-License-Identifier: Apache-2.0
// Estimates for steps with networks: the eigenvalues of the step's tangent on a small grid, found by disturbing its
// cells one by one. All fields are frozen at points where those that the step reads are largest and smallest. A network
// may change states even in a step of length 0; that growth is allowed. Growth beyond it and beyond twice that of the
// equations is attributed to the scheme.
#include <algorithm>
#include <cmath>

#include "stability/equations.h"
#include "stability/frozen/sampler.h"
#include "stability/report/verdict_cache.h"
#include "stability/waves/wall_spectrum.h"
#include "stencil/build.h"

namespace dpde::stability {

namespace {

constexpr double network_tolerance = 1e-2;  // ln |g|: the estimate does not resolve less
constexpr double most_work = 3e6;           // products of a network in one matrix
constexpr double network_precision = 1e-2;  // of the limit, relative
constexpr double most_own_steps = 4096;     // in scene steps: no limit is searched for beyond
constexpr std::size_t most_places = 24;     // points and times that are checked once
constexpr std::size_t most_frozen = 6;      // of these, points whose limits are computed
constexpr double shortest_part = 1e-3;      // in scene steps: no limit is searched for below

/// Whether both points are equal for a step with networks, which reads values only; coordinates if `reads_places`.
bool are_alike(const FrozenPoint& a, const FrozenPoint& b, bool reads_places) {
  const auto has_value = [&](const auto& field) { return field.second.value == b.fields.at(field.first).value; };
  return std::ranges::all_of(a.fields, has_value) && a.whole == b.whole && a.params == b.params &&
         (!reads_places || a.place == b.place);
}

class Networks {
 public:
  Networks(driver::Session& session, const LinearStep& linear) : session_(session), linear_(linear) {
    for (const auto& [name, own] : session.workspace().weights()) weights_[std::string(name)].values = own.values;
  }

  std::string why_not() const {
    double products = 0;
    for (const network::Network& network : session_.problem().networks) {
      if (network.is_host()) return "a network of the host's is in it";
      products += network::multiplications_a_cell(network);
    }
    const double cells = cells_with_networks_along(session_.axes());
    const double work = products * cells * cells * static_cast<double>(linear_.states().size());
    return work > most_work ? "a network is in it that is too large for it" : "";
  }

  /// The points where each field that the step reads is smallest and largest, and where states are half between
  /// (networks may be steep there), some more points, and later times if fields change.
  std::vector<FrozenPoint> points() const {
    const Sampler sampler(session_, linear_);
    std::vector<std::size_t> cells = cells_between();
    for (const std::size_t cell : sampler.cells()) cells.push_back(cell);
    const bool reads_places = std::ranges::any_of(linear_.inputs(), stencil::is_coordinate);
    std::vector<FrozenPoint> result;
    for (const std::size_t cell : cells) {
      for (const double part : sampler.varies_in_time() ? std::vector{0.0, 0.5, 1.0} : std::vector{0.0}) {
        FrozenPoint point = sampler.at(cell, time_within(session_, part)).point;
        point.params["cells"] = cells_with_networks_along(session_.axes());
        const auto is_it = [&](const FrozenPoint& other) { return are_alike(other, point, reads_places); };
        if (result.size() < most_places && std::ranges::none_of(result, is_it)) result.push_back(std::move(point));
      }
    }
    return result;
  }

  /// The first points in two orders: by the largest change in a short step, and by its largest damping.
  std::vector<FrozenPoint> heaviest_points() const {
    std::vector<FrozenPoint> all = points();
    const double short_step = shortest_part * session_.problem().step;
    std::vector<std::pair<double, std::size_t>> by_change, by_decay;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Eigen::VectorXcd factors = factors_of(all[i], short_step);
      if (factors.size() == 0) continue;
      by_change.emplace_back(-(factors.array() - 1).abs().maxCoeff(), i);
      by_decay.emplace_back(factors.cwiseAbs().minCoeff(), i);
    }
    std::ranges::sort(by_change);
    std::ranges::sort(by_decay);
    std::vector<std::size_t> chosen;
    for (std::size_t rank = 0; rank < by_change.size() && chosen.size() < most_frozen; ++rank) {
      for (const std::size_t i : {by_change[rank].second, by_decay[rank].second}) {
        if (std::ranges::find(chosen, i) == chosen.end()) chosen.push_back(i);
      }
    }
    std::vector<FrozenPoint> result;
    for (const std::size_t i : chosen) result.push_back(std::move(all[i]));
    return result;
  }

  /// The largest ln |g|; infinite if values are not finite.
  double growth(const FrozenPoint& point, double step) const {
    const Eigen::VectorXcd factors = factors_of(point, step);
    return factors.size() == 0 ? std::numeric_limits<double>::infinity() : std::log(factors.cwiseAbs().maxCoeff());
  }

  /// The growth in a step of length 0, and the growth rate of the equations.
  struct Allowed {
    double of_network = 0, rate = 0;
    double in(double step) const { return of_network + 2 * rate * step; }
  };
  Allowed allowed_at(const FrozenPoint& point) const {
    const double short_step = shortest_part * session_.problem().step;
    Allowed result{std::max(0.0, growth(point, 0))};
    result.rate = std::max(0.0, (growth(point, short_step) - result.of_network) / short_step);
    return result;
  }

 private:
  Eigen::VectorXcd factors_of(const FrozenPoint& point, double step) const {
    return WallSpectrum(linear_, session_.axes(), weights_).eigenvalues(point, step);
  }

  std::vector<std::size_t> cells_between() const {
    std::vector<std::size_t> cells;
    for (int s = 0; s < session_.rollout().state_count(); ++s) {
      const std::vector<double> values = session_.initial(s);
      const auto [low, high] = std::ranges::minmax(values);
      const double middle = 0.5 * (low + high);
      const auto between = std::ranges::min_element(values, {}, [&](double v) { return std::abs(v - middle); });
      cells.push_back(static_cast<std::size_t>(between - values.begin()));
    }
    return cells;
  }

  driver::Session& session_;
  const LinearStep& linear_;
  std::map<std::string, stencil::Weights> weights_;
};

/// The largest step up to which growth is allowed; none if it is not below `most`.
StepLimit limit_at(const Networks& networks, const FrozenPoint& point, const Networks::Allowed& allowed, double own,
                   double most) {
  const auto is_stable = [&](double step) {
    return networks.growth(point, step) - allowed.in(step) <= network_tolerance;
  };
  double low = std::min(own, most), high = low;
  if (is_stable(low)) {
    if (std::isfinite(most) && is_stable(most)) return {};
    while (high < most && is_stable(high)) {
      if (high > most_own_steps * own) return {};
      low = high;
      high = std::min(2 * high, most);
    }
  } else {
    while (low > shortest_part * own && !is_stable(low)) high = low, low /= 2;
    if (!(low > shortest_part * own)) return {StepLimit::Kind::never, 0, 1};
  }
  while (high - low > network_precision * high) (is_stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return {StepLimit::Kind::limit, low};
}

}  // namespace

void examine_networks(driver::Session& session, const StateGroup& group, double most, StabilityReport& verdict) {
  const std::optional<LinearStep> linear = compiled_step(session, verdict.why, group);
  if (!linear || !linear->has_networks()) return;
  const Networks networks(session, *linear);
  verdict.why = networks.why_not();
  if (!verdict.why.empty()) return;
  verdict.is_of_networks = true;
  verdict.step = session.problem().step;
  verdict.field = linear->states().front();
  for (const FrozenPoint& point : networks.heaviest_points()) {
    const Networks::Allowed allowed = networks.allowed_at(point);
    const double now = networks.growth(point, verdict.step), beyond = now - allowed.in(verdict.step);
    if (!std::isfinite(now)) continue;
    verdict.growth_rate = verdict.group_growth_rate = std::max(verdict.growth_rate, allowed.rate);
    verdict.growth = std::max(verdict.growth, std::exp(now));
    verdict.beyond = std::max(verdict.beyond, beyond);
    const StepLimit limit = limit_at(networks, point, allowed, verdict.step, std::min(most, verdict.limit.largest()));
    if (limit.largest() < verdict.limit.largest()) verdict.limit = limit, verdict.worst = point;
  }
  verdict.end_growth = verdict.beyond * session.steps();
}

bool networks_grow_nothing(driver::Session& session, const StateGroup& group) {
  std::string why;
  const std::optional<LinearStep> linear = compiled_step(session, why, group);
  if (!linear || !linear->has_networks()) return false;
  const Networks networks(session, *linear);
  if (!networks.why_not().empty()) return true;  // no verdict is possible
  for (const FrozenPoint& point : networks.points()) {
    const double step = session.problem().step, now = networks.growth(point, step);
    if (now > network_tolerance && now - networks.allowed_at(point).in(step) > network_tolerance) return false;
  }
  return true;
}

}  // namespace dpde::stability
