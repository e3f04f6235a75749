// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen_points.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>

#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr std::size_t places_between = 6;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

bool has_memory(const model::Problem& problem) {
  return std::ranges::any_of(problem.states, [](const model::State& s) { return !s.history_of.empty(); });
}

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

/// Within the run. Schemes with a memory begin otherwise, for as long as t is below half a step: theirs is far from it.
double time_within(const driver::Session& session, double part) {
  const model::Problem& problem = session.problem();
  const double steps = has_memory(problem) ? 1e6 : std::max(1.0, part * session.steps());
  return problem.t_begin + steps * problem.step;
}

/// Whether the response is another one where this is: NaN in it makes NaN of it.
bool depends_on(const LinearStep& linear, const FrozenPoint& point, double step,
                const std::function<void(FrozenPoint&)>& spoil) {
  FrozenPoint spoilt = point;
  spoil(spoilt);
  return !linear.response(spoilt, step).has_value();
}

class Sampler {
 public:
  Sampler(driver::Session& session, const LinearStep& linear) : session_(session) {
    for (const std::string& name : linear.inputs()) {
      if (stencil::is_coordinate(name)) continue;
      const int state = session.engine().state_index(name);
      fields_[name] = state < 0 ? session.workspace().dense(name) : session.initial(state);
    }
    const double step = session.problem().step;
    const FrozenPoint point = at(session.workspace().cell_count() / 2, time_within(session, 0.5)).point;
    reads_places_ = depends_on(linear, point, step, [](FrozenPoint& p) { p.place.fill(not_a_number); });
    for (const auto& [name, values] : fields_) {
      if (depends_on(linear, point, step, [&](FrozenPoint& p) { p.fields[name] = not_a_number; })) varied_.insert(name);
    }
  }

  std::set<std::size_t> cells() const {
    std::set<std::size_t> result;
    for (const std::string& name : varied_) {
      const std::vector<double>& values = fields_.at(name);
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      result.insert(static_cast<std::size_t>(low - values.begin()));
      result.insert(static_cast<std::size_t>(high - values.begin()));
    }
    const std::size_t count = session_.workspace().cell_count();
    for (std::size_t i = 0; i < places_between && (reads_places_ || !varied_.empty()); ++i)
      result.insert(i * (count - 1) / (places_between - 1));
    if (reads_places_) add_along_axes(result);
    if (result.empty()) result.insert(count / 2);
    return result;
  }

  /// For the response.
  bool is_alike(const FrozenPoint& a, const FrozenPoint& b) const {
    return std::ranges::all_of(varied_, [&](const auto& name) { return a.fields.at(name) == b.fields.at(name); }) &&
           a.params == b.params && (!reads_places_ || a.place == b.place);
  }

  ScenePoint at(std::size_t cell, double t) const {
    ScenePoint result{{{}, numbers_of(session_), {}}, ""};
    for (const auto& [name, values] : fields_) result.point.fields[name] = values[cell];
    result.point.params["t"] = t;
    const std::array<std::size_t, 3> place = place_of(cell);
    for (std::size_t a = 0; a < session_.axes().size(); ++a) {
      const model::Axis& axis = session_.axes()[a];
      result.point.place[a] = axis.low + (static_cast<double>(place[a]) + 0.5) * axis.spacing();
    }
    if (!varied_.empty() || reads_places_) {
      const auto number = [](std::size_t i) { return static_cast<std::int64_t>(i); };
      result.place = session_.place_text({number(place[0]), number(place[1]), number(place[2])});
    }
    return result;
  }

 private:
  std::array<std::size_t, 3> place_of(std::size_t cell) const {
    std::array<std::size_t, 3> place{};
    for (std::size_t a = 0; a < session_.axes().size(); ++a) {
      const auto n = static_cast<std::size_t>(session_.axes()[a].cells);
      place[a] = cell % n;
      cell /= n;
    }
    return place;
  }

  /// The ends of each axis, and its smallest cell; in the middle of the others.
  void add_along_axes(std::set<std::size_t>& cells) const {
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

  driver::Session& session_;
  std::map<std::string, std::vector<double>> fields_;
  std::set<std::string> varied_;  // of them those that the response depends on
  bool reads_places_ = false;
};

bool is_equal(const Response& a, const Response& b) {
  return std::ranges::equal(a, b, [](const Form& left, const Form& right) {
    return std::ranges::equal(left.terms(), right.terms(), [](const Form::Term& l, const Form::Term& r) {
      return l.key == r.key && l.coefficient == r.coefficient;
    });
  });
}

bool depends_on_time(const driver::Session& session, const LinearStep& linear, FrozenPoint point) {
  const double step = session.problem().step;
  const std::optional<Response> now = linear.response(point, step);
  point.params["t"] += 0.377 * session.steps() * step;
  const std::optional<Response> later = linear.response(point, step);
  return now && later && !is_equal(*now, *later);
}

}  // namespace

std::vector<ScenePoint> frozen_points(driver::Session& session, const LinearStep& linear) {
  const Sampler sampler(session, linear);
  std::vector<ScenePoint> result;
  const std::set<std::size_t> cells = sampler.cells();
  const bool varies = depends_on_time(session, linear, sampler.at(*cells.begin(), time_within(session, 0.5)).point);
  for (const std::size_t cell : cells) {
    for (const double part : varies ? std::vector{0.0, 0.5, 1.0} : std::vector{0.5}) {
      ScenePoint next = sampler.at(cell, time_within(session, part));
      const auto is_known = [&](const ScenePoint& known) { return sampler.is_alike(known.point, next.point); };
      if (std::ranges::none_of(result, is_known)) result.push_back(std::move(next));
    }
  }
  return result;
}

bool is_same_everywhere(driver::Session& session, const LinearStep& linear, const FrozenPoint& point) {
  if (linear.reduces() || depends_on_time(session, linear, point)) return false;
  FrozenPoint unknown = point;
  unknown.place.fill(not_a_number);
  for (auto& [name, value] : unknown.fields) {
    if (session.engine().state_index(name) < 0) {
      const std::vector<double> values = session.workspace().dense(name);
      if (std::ranges::all_of(values, [&](double v) { return v == values.front(); })) continue;
    }
    value = not_a_number;
  }
  for (const model::Control& control : session.problem().controls) unknown.params[control.name] = not_a_number;
  return linear.response(unknown, session.problem().step).has_value();
}

}  // namespace dpde::stability
