// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <span>

#include "dpde/runtime/rollout.h"
#include "stability/equations.h"
#include "stability/whole_fields.h"
#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr std::size_t places_between = 6;
constexpr std::size_t most_looks = 1024, most_cells_a_time = 64;     // at responses
constexpr std::size_t fewest_looks = 64, work_of_looks = 1'000'000;  // parts of expressions, some 50 ns each
constexpr std::size_t heaviest = 4, most_points = 10;                // that are analysed
constexpr std::size_t most_points_with_solves = 4;                   // whose waves take ten times as long
constexpr std::size_t fewest_points_with_means = 6;                  // of many stages, each of which has some
constexpr std::size_t work_of_points = 40'000;                       // products at each wave
constexpr double small_slope = 1e-3;                                 // of the value, a cell
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

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

/// Behind the first step.
double time_within(const driver::Session& session, double part) {
  const model::Problem& problem = session.problem();
  return problem.t_begin + std::max(1.0, part * session.steps()) * problem.step;
}

FrozenValue unknown() {
  FrozenValue value(not_a_number);
  value.slope.fill(not_a_number);
  return value;
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
  Sampler(driver::Session& session, const LinearStep& linear)
      : session_(session), follows_flow_(linear.follows_flow()) {
    if (linear.solves() || linear.reduces()) whole_ = whole_fields(session);
    for (const std::string& name : linear.inputs()) {
      if (stencil::is_coordinate(name)) continue;
      const int state = session.engine().state_index(name);
      fields_[name] = state < 0 ? session.workspace().dense(name) : session.initial(state);
      for (const model::Coefficient& coefficient : session.problem().coefficients) {
        if (coefficient.name == name && coefficient.is_control()) intervals_[name] = coefficient.every;
      }
    }
    const double step = session.problem().step;
    const FrozenPoint point = at(session.workspace().cell_count() / 2, time_within(session, 0.5)).point;
    reads_places_ = depends_on(linear, point, step, [](FrozenPoint& p) { p.place.fill(not_a_number); });
    varied_ = fields_of_response(linear, point, step);
    std::erase_if(whole_, [&](const auto& entry) {
      return !depends_on(linear, point, step, [&](FrozenPoint& p) { p.whole[entry.first] = unknown(); });
    });
  }

  std::set<std::size_t> cells() const {
    std::set<std::size_t> result;
    const std::size_t count = session_.workspace().cell_count();
    for (const std::string& name : varied_) {
      const std::vector<double>& values = fields_.at(name);
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      for (const auto& extreme : {low, high}) result.insert(static_cast<std::size_t>(extreme - values.begin()) % count);
    }
    for (std::size_t i = 0; i < places_between && varies_in_space(); ++i)
      result.insert(i * (count - 1) / (places_between - 1));
    if (reads_places_) add_along_axes(result);
    if (result.empty()) result.insert(count / 2);
    return result;
  }

  /// Where and when control fields that the response depends on are smallest and largest.
  std::vector<ScenePoint> extremes_of_controls() const {
    std::vector<ScenePoint> result;
    const std::size_t count = session_.workspace().cell_count();
    for (const auto& [name, every] : intervals_) {
      if (!varied_.contains(name)) continue;
      const std::vector<double>& values = fields_.at(name);
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      for (const auto& extreme : {low, high}) {
        const auto place = static_cast<std::size_t>(extreme - values.begin());
        const double steps = (static_cast<double>(place / count) + 0.5) * every;
        result.push_back(at(place % count, session_.problem().t_begin + steps * session_.problem().step));
      }
    }
    return result;
  }

  /// Along each axis, of each field that is solved for.
  std::set<std::size_t> steepest_cells() const {
    std::set<std::size_t> result;
    for (const auto& [name, values] : whole_) {
      std::array<double, 3> steepest{};
      std::array<std::size_t, 3> cells{};
      for (std::size_t cell = 0; cell < values.size(); ++cell) {
        const FrozenValue here = about(values, cell, mean);
        for (std::size_t a = 0; a < session_.axes().size(); ++a) {
          if (!(std::abs(here.slope[a]) > steepest[a])) continue;
          steepest[a] = std::abs(here.slope[a]);
          cells[a] = cell;
        }
      }
      for (std::size_t a = 0; a < session_.axes().size(); ++a) {
        if (steepest[a] > 0) result.insert(cells[a]);
      }
    }
    return result;
  }

  bool varies_in_space() const {
    return reads_places_ || !varied_.empty() || !std::ranges::all_of(whole_, [](const auto& entry) {
             return std::ranges::all_of(entry.second, [&](double value) { return value == entry.second.front(); });
           });
  }

  /// For the response.
  bool is_alike(const FrozenPoint& a, const FrozenPoint& b) const {
    return std::ranges::all_of(varied_, [&](const auto& name) { return a.fields.at(name) == b.fields.at(name); }) &&
           a.whole == b.whole && a.params == b.params && (!reads_places_ || a.place == b.place);
  }

  ScenePoint at(std::size_t cell, double t) const {
    ScenePoint result;
    result.point.params = numbers_of(session_);
    for (const auto& [name, values] : fields_) {
      FrozenValue& value = result.point.fields[name] = about(now(name, values, t), cell, smaller);
      if (is_clamped(name)) value.slope.fill(small_slope * std::abs(value.value));
    }
    for (const auto& [name, values] : whole_) result.point.whole[name] = about(values, cell, mean);
    result.point.params["t"] = t;
    const std::array<std::size_t, 3> place = place_of(cell);
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

 private:
  /// Of a control field the interval of this time.
  std::span<const double> now(const std::string& name, std::span<const double> values, double t) const {
    const std::size_t count = session_.workspace().cell_count();
    const auto every = intervals_.find(name);
    if (every == intervals_.end()) return values.first(count);
    const double step = std::floor((t - session_.problem().t_begin) / session_.problem().step + 1e-9);
    const std::size_t interval =
        control_interval(static_cast<std::int64_t>(step), every->second, values.size() / count);
    return values.subspan(interval * count, count);
  }

  /// Of a constant a clamp cuts off both sides; of any slope nothing.
  bool is_clamped(const std::string& name) const {
    const model::Advection advect = session_.problem().scheme.transport_of(name).advect;
    return follows_flow_ && session_.problem().find_state(name) != nullptr &&
           (advect == model::Advection::maccormack || advect == model::Advection::maccormack_steady);
  }
  /// The slope that differences with both neighbours leave. The smaller one: straight on from a jump a field would be
  /// what it nowhere is. Their mean: a wind is the slope of a stream function.
  static double smaller(double up, double down) {
    return up * down <= 0 ? 0 : std::abs(up) < std::abs(down) ? up : down;
  }
  static double mean(double up, double down) { return 0.5 * (up + down); }

  /// No slope at the ends of bounded axes, and where the flow is followed.
  FrozenValue about(std::span<const double> values, std::size_t cell,
                    const std::function<double(double, double)>& slope) const {
    FrozenValue result(values[cell]);
    if (follows_flow_) return result;
    const std::array<std::size_t, 3> place = place_of(cell);
    std::size_t stride = 1;
    for (std::size_t a = 0; a < session_.axes().size(); ++a) {
      const auto n = static_cast<std::size_t>(session_.axes()[a].cells);
      const bool is_periodic = session_.axes()[a].topology == Topology::periodic;
      const std::size_t first = cell - place[a] * stride;
      const std::size_t high = place[a] + 1 < n ? place[a] + 1 : is_periodic ? 0 : place[a];
      const std::size_t low = place[a] > 0 ? place[a] - 1 : is_periodic ? n - 1 : 0;
      const double up = values[first + high * stride] - values[cell],
                   down = values[cell] - values[first + low * stride];
      const bool is_inside = high != place[a] && low != place[a];
      if (is_inside) result.slope[a] = slope(up, down);
      stride *= n;
    }
    return result;
  }

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
  std::map<std::string, std::vector<double>> fields_;  // of a control field one interval after the other
  std::map<std::string, int> intervals_;               // of these, in steps
  std::set<std::string> varied_;                       // of them those that the response depends on
  std::map<std::string, std::vector<double>> whole_;   // of these, those
  bool reads_places_ = false;
  bool follows_flow_;
};

bool is_equal(const Response& a, const Response& b) {
  const auto is_same = [](const Form& left, const Form& right) {
    return std::ranges::equal(left.terms(), right.terms(), [](const Form::Term& l, const Form::Term& r) {
      return l.key == r.key && l.coefficient == r.coefficient;
    });
  };
  constexpr std::array<double, 3> one_wave{1, 0.7, 0.4};  // any that none of the multipliers is special for
  const auto is_same_wave = [&](const WaveSum::Term& left, const WaveSum::Term& right) {
    return is_same(left.form, right.form) && left.by.at(one_wave) == right.by.at(one_wave);
  };
  return std::ranges::equal(a.rows, b.rows, is_same) &&
         std::ranges::equal(a.waves, b.waves, [&](const WaveSum& left, const WaveSum& right) {
           return std::ranges::equal(left.terms, right.terms, is_same_wave) && is_same(left.divisor, right.divisor);
         });
}

/// Pulses are met by no moments; what asks for dt and t at once is taken as it is late in a run where t is not known.
bool depends_on_time(const driver::Session& session, const LinearStep& linear, FrozenPoint point) {
  const double step = session.problem().step;
  const bool is_known = linear.response(point, step).has_value();
  if (is_known && depends_on(linear, point, step, [](FrozenPoint& p) { p.params["t"] = not_a_number; })) return true;
  std::optional<Response> before;
  for (const double part : {0.0, 0.113, 0.237, 0.391, 0.529, 0.683, 0.871, 1.0}) {
    point.params["t"] = time_within(session, part);
    const std::optional<Response> now = linear.response(point, session.problem().step);
    if (before && now && !is_equal(*before, *now)) return true;
    if (now) before = now;
  }
  return false;
}

/// The sum of the magnitudes of what a step changes: it grows with the largest rate.
double weight_of(const std::optional<Response>& response) {
  double sum = 0;
  for (std::size_t row = 0; response && row < response->rows.size(); ++row) {
    for (const Form::Term& term : response->rows[row].terms())
      sum += std::abs(term.coefficient - (term.key == static_cast<std::int64_t>(row) ? 1 : 0));
  }
  if (!response) return sum;
  for (const WaveSum& wave : response->waves) {
    for (const Form::Term& term : wave.divisor.terms()) sum += std::abs(term.coefficient);
    for (const WaveSum::Term& part : wave.terms) {
      for (const Form::Term& term : part.form.terms()) sum += std::abs(term.coefficient);
    }
  }
  return sum;
}

/// What a look at one wave takes, in products.
std::size_t work_of(const Response& response) {
  std::size_t terms = 0;
  for (const Form& row : response.rows) terms += row.terms().size();
  for (const WaveSum& wave : response.waves) {
    for (const WaveSum::Term& term : wave.terms) terms += term.form.terms().size();
  }
  return terms * response.rows.size();
}

/// Those that may be looked at: where the flow is followed, something is solved for, or many stages have means in them,
/// each analysis takes long.
std::size_t most_points_of(const LinearStep& linear, const ScenePoint& point, double step) {
  if (linear.solves()) return most_points_with_solves;
  if (linear.follows_flow()) return most_points;
  const std::optional<Response> response = linear.response(point.point, step);
  if (!response || response->waves.empty()) return std::numeric_limits<std::size_t>::max();
  return std::max(fewest_points_with_means, work_of_points / work_of(*response));
}

/// So many of them, from light to heavy.
std::vector<ScenePoint> thinned(std::vector<ScenePoint> points, const driver::Session& session,
                                const LinearStep& linear) {
  const std::size_t most = most_points_of(linear, points.front(), session.problem().step);
  if (points.size() <= most) return points;
  const auto weight = [&](const ScenePoint& p) { return weight_of(linear.response(p.point, session.problem().step)); };
  std::ranges::stable_sort(points, std::greater(), weight);
  std::vector<ScenePoint> result;
  for (std::size_t i = 0; i < most; ++i) result.push_back(points[i * (points.size() - 1) / (most - 1)]);
  return result;
}

std::size_t size_of(const stencil::Expr& e) {
  std::size_t size = 1;
  stencil::for_each_child(e, [&](const stencil::Expr& child) { size += size_of(child); });
  return size;
}

/// What a look at a response takes, in parts of expressions.
std::size_t work_of(const LinearStep& linear) {
  std::size_t work = 1;
  for (const stencil::Kernel& kernel : linear.module().kernels) {
    for (const stencil::Let& let : kernel.lets) work += size_of(let.value);
    for (const stencil::Store& store : kernel.stores) work += size_of(store.value);
  }
  return work;
}

/// The i-th of cells that are spread evenly, also over each axis: steps of the golden ratio, which meet each cell once.
std::size_t spread(std::size_t i, std::size_t cells) {
  auto stride = static_cast<std::size_t>(0.6180339887498949 * static_cast<double>(cells));
  while (std::gcd(stride, cells) > 1) ++stride;
  return i * stride % cells;
}

/// Of many cells and times those with the heaviest response: formulas may be large in a spot, or for a moment.
std::vector<ScenePoint> heaviest_points(const driver::Session& session, const LinearStep& linear,
                                        const Sampler& sampler, bool varies_in_time) {
  const std::size_t cells = sampler.varies_in_space() ? session.workspace().cell_count() : 1;
  const std::size_t all = std::clamp(work_of_looks / work_of(linear), fewest_looks, most_looks);
  const std::size_t looks = std::min(cells, varies_in_time ? most_cells_a_time : all);
  const std::size_t times = !varies_in_time ? 1 : cells == 1 ? all : std::max<std::size_t>(2, all / most_cells_a_time);
  std::vector<std::pair<double, ScenePoint>> found;
  for (std::size_t i = 0; i < looks; ++i) {
    for (std::size_t k = 0; k < times; ++k) {
      const double part = times == 1 ? 0.5 : static_cast<double>(k) / static_cast<double>(times - 1);
      ScenePoint point =
          sampler.at(cells == 1 ? session.workspace().cell_count() / 2 : spread(i, cells), time_within(session, part));
      const double weight = weight_of(linear.response(point.point, session.problem().step));
      found.emplace_back(weight, std::move(point));
      std::ranges::sort(found, std::greater(), &std::pair<double, ScenePoint>::first);
      if (found.size() > heaviest) found.pop_back();
    }
  }
  std::vector<ScenePoint> result;
  for (auto& [weight, point] : found) result.push_back(std::move(point));
  return result;
}

}  // namespace

std::set<std::string> fields_of_response(const LinearStep& linear, const FrozenPoint& point, double step) {
  std::set<std::string> result;
  for (const auto& [name, value] : point.fields) {
    if (depends_on(linear, point, step, [&](FrozenPoint& p) { p.fields[name] = unknown(); })) result.insert(name);
  }
  return result;
}

std::vector<ScenePoint> frozen_points(driver::Session& session, const LinearStep& linear) {
  std::vector<ScenePoint> points = all_frozen_points(session, linear);
  const bool may_take_long = linear.follows_flow() || linear.solves() || linear.reduces();
  return may_take_long ? thinned(std::move(points), session, linear) : points;
}

std::vector<ScenePoint> all_frozen_points(driver::Session& session, const LinearStep& linear) {
  const Sampler sampler(session, linear);
  std::vector<ScenePoint> result;
  const std::set<std::size_t> cells = sampler.cells();
  const FrozenPoint middle = sampler.at(*cells.begin(), time_within(session, 0.5)).point;
  const bool varies = depends_on_time(session, linear, middle);
  const auto add = [&](ScenePoint next) {
    const auto is_known = [&](const ScenePoint& known) { return sampler.is_alike(known.point, next.point); };
    if (std::ranges::none_of(result, is_known)) result.push_back(std::move(next));
  };
  for (const std::size_t cell : cells) {
    for (const double part : varies ? std::vector{0.0, 0.5, 1.0} : std::vector{0.5}) {
      add(sampler.at(cell, time_within(session, part)));
    }
  }
  if (varies || sampler.varies_in_space()) {
    for (ScenePoint& point : heaviest_points(session, linear, sampler, varies)) add(std::move(point));
  }
  for (ScenePoint& point : sampler.extremes_of_controls()) add(std::move(point));
  for (const auto& [name, control] : session.workspace().controls()) {
    const auto [low, high] = std::ranges::minmax(control.values);
    for (std::size_t i = 0, known = result.size(); i < known; ++i) {
      ScenePoint point = result[i];
      for (const double value : {low, high}) {
        point.point.params[name] = value;
        add(point);
      }
    }
  }
  return result;
}

std::vector<ScenePoint> steepest_points(driver::Session& session, const LinearStep& linear) {
  const Sampler sampler(session, linear);
  std::vector<ScenePoint> result;
  for (const std::size_t cell : sampler.steepest_cells()) result.push_back(sampler.at(cell, time_within(session, 0.5)));
  return result;
}

bool is_same_everywhere(driver::Session& session, const LinearStep& linear, const FrozenPoint& point) {
  if (linear.reduces() || depends_on_time(session, linear, point)) return false;
  FrozenPoint spoilt = point;
  spoilt.place.fill(not_a_number);
  for (auto& [name, value] : spoilt.fields) {
    if (session.engine().state_index(name) < 0) {
      const std::vector<double> values = session.workspace().dense(name);
      if (std::ranges::all_of(values, [&](double v) { return v == values.front(); })) continue;
    }
    value = unknown();
  }
  for (auto& [name, value] : spoilt.whole) value = unknown();
  for (const model::Control& control : session.problem().controls) spoilt.params[control.name] = not_a_number;
  return linear.response(spoilt, session.problem().step).has_value();
}

bool varies_in_time(driver::Session& session) {
  std::string why;
  const std::optional<LinearStep> linear = linear_step(session, why);
  if (!linear) return false;
  const Sampler sampler(session, *linear);
  return depends_on_time(session, *linear, sampler.at(*sampler.cells().begin(), time_within(session, 0.5)).point);
}

}  // namespace dpde::stability
