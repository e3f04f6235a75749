// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/frozen_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <utility>

#include "stability/equations.h"
#include "stability/frozen/sampler.h"
#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr std::size_t most_looks = 1024, most_cells_a_time = 64;     // evaluated responses
constexpr std::size_t fewest_looks = 64, work_of_looks = 1'000'000;  // parts of expressions, some 50 ns each
constexpr std::size_t heaviest = 4, most_points = 10;                // analysed points
constexpr std::size_t heaviest_of_ranked = 64;                       // most of these are checked once
constexpr std::size_t work_of_others = 6000;                         // products at each wave in these checks
constexpr double alike = 1e-9;                                       // relative difference of weights by rounding
constexpr std::size_t most_points_with_solves = 4;                   // whose waves take ten times as long
constexpr std::size_t fewest_points_with_means = 6;                  // of many stages, each of which has some
constexpr std::size_t work_of_points = 40'000;                       // products at each wave
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

bool is_equal(const LinearisedStep& a, const LinearisedStep& b) {
  const auto is_same = [](const LinearForm& left, const LinearForm& right) {
    return std::ranges::equal(left.terms(), right.terms(), [](const LinearForm::Term& l, const LinearForm::Term& r) {
      return l.key == r.key && l.coefficient == r.coefficient;
    });
  };
  constexpr std::array<double, 3> one_wave{1, 0.7, 0.4};  // a generic wave
  const auto is_same_wave = [&](const WaveSum::Term& left, const WaveSum::Term& right) {
    return is_same(left.form, right.form) && left.by.at(one_wave) == right.by.at(one_wave);
  };
  return std::ranges::equal(a.rows, b.rows, is_same) &&
         std::ranges::equal(a.waves, b.waves, [&](const WaveSum& left, const WaveSum& right) {
           return std::ranges::equal(left.terms, right.terms, is_same_wave) && is_same(left.divisor, right.divisor);
         });
}

/// Whether the response depends on t itself. Tested with t unknown, as sampled times can miss a short pulse.
bool depends_on_time(const driver::Session& session, const LinearStep& linear, FrozenPoint point) {
  const double step = session.problem().step;
  const bool is_known = linear.response(point, step).has_value();
  if (is_known && depends_on(linear, point, step, [](FrozenPoint& p) { p.params["t"] = not_a_number; })) return true;
  std::optional<LinearisedStep> before;
  for (const double part : {0.0, 0.113, 0.237, 0.391, 0.529, 0.683, 0.871, 1.0}) {
    point.params["t"] = time_within(session, part);
    const std::optional<LinearisedStep> now = linear.response(point, session.problem().step);
    if (before && now && !is_equal(*before, *now)) return true;
    if (now) before = now;
  }
  return false;
}

/// Whether the response changes with time at any point, by t itself or by states and solutions that change.
bool depends_on_time(const driver::Session& session, const LinearStep& linear, const Sampler& sampler) {
  const std::vector<std::string> params = stencil::interface_of(linear.module(), linear.program()).params;
  return sampler.varies_in_time() ||
         (contains(params, std::string("t")) && std::ranges::any_of(sampler.different_points(), [&](const auto& here) {
            return depends_on_time(session, linear, here.point);
          }));
}

/// The sum of the magnitudes of G - 1: it grows with the largest rate.
double weight_of(const std::optional<LinearisedStep>& response) {
  double sum = 0;
  for (std::size_t row = 0; response && row < response->rows.size(); ++row) {
    for (const LinearForm::Term& term : response->rows[row].terms())
      sum += std::abs(term.coefficient - (term.key == static_cast<std::int64_t>(row) ? 1 : 0));
  }
  if (!response) return sum;
  for (const WaveSum& wave : response->waves) {
    for (const LinearForm::Term& term : wave.divisor.terms()) sum += std::abs(term.coefficient);
    for (const WaveSum::Term& part : wave.terms) {
      for (const LinearForm::Term& term : part.form.terms()) sum += std::abs(term.coefficient);
    }
  }
  return sum;
}

/// The cost of one wave, in products.
std::size_t work_of(const LinearisedStep& response) {
  std::size_t terms = 0;
  for (const LinearForm& row : response.rows) terms += row.terms().size();
  for (const WaveSum& wave : response.waves) {
    for (const WaveSum::Term& term : wave.terms) terms += term.form.terms().size();
  }
  return terms * response.rows.size();
}

bool may_take_long(const LinearStep& linear) {
  return linear.is_semi_lagrangian() || linear.solves() || linear.reduces();
}

/// The number of points to analyse. An analysis takes long for semi-Lagrangian steps, with solves, and if many stages
/// contain means.
std::size_t most_points_of(const LinearStep& linear, const ScenePoint& point, double step) {
  if (linear.solves()) return most_points_with_solves;
  if (linear.is_semi_lagrangian()) return most_points;
  const std::optional<LinearisedStep> response = linear.response(point.point, step);
  if (!response || response->waves.empty()) return std::numeric_limits<std::size_t>::max();
  return std::max(fewest_points_with_means, work_of_points / work_of(*response));
}

/// Step lengths for the weights of points: short ones, in which only rates count, and a long one, in which implicit
/// terms weigh little. Not the scene's step, in which the heaviest point may be at a root of the scheme's polynomial.
class Scales {
 public:
  Scales(const LinearStep& linear, const std::vector<ScenePoint>& points, double step) : linear_(linear) {
    constexpr double least = 1e-4, middle = 1e-3, most = 1e-2, far = 1e6;  // of the change in a step, without unit
    constexpr int looks = 8;
    short_ = step;
    std::vector<Rest> rests;
    for (const ScenePoint& point : points) rests.push_back(rest_at(point));
    for (int i = 0; i < looks; ++i) {
      const double change = largest_change(points, rests, short_);
      if (change == 0 || (change >= least && change <= most)) break;
      short_ *= std::isfinite(change) ? std::clamp(middle / change, 1 / far, far) : middle;
    }
    steps_ = {short_};
    if (!linear.is_semi_lagrangian()) steps_.push_back(far * short_);  // semi-Lagrangian steps would carry too far
  }

  const std::vector<double>& steps() const { return steps_; }
  double weight(const ScenePoint& point, double step, FrozenStages& stages) const {
    return weight_of(linear_.response(point.point, step, stages));
  }

 private:
  /// A step of length 0 from a point: its weight, and the stages, which are those of any step length.
  struct Rest {
    FrozenStages stages;
    std::optional<double> weight;
  };
  Rest rest_at(const ScenePoint& point) const {
    Rest rest;
    const std::optional<LinearisedStep> response = linear_.response(point.point, 0, rest.stages);
    if (response) rest.weight = weight_of(response);
    return rest;
  }

  double largest_change(const std::vector<ScenePoint>& points, std::vector<Rest>& rests, double step) const {
    double largest = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::optional<LinearisedStep> response = linear_.response(points[i].point, step, rests[i].stages);
      if (!response && rests[i].weight) return std::numeric_limits<double>::infinity();
      largest = std::max(largest, std::abs(weight_of(response) - rests[i].weight.value_or(0)));
    }
    return largest;
  }

  const LinearStep& linear_;
  double short_;
  std::vector<double> steps_;
};

/// The points by their best rank over all scales, heaviest first.
std::vector<ScenePoint> by_weight(std::vector<ScenePoint> points, const Scales& scales) {
  std::vector<std::pair<std::size_t, std::size_t>> ranks;  // rank and index of a point
  for (std::size_t i = 0; i < points.size(); ++i) ranks.emplace_back(points.size(), i);
  std::vector<FrozenStages> stages(points.size());
  for (const double step : scales.steps()) {
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < points.size(); ++i) order.emplace_back(-scales.weight(points[i], step, stages[i]), i);
    std::ranges::sort(order);
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
      std::size_t& known = ranks[order[rank].second].first;
      known = std::min(known, rank);
    }
  }
  std::ranges::sort(ranks);
  std::vector<ScenePoint> sorted;
  for (const auto& [rank, i] : ranks) sorted.push_back(std::move(points[i]));
  return sorted;
}

/// Chooses points spread from the heaviest to the lightest; `others` are the heaviest of the rest.
RankedPoints ranked(std::vector<ScenePoint> points, const driver::Session& session, const LinearStep& linear) {
  const std::size_t most = most_points_of(linear, points.front(), session.problem().step);
  if (points.size() <= most) return {std::move(points), {}};
  const Scales scales(linear, points, session.problem().step);
  points = by_weight(std::move(points), scales);
  const std::optional<LinearisedStep> response = linear.response(points.front().point, session.problem().step);
  const std::size_t most_others = response ? work_of_others / std::max<std::size_t>(1, work_of(*response)) : 0;
  RankedPoints result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t next = result.chosen.size();
    const bool is_chosen = next < most && i == next * (points.size() - 1) / (most - 1);
    if (is_chosen || result.others.size() < most_others)
      (is_chosen ? result.chosen : result.others).push_back(std::move(points[i]));
  }
  return result;
}

std::size_t size_of(const stencil::Expr& e) {
  std::size_t size = 1;
  for_each_child(e, [&](const stencil::Expr& child) { size += size_of(child); });
  return size;
}

/// The cost of one response, in parts of expressions.
std::size_t work_of(const LinearStep& linear) {
  std::size_t work = 1;
  for (const stencil::Kernel& kernel : linear.module().kernels) {
    for (const stencil::Let& let : kernel.lets) work += size_of(let.value);
    for (const stencil::Store& store : kernel.stores) work += size_of(store.value);
  }
  return work;
}

/// The points with the heaviest responses among many cells and times: formulas may be large in a spot or for a moment.
std::vector<ScenePoint> heaviest_points(const driver::Session& session, const LinearStep& linear,
                                        const Sampler& sampler, bool varies_in_time) {
  const std::size_t cells = sampler.varies_in_space() ? session.workspace().cell_count() : 1;
  const std::size_t all = std::clamp(work_of_looks / work_of(linear), fewest_looks, most_looks);
  const std::size_t looks = std::min(cells, varies_in_time ? most_cells_a_time : all);
  const std::size_t times = !varies_in_time ? 1 : cells == 1 ? all : std::max<std::size_t>(2, all / most_cells_a_time);
  const std::size_t most = may_take_long(linear) ? heaviest_of_ranked : heaviest;
  const Scales scales(linear, sampler.different_points(), session.problem().step);
  std::vector<std::vector<std::pair<double, ScenePoint>>> found(scales.steps().size());
  for (std::size_t i = 0; i < looks; ++i) {
    for (std::size_t k = 0; k < times; ++k) {
      const double part = times == 1 ? 0.5 : static_cast<double>(k) / static_cast<double>(times - 1);
      const ScenePoint point =
          sampler.at(cells == 1 ? session.workspace().cell_count() / 2 : spread(i, cells), time_within(session, part));
      FrozenStages stages;
      for (std::size_t scale = 0; scale < found.size(); ++scale) {
        auto& own = found[scale];
        const double weight = scales.weight(point, scales.steps()[scale], stages);
        if (own.size() == most && !(weight > (1 + alike) * own.back().first)) continue;
        own.emplace_back(weight, point);
        std::ranges::stable_sort(own, std::greater(), &std::pair<double, ScenePoint>::first);
        if (own.size() > most) own.pop_back();
      }
    }
  }
  std::vector<ScenePoint> result;
  for (auto& own : found) {
    for (auto& [weight, point] : own) result.push_back(std::move(point));
  }
  return result;
}

}  // namespace

std::set<std::string> fields_of_response(const LinearStep& linear, const FrozenPoint& point, double step) {
  std::set<std::string> result;
  for (const auto& [name, value] : point.fields) {
    if (depends_on(linear, point, step, [&](FrozenPoint& p) { p.fields[name] = unknown_field(); })) result.insert(name);
  }
  return result;
}

RankedPoints ranked_points(driver::Session& session, const LinearStep& linear) {
  std::vector<ScenePoint> points = all_frozen_points(session, linear);
  return may_take_long(linear) ? ranked(std::move(points), session, linear) : RankedPoints{std::move(points), {}};
}

std::vector<ScenePoint> frozen_points(driver::Session& session, const LinearStep& linear) {
  return ranked_points(session, linear).chosen;
}

std::vector<ScenePoint> all_frozen_points(driver::Session& session, const LinearStep& linear) {
  const Sampler sampler(session, linear);
  std::vector<ScenePoint> result;
  const std::set<std::size_t> cells = sampler.cells();
  const bool varies = depends_on_time(session, linear, sampler);
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
    if (session.engine().state_index(name) < 0 && !linear.known_networks().contains(name)) {
      const std::vector<double> values = session.workspace().dense(name);
      if (std::ranges::all_of(values, [&](double v) { return v == values.front(); })) continue;
    }
    value = unknown_field();
  }
  for (auto& [name, value] : spoilt.whole) value = unknown_field();
  for (const model::Control& control : session.problem().controls) spoilt.params[control.name] = not_a_number;
  return linear.response(spoilt, session.problem().step).has_value();
}

bool varies_in_time(driver::Session& session) {
  std::string why;
  const std::optional<LinearStep> linear = linear_step(session, why);
  if (!linear) return false;
  const Sampler sampler(session, *linear);
  return depends_on_time(session, *linear, sampler);
}

}  // namespace dpde::stability
