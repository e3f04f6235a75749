// SPDX-License-Identifier: Apache-2.0
// Jumps at zeros of divisors. The divisor changes its sign there, as in atan(1/z), or touches 0, as in z/abs(z) and
// z/sqrt(z^2).
#include <algorithm>
#include <cmath>
#include <utility>

#include "support/maths/comparisons.h"
#include "support/maths/jump_search.h"

namespace dpde {

namespace {

constexpr double smallest_gap = 1e-60;  // its fifth power does not underflow
constexpr double golden = 0.618033988749895;
/// A minimum is 0 if it falls with the bracket's width, or its root: to a millionth at the first check.
constexpr int most_shrinks = 200, first_look = 30;
constexpr double most_at_first_look = 1e-2;
constexpr double widest_stair = 0x1p-20;  // relative to the interval first searched
/// The same for zeros with small rounding: all other points used are within that distance.
constexpr double widest_cancelled = 1 / cancelled_distance;
constexpr double least_digits = 16, least_growth = 1024;
constexpr int most_on_a_line = 4;
constexpr double near_value = 0.5;  // relative to the value of a parameter

}  // namespace

std::vector<Piecewise::Id> JumpSearch::parts_of_divisor(Id pole) const {
  const Piecewise::Node& node = formula_.nodes_[pole];
  const bool divides = node.kind == Piecewise::Kind::binary && node.op == BinaryOp::divide;
  std::vector<bool> is_part(pole, false);
  is_part[divides ? node.b : node.a] = true;
  std::vector<Id> parts;
  for (Id id = pole; id-- > 0;) {
    if (!is_part[id]) continue;
    parts.push_back(id);
    for (const Id operand : operands_of(formula_.nodes_[id])) is_part[operand] = true;
  }
  std::ranges::reverse(parts);
  return parts;
}

double JumpSearch::divisor(Id pole, double s) {
  of_divisor_.sides.clear();
  for (const Id id : divisors_.at(pole)) evaluate(formula_.nodes_[id], id, s, of_divisor_);
  return divisor(pole, of_divisor_.values);
}

/// The expression that is 0 at the node's pole.
double JumpSearch::divisor(Id pole, const std::vector<double>& values) const {
  const Piecewise::Node& node = formula_.nodes_[pole];
  const double operand = values[divisors_.at(pole).back()];
  return node.kind == Piecewise::Kind::call && node.fn == Fn::tan ? std::cos(operand) : operand;
}

std::optional<JumpSearch::Place> JumpSearch::crossing(Id pole, double from, double to, double widest) {
  const bool is_negative = std::signbit(divisor(pole, from));
  double low = from, high = to;
  for (int k = 0; k < bisections; ++k) {
    const double middle = low + (high - low) / 2;
    if (middle == low || middle == high) break;
    const double value = divisor(pole, middle);
    if (std::isnan(value)) return std::nullopt;
    (std::signbit(value) == is_negative ? low : high) = middle;
  }
  return around_zero(pole, {low, high}, widest, [&](double s) { return divisor(pole, s); });
}

/// Point where a part of the divisor changes its sign, as z in abs(z) and z^2, or where min or max switches; of
/// several, the one with the smallest divisor. Rounding makes |divisor| a staircase, whose minimum need not contain the
/// zero.
std::optional<JumpSearch::Place> JumpSearch::change_of_a_part(Id pole, double from, double to, double most,
                                                              double widest) {
  std::optional<Place> nearest;
  for (const Id part : divisors_.at(pole)) {
    const Height height = [&](double s) {
      divisor(pole, s);
      return margin(part, of_divisor_.values);
    };
    const auto is_negative = [&](double s) { return std::signbit(height(s)); };
    const bool at_first = is_negative(from);
    if (is_negative(to) == at_first) continue;
    double low = from, high = to;
    for (int k = 0; k < bisections; ++k) {
      const double middle = low + (high - low) / 2;
      if (middle == low || middle == high) break;
      (is_negative(middle) == at_first ? low : high) = middle;
    }
    const std::optional<Place> place = around_zero(pole, {low, high}, widest, height);
    if (!place) continue;
    const double size = std::max(std::abs(divisor(pole, place->before)), std::abs(divisor(pole, place->behind)));
    if (!(size <= most)) continue;
    most = size;
    nearest = place;
  }
  return nearest;
}

/// A value that changes sign at the node's kink; for nodes without a kink, their value.
double JumpSearch::margin(Id id, const std::vector<double>& values) const {
  const Piecewise::Node& node = formula_.nodes_[id];
  const bool is_extreme = node.kind == Piecewise::Kind::call && (node.fn == Fn::min || node.fn == Fn::max);
  return is_extreme ? values[node.a] - values[node.b] : values[id];
}

/// Minimum of |divisor| between the points, by golden section. nullopt if it does not soon fall below a part of the
/// values at the ends.
std::optional<JumpSearch::Place> JumpSearch::touching(Id pole, double from, double to, double most_left,
                                                      double widest) {
  const auto size = [&](double s) { return std::abs(divisor(pole, s)); };
  const double at_ends = std::max(size(from), size(to));
  if (const std::optional<Place> place = change_of_a_part(pole, from, to, most_left * at_ends, widest)) return place;
  double low = from, high = to, left = to, right = from, at_left = 0, at_right = 0;
  for (int k = 0; k < most_shrinks; ++k) {
    if (!(low < left && left < right && right < high)) {  // at first, and where rounding has moved them
      left = high - golden * (high - low);
      right = low + golden * (high - low);
      if (!(low < left && left < right && right < high)) break;
      at_left = size(left);
      at_right = size(right);
    }
    if (at_left < at_right) {
      high = std::exchange(right, left);
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = size(left);
    } else {
      low = std::exchange(left, right);
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = size(right);
    }
    if (k != first_look) continue;
    if (!(std::min(at_left, at_right) <= most_left * at_ends)) return std::nullopt;
    if (const std::optional<Place> place = change_of_a_part(pole, low, high, most_left * at_ends, widest)) return place;
  }
  return around_zero(pole, {low, high}, widest, [&](double s) { return divisor(pole, s); });
}

/// Widens the place until the divisor is nonzero at both ends and `height` differs by a step there, so that values one
/// width farther away differ from it. nullopt if that needs steps wider than `widest`, unless all values within are
/// rounding.
std::optional<JumpSearch::Place> JumpSearch::around_zero(Id pole, const Place& place, double widest,
                                                         const Height& height) {
  const Id operand = divisors_.at(pole).back();
  const auto is_rounding = [&](double s) { return std::abs(divisor(pole, s)) <= rounding_at(operand, s); };
  for (double step = place.gap(); step <= widest * (widest_cancelled / widest_stair); step *= 2) {
    const Place wide{place.before - step, place.behind + step};
    if (step > widest && !is_rounding(wide.before) && !is_rounding(wide.behind)) break;
    const bool is_zero = divisor(pole, wide.before) == 0 || divisor(pole, wide.behind) == 0;
    const bool is_same =
        height && (height(wide.before) == height(place.before) || height(wide.behind) == height(place.behind));
    if (!is_zero && !is_same) return wide;
  }
  return std::nullopt;
}

/// Moves the line's origin next to the zero, where numbers are denser. nullopt, with the line unchanged, if that does
/// not reduce the divisor.
std::optional<JumpSearch::Place> JumpSearch::move_nearer(Id pole, const Place& place, bool crosses) {
  const auto size = [&](const Place& p) {
    return std::max(std::abs(divisor(pole, p.before)), std::abs(divisor(pole, p.behind)));
  };
  const double now = size(place), reach = 4 * place.gap();
  const std::vector<double> base = base_;
  for (std::size_t i = 0; i < base_.size(); ++i) base_[i] += place.before * direction_[i];
  const bool changes = std::signbit(divisor(pole, -reach)) != std::signbit(divisor(pole, reach));
  std::optional<Place> nearer;
  if (crosses == changes)
    nearer = crosses ? crossing(pole, -reach, reach, reach) : touching(pole, -reach, reach, 1, reach);
  if (nearer && size(*nearer) <= now / 2) return nearer;
  base_ = base;
  return std::nullopt;
}

/// Tests as near to the zero as numbers allow: for z/(abs(z) + 1e-30) both sides meet there.
bool JumpSearch::jumps_at_pole(Id pole, Place place, bool crosses, double widest) {
  const std::vector<double> base = base_;
  bool jumps = jumps_at_pole(pole, place, widest);
  while (jumps && place.gap() > smallest_gap) {
    const std::optional<Place> nearer = move_nearer(pole, place, crosses);
    if (!nearer) break;
    place = *nearer;
    jumps = jumps_at_pole(pole, place, widest);
  }
  base_ = base;
  return jumps;
}

/// Values with two different limits jump. Values without a limit diverge: if states cause this the run ends, so the
/// divisor keeps its sign; if only parameters and coordinates do, it happens during the run.
bool JumpSearch::jumps_at_pole(Id pole, const Place& place, double widest) const {
  if (!may_be_reached(pole, place)) return false;
  const std::optional<Place> seen = beyond_rounding(place, widest * (widest_cancelled / widest_stair));
  if (!seen) return false;
  const auto [before, behind] = *seen;
  const bool cancels = seen->gap() > place.gap();
  const double apart = (cancels ? cancelled_distance : distance) * seen->gap();
  const Look low = look(before), high = look(behind), far_low = look(before - apart), far_high = look(behind + apart);
  const std::vector<bool> needed_low = needed(low), needed_high = needed(high);
  if (!(needed_low[pole] || needed_high[pole]) || !is_defined(low, needed_low) || !is_defined(high, needed_high))
    return false;
  const double jump = jump_between(low, high);
  const double unsettled = std::max(jump_between(far_low, low), jump_between(far_high, high));
  if (!std::isfinite(jump) || !std::isfinite(unsettled)) return false;
  if (unsettled <= most_left_of_continuous * jump) {
    const bool at_kink = has_kink(low, high, far_low, needed_low);
    return is_visible(before, low, behind, high) && is_possible_at_pole(pole, before, at_kink) &&
           is_possible_at_pole(pole, behind, at_kink);
  }
  const bool is_infinite = low.result() * high.result() < 0 && far_low.result() * far_high.result() < 0 &&
                           std::abs(low.result()) > 2 * std::abs(far_low.result()) &&
                           std::abs(high.result()) > 2 * std::abs(far_high.result());
  return is_infinite && is_of_the_run(pole, low) && is_possible_at_pole(pole, before, false) &&
         is_possible_at_pole(pole, behind, false);
}

/// Quick test that excludes most poles, since divisors keep their signs.
bool JumpSearch::may_be_reached(Id pole, const Place& place) const {
  const Look low = look(place.before), high = look(place.behind), beside = look(place.before - distance * place.gap());
  const std::vector<bool> needed_low = needed(low);
  const bool at_kink = has_kink(low, high, beside, needed_low) || may_hide_kink(low, needed_low);
  return is_possible_at_pole(pole, place.before, at_kink) && is_possible_at_pole(pole, place.behind, at_kink);
}

/// Whether rounding is comparable to the argument of a root or abs, or to a difference that is compared.
bool JumpSearch::may_hide_kink(const Look& look, const std::vector<bool>& needed) const {
  const std::vector<double> errors = rounding(look);
  for (Id id = 0; id < formula_.nodes_.size(); ++id) {
    const Piecewise::Node& node = formula_.nodes_[id];
    const bool is_call = node.kind == Piecewise::Kind::call, is_binary = node.kind == Piecewise::Kind::binary;
    if (!needed[id] || !node.moves || !(is_call || is_binary)) continue;
    const bool compares = is_call ? node.fn == Fn::min || node.fn == Fn::max : is_comparison(node.op);
    const bool has_root =
        (is_call && (node.fn == Fn::abs || node.fn == Fn::sqrt)) || (is_binary && node.op == BinaryOp::power);
    const double a = look.values[node.a], b = look.values[node.b];
    if (has_root && std::abs(a) * most_left_of_continuous <= errors[node.a]) return true;
    if (compares && std::abs(a - b) * most_left_of_continuous <= errors[node.a] + errors[node.b]) return true;
  }
  return false;
}

bool JumpSearch::is_possible_at_pole(Id pole, double s, bool at_kink) const {
  if (!at_kink && hangs_on_unknown_sign(pole)) return false;
  for (std::size_t i = 0; i < formula_.symbols_.size(); ++i) {
    const Piecewise::Symbol& symbol = formula_.symbols_[i];
    const double value = base_[i] + s * direction_[i];
    if (!at_kink && symbol.sign && value * *symbol.sign < 0) return false;
    const bool is_free = !symbol.moves || (at_kink && symbol.may_leave && one_moves_);
    if (!is_free && !(value >= symbol.low.value_or(value) && value <= symbol.high.value_or(value))) return false;
  }
  return true;
}

/// Whether the divisor depends on fields of unknown sign.
bool JumpSearch::hangs_on_unknown_sign(Id pole) const {
  return std::ranges::any_of(divisors_.at(pole), [&](Id id) {
    const Piecewise::Node& node = formula_.nodes_[id];
    return node.kind == Piecewise::Kind::symbol && node.moves && formula_.symbols_[node.symbol].has_unknown_sign;
  });
}

/// Whether abs, min, max, a root or a choice has a kink between the points. `beside` is farther away on the lower side.
bool JumpSearch::has_kink(const Look& low, const Look& high, const Look& beside,
                          const std::vector<bool>& needed) const {
  for (Id id = 0; id < formula_.nodes_.size(); ++id) {
    const Piecewise::Node& node = formula_.nodes_[id];
    if (!needed[id] || !node.moves) continue;
    const auto at = [&](const Look& look, Id operand) { return look.values[operand]; };
    const bool is_call = node.kind == Piecewise::Kind::call;
    if (is_call && node.fn == Fn::abs && std::signbit(at(low, node.a)) != std::signbit(at(high, node.a))) return true;
    if (is_call && (node.fn == Fn::min || node.fn == Fn::max) &&
        (at(low, node.a) < at(low, node.b)) != (at(high, node.a) < at(high, node.b)))
      return true;
    const bool is_power = node.kind == Piecewise::Kind::binary && node.op == BinaryOp::power &&
                          at(low, node.b) != std::floor(at(low, node.b));
    if ((is_power || (is_call && node.fn == Fn::sqrt)) &&
        std::abs(at(low, node.a)) <= most_left_of_continuous * std::abs(at(beside, node.a)))
      return true;
  }
  return low.sides != high.sides;
}

/// Whether the divisor depends only on known values, with parameters near their values.
bool JumpSearch::is_of_the_run(Id pole, const Look& look) const {
  return std::ranges::all_of(divisors_.at(pole), [&](Id id) {
    const Piecewise::Node& node = formula_.nodes_[id];
    if (node.kind != Piecewise::Kind::symbol) return true;
    const Piecewise::Symbol& symbol = formula_.symbols_[node.symbol];
    if (!symbol.value) return symbol.low && symbol.high;
    return std::abs(look.values[id] - *symbol.value) <= near_value * std::abs(*symbol.value);
  });
}

/// Intervals between samples in which the divisor changes its sign or has its smallest magnitude, nearest first.
std::vector<JumpSearch::Bracket> JumpSearch::brackets(Id pole, const std::vector<double>& at,
                                                      const std::vector<Look>& looks) const {
  std::vector<double> divisors;
  for (const Look& look : looks) divisors.push_back(divisor(pole, look.values));
  const auto size = [&](std::size_t i) { return std::abs(divisors[i]); };
  const std::size_t middle = at.size() / 2;
  std::vector<Bracket> result;
  for (std::size_t k = 0; k < middle; ++k) {
    for (const std::size_t i : {middle + k, middle - 1 - k}) {
      if (std::isnan(divisors[i]) || std::isnan(divisors[i + 1])) continue;
      const bool crosses = std::signbit(divisors[i]) != std::signbit(divisors[i + 1]);
      const bool is_least = !crosses && i > 0 && size(i) < size(i - 1) && size(i) <= size(i + 1);
      if (crosses || is_least)
        result.push_back({at[crosses ? i : i - 1], at[i + 1], widest_stair * (at[i + 1] - at[i]), crosses});
    }
  }
  return result;
}

std::optional<JumpSearch::Place> JumpSearch::zero_in(Id pole, const Bracket& bracket) {
  const auto [from, to, widest, crosses] = bracket;
  return crosses ? crossing(pole, from, to, widest) : touching(pole, from, to, most_at_first_look, widest);
}

/// Tests the nearest candidates of each pole on a line.
std::optional<JumpSearch::Id> JumpSearch::search_poles(const std::vector<double>& at, const std::vector<Look>& looks) {
  for (const Id pole : poles_) {
    const int before = tried_[pole];
    for (const Bracket& bracket : brackets(pole, at, looks)) {
      if (is_judged(pole) || tried_[pole] >= before + most_on_a_line) break;
      const std::optional<Place> place = zero_in(pole, bracket);
      ++tried_[pole];
      judged_[pole] += place && is_possible_at_pole(pole, place->before, false) ? 1 : 0;
      if (place && jumps_at_pole(pole, *place, bracket.crosses, bracket.widest)) return pole;
    }
  }
  return std::nullopt;
}

/// A value that touches 0 is rounding there, or falls with the distance down to the smallest numbers; a nonzero minimum
/// does not fall.
bool JumpSearch::touches_zero() {
  const Id pole = formula_.nodes_.size() - 1;
  const auto touches = [&](const Bracket& bracket) {
    const std::optional<Place> place = bracket.crosses ? std::nullopt : zero_in(pole, bracket);
    if (!place || std::signbit(divisor(pole, place->before)) != std::signbit(divisor(pole, place->behind)))
      return false;
    const double size = std::abs(divisor(pole, place->behind)), farther = place->behind + least_growth * place->gap();
    return size <= least_digits * rounding_at(divisors_.at(pole).back(), place->behind) ||
           least_growth * size <= std::abs(divisor(pole, farther));
  };
  for (int line = 0; line < enough && divisors_.contains(pole); ++line) {
    choose_line(false, false);
    const std::vector<double> at = places();
    std::vector<Look> looks;
    for (const double s : at) looks.push_back(look(s));
    if (std::ranges::any_of(brackets(pole, at, looks), touches)) return true;
  }
  return false;
}

bool touches_zero(const Piecewise& reciprocal) { return JumpSearch(reciprocal).touches_zero(); }

}  // namespace dpde
