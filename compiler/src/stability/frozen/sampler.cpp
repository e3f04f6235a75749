// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dpde/runtime/rollout.h"
#include "stencil/build.h"

namespace dpde::stability {

namespace {

constexpr std::size_t places_between = 6;
constexpr std::size_t most_different = 24;
constexpr double small_slope = 1e-3;  // per cell, relative to the value
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

std::map<std::string, double> numbers_of(const driver::Session& session) {
  std::map<std::string, double> numbers;
  double cells = 1;
  for (const auto& [name, value] : session.workspace().params()) numbers[name] = value;
  for (const model::Axis& axis : session.axes()) {
    numbers["h" + axis.name] = axis.spacing();
    cells *= axis.cells;
  }
  numbers["cells"] = cells;
  return numbers;
}

/// The slope from the differences to both neighbours. smaller(), for fields: extrapolation at a jump would give values
/// that the field has nowhere. mean(), for solutions: a wind is the slope of a stream function.
double smaller(double up, double down) { return up * down <= 0 ? 0 : std::abs(up) < std::abs(down) ? up : down; }
double mean(double up, double down) { return 0.5 * (up + down); }

bool is_the_same(std::span<const double> values) {
  return std::ranges::all_of(values, [&](double value) { return value == values.front(); });
}

}  // namespace

bool depends_on(const LinearStep& linear, const FrozenPoint& point, double step,
                const std::function<void(FrozenPoint&)>& spoil) {
  FrozenPoint spoilt = point;
  spoil(spoilt);
  return !linear.response(spoilt, step).has_value();
}

FrozenValue unknown_field() {
  FrozenValue value(no_number);
  value.slope.fill(no_number);
  return value;
}

std::size_t spread(std::size_t i, std::size_t cells) {
  auto stride = static_cast<std::size_t>(0.6180339887498949 * static_cast<double>(cells));
  while (std::gcd(stride, cells) > 1) ++stride;
  return i * stride % cells;
}

Sampler::Sampler(driver::Session& session, const LinearStep& linear)
    : session_(session), states_(session, linear), follows_flow_(linear.is_semi_lagrangian()) {
  for (const auto& [name, values] : states_.fixed()) {
    for (const model::Coefficient& coefficient : session.problem().coefficients) {
      if (coefficient.name == name && coefficient.is_control()) intervals_[name] = coefficient.every;
    }
  }
  find_dependences(linear);
}

/// Calls `tell` with the name and values of each field and solution, at the start of the run, and in its middle and at
/// its end if they differ then.
template <class Tell>
void Sampler::for_each_field(const Tell& tell) const {
  for (const auto& [name, values] : states_.fixed()) tell(name, values, false);
  const std::vector<SceneStates::Moment>& moments = states_.moments();
  for (std::size_t i = 0; i < moments.size(); i += std::max<std::size_t>(1, (moments.size() - 1) / 2)) {
    for (const auto& [name, values] : moments[i].set) tell(name, values, false);
    for (const auto& [name, values] : moments[i].whole) tell(name, values, true);
  }
}

void Sampler::add_extremes(std::span<const double> values, bool is_whole, std::set<std::size_t>& cells) const {
  const auto [low, high] = std::ranges::minmax_element(values);
  for (const auto& extreme : {low, high}) {
    const auto place = static_cast<std::size_t>(extreme - values.begin());
    cells.insert(is_whole ? states_.grid_of_whole().middle_of(place) : place % session_.workspace().cell_count());
  }
}

/// Several points are tested: outside of a mask the response does not depend on the prescribed value.
void Sampler::find_dependences(const LinearStep& linear) {
  const std::size_t count = session_.workspace().cell_count();
  std::vector<std::size_t> cells{count / 2};
  std::set<std::size_t> extremes;
  for_each_field([&](const std::string&, std::span<const double> values, bool is_whole) {
    add_extremes(values, is_whole, extremes);
  });
  add_along_axes(extremes);
  cells.insert(cells.end(), extremes.begin(), extremes.end());
  for (std::size_t i = 0; i < std::min(count, most_different); ++i) cells.push_back(spread(i, count));
  const double step = session_.problem().step, time = time_within(session_, 0.5);
  for (const std::size_t cell : cells) {
    if (different_.size() == most_different) break;
    ScenePoint here = at(cell, time);
    const auto is_it = [&](const ScenePoint& other) {
      return other.point.fields == here.point.fields && other.point.whole == here.point.whole &&
             other.point.place == here.point.place;
    };
    if (std::ranges::none_of(different_, is_it)) different_.push_back(std::move(here));
  }
  // Points without a known response are left out: there every field would seem to matter.
  std::vector<bool> is_known;
  for (const ScenePoint& here : different_) is_known.push_back(linear.response(here.point, step).has_value());
  const bool is_any_known = std::ranges::find(is_known, true) != is_known.end();
  for (std::size_t i = 0; i < different_.size(); ++i) {
    if (!is_any_known || is_known[i]) add_dependences(linear, different_[i].point, step);
  }
}

void Sampler::add_dependences(const LinearStep& linear, const FrozenPoint& point, double step) {
  if (!reads_places_) reads_places_ = depends_on(linear, point, step, [](FrozenPoint& p) { p.place.fill(no_number); });
  for (const auto& [name, value] : point.fields) {
    const auto spoil = [&name = name](FrozenPoint& p) { p.fields[name] = unknown_field(); };
    if (!varied_.contains(name) && depends_on(linear, point, step, spoil)) varied_.insert(name);
  }
  for (const auto& [name, value] : point.whole) {
    const auto spoil = [&name = name](FrozenPoint& p) { p.whole[name] = unknown_field(); };
    if (!varied_whole_.contains(name) && depends_on(linear, point, step, spoil)) varied_whole_.insert(name);
  }
}

std::set<std::size_t> Sampler::cells() const {
  std::set<std::size_t> result;
  const std::size_t count = session_.workspace().cell_count();
  for_each_field([&](const std::string& name, std::span<const double> values, bool is_whole) {
    if ((is_whole ? varied_whole_ : varied_).contains(name)) add_extremes(values, is_whole, result);
  });
  for (std::size_t i = 0; i < places_between && varies_in_space(); ++i)
    result.insert(i * (count - 1) / (places_between - 1));
  if (reads_places_) add_along_axes(result);
  if (result.empty()) result.insert(count / 2);
  return result;
}

std::vector<ScenePoint> Sampler::extremes_of_controls() const {
  std::vector<ScenePoint> result;
  const std::size_t count = session_.workspace().cell_count();
  for (const auto& [name, every] : intervals_) {
    if (!varied_.contains(name)) continue;
    const std::vector<double>& values = states_.fixed().at(name);
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    for (const auto& extreme : {low, high}) {
      const auto place = static_cast<std::size_t>(extreme - values.begin());
      const double steps = (static_cast<double>(place / count) + 0.5) * every;
      result.push_back(at(place % count, session_.problem().t_begin + steps * session_.problem().step));
    }
  }
  return result;
}

std::set<std::size_t> Sampler::steepest_cells() const {
  std::set<std::size_t> result;
  for_each_field([&](const std::string& name, std::span<const double> values, bool is_whole) {
    if (!is_whole || !varied_whole_.contains(name)) return;
    std::array<double, 3> steepest{};
    std::array<std::size_t, 3> cells{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t cell = states_.grid_of_whole().middle_of(i);
      const FrozenValue here = about_whole(values, cell);
      for (std::size_t a = 0; a < session_.axes().size(); ++a) {
        if (!(std::abs(here.slope[a]) > steepest[a])) continue;
        steepest[a] = std::abs(here.slope[a]);
        cells[a] = cell;
      }
    }
    for (std::size_t a = 0; a < session_.axes().size(); ++a) {
      if (steepest[a] > 0) result.insert(cells[a]);
    }
  });
  return result;
}

bool Sampler::varies_in_space() const {
  bool varies = reads_places_ || !varied_.empty();
  for_each_field([&](const std::string& name, std::span<const double> values, bool is_whole) {
    varies = varies || (is_whole && varied_whole_.contains(name) && !is_the_same(values));
  });
  return varies;
}

bool Sampler::varies_in_time() const {
  const SceneStates::Moment& first = states_.moments().front();
  const auto is_other = [](const Fields& fields, const Fields& before, const std::set<std::string>& names) {
    return std::ranges::any_of(names, [&](const std::string& name) {
      const auto now = fields.find(name), then = before.find(name);
      return (now == fields.end()) != (then == before.end()) || (now != fields.end() && now->second != then->second);
    });
  };
  return std::ranges::any_of(states_.moments(), [&](const SceneStates::Moment& moment) {
    return is_other(moment.set, first.set, varied_) || is_other(moment.whole, first.whole, varied_whole_);
  });
}

bool Sampler::is_alike(const FrozenPoint& a, const FrozenPoint& b) const {
  const auto is_equal_whole = [&](const std::string& name) {
    const auto left = a.whole.find(name), right = b.whole.find(name);
    return left == a.whole.end() ? right == b.whole.end() : right != b.whole.end() && left->second == right->second;
  };
  return std::ranges::all_of(varied_, [&](const auto& name) { return a.fields.at(name) == b.fields.at(name); }) &&
         std::ranges::all_of(varied_whole_, is_equal_whole) && a.params == b.params &&
         (!reads_places_ || a.place == b.place);
}

ScenePoint Sampler::at(std::size_t cell, double t) const {
  ScenePoint result;
  result.point.params = numbers_of(session_);
  const SceneStates::Moment& moment = states_.nearest(t);
  for (const Fields* fields : {&states_.fixed(), &moment.set}) {
    for (const auto& [name, values] : *fields) {
      FrozenValue& value = result.point.fields[name] = about(now(name, values, t), cell);
      if (is_clamped(name)) value.slope.fill(small_slope * std::abs(value.value));
    }
  }
  for (const auto& [name, values] : moment.whole) result.point.whole[name] = about_whole(values, cell);
  result.point.params["t"] = t;
  const Place place = place_of(cell);
  for (std::size_t a = 0; a < session_.axes().size(); ++a) {
    const model::Axis& axis = session_.axes()[a];
    result.point.cells[a] = axis.cells;
    result.point.longest_wave[a] = (axis.topology == Topology::periodic ? 1.0 : 2.0) * axis.cells;
    result.point.place[a] = axis.low + (static_cast<double>(place[a]) + 0.5) * axis.spacing();
  }
  if (varies_in_space() && session_.workspace().cell_count() > 1) {
    const auto number = [](std::size_t i) { return static_cast<std::int64_t>(i); };
    result.place = session_.place_text({number(place[0]), number(place[1]), number(place[2])});
  }
  return result;
}

/// The values at time t: for a control field those of its interval.
std::span<const double> Sampler::now(const std::string& name, std::span<const double> values, double t) const {
  const std::size_t count = session_.workspace().cell_count();
  const auto every = intervals_.find(name);
  if (every == intervals_.end()) return values.first(count);
  const double step = std::floor((t - session_.problem().t_begin) / session_.problem().step + 1e-9);
  const std::size_t interval = control_interval(static_cast<std::int64_t>(step), every->second, values.size() / count);
  return values.subspan(interval * count, count);
}

/// Whether the field's advection is clamped. A clamp cuts both signs of a perturbation of a constant field, and none of
/// a field with a slope.
bool Sampler::is_clamped(const std::string& name) const {
  const model::Advection advect = session_.problem().scheme.transport_of(name).advect;
  return follows_flow_ && session_.problem().find_state(name) != nullptr &&
         (advect == model::Advection::maccormack || advect == model::Advection::maccormack_steady);
}

FrozenValue Sampler::about(std::span<const double> values, std::size_t cell) const {
  const auto n = [&](std::size_t axis) {
    return axis < session_.axes().size() ? static_cast<std::size_t>(session_.axes()[axis].cells) : 1;
  };
  return about_place([&](const Place& place) { return values[place[0] + n(0) * (place[1] + n(1) * place[2])]; }, cell,
                     smaller);
}

FrozenValue Sampler::about_whole(std::span<const double> values, std::size_t cell) const {
  return about_place([&](const Place& place) { return states_.grid_of_whole().at(values, place); }, cell, mean);
}

/// The slope is 0 at the ends of bounded axes and in semi-Lagrangian steps.
template <class Value>
FrozenValue Sampler::about_place(const Value& value, std::size_t cell, double (*slope)(double up, double down)) const {
  const Place place = place_of(cell);
  FrozenValue result(value(place));
  if (follows_flow_) return result;
  for (std::size_t a = 0; a < session_.axes().size(); ++a) {
    const auto n = static_cast<std::size_t>(session_.axes()[a].cells);
    const bool is_periodic = session_.axes()[a].topology == Topology::periodic;
    Place high = place, low = place;
    high[a] = place[a] + 1 < n ? place[a] + 1 : is_periodic ? 0 : place[a];
    low[a] = place[a] > 0 ? place[a] - 1 : is_periodic ? n - 1 : 0;
    const bool is_inside = high[a] != place[a] && low[a] != place[a];
    if (is_inside) result.slope[a] = slope(value(high) - result.value, result.value - value(low));
  }
  return result;
}

Sampler::Place Sampler::place_of(std::size_t cell) const {
  Place place{};
  for (std::size_t a = 0; a < session_.axes().size(); ++a) {
    const auto n = static_cast<std::size_t>(session_.axes()[a].cells);
    place[a] = cell % n;
    cell /= n;
  }
  return place;
}

/// Adds the end cells and the smallest cell of each axis, in the middle of the other axes.
void Sampler::add_along_axes(std::set<std::size_t>& cells) const {
  std::size_t middle = 0, stride = 1;
  for (const model::Axis& axis : session_.axes()) {
    middle += static_cast<std::size_t>(axis.cells / 2) * stride;
    stride *= static_cast<std::size_t>(axis.cells);
  }
  stride = 1;
  for (const model::Axis& axis : session_.axes()) {
    const auto n = static_cast<std::size_t>(axis.cells);
    std::size_t smallest = 0;
    for (std::size_t i = 1; i < n; ++i) {
      if (axis.width(static_cast<std::int64_t>(i)) < axis.width(static_cast<std::int64_t>(smallest))) smallest = i;
    }
    const std::size_t others = middle - n / 2 * stride;
    for (const std::size_t i : {std::size_t{0}, n / 2, n - 1, smallest}) cells.insert(others + i * stride);
    stride *= n;
  }
}

}  // namespace dpde::stability
