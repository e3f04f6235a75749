// SPDX-License-Identifier: Apache-2.0
#include "support/maths/piecewise.h"

#include <algorithm>
#include <cmath>

#include "support/assert.h"
#include "support/maths/comparisons.h"
#include "support/maths/evaluate.h"
#include "support/maths/jump_search.h"

namespace dpde {

Piecewise::Id Piecewise::add(Node node) {
  nodes_.push_back(node);
  return nodes_.size() - 1;
}

Piecewise::Id Piecewise::number(double value) { return add({.kind = Kind::number, .value = value}); }

Piecewise::Id Piecewise::symbol(const Symbol& symbol) {
  symbols_.push_back(symbol);
  return add({.kind = Kind::symbol, .symbol = symbols_.size() - 1, .moves = symbol.moves});
}

Piecewise::Id Piecewise::negate(Id operand) {
  return add({.kind = Kind::negate, .a = operand, .moves = nodes_[operand].moves});
}

Piecewise::Id Piecewise::binary(BinaryOp op, Id left, Id right) {
  const bool moves = nodes_[left].moves || nodes_[right].moves;
  const bool is_pole = (op == BinaryOp::divide && nodes_[right].moves) ||
                       (op == BinaryOp::power && nodes_[left].moves && !is_positive(right));
  return add({.kind = Kind::binary, .op = op, .a = left, .b = right, .moves = moves, .is_pole = is_pole});
}

Piecewise::Id Piecewise::call(Fn fn, Id left, std::optional<Id> right) {
  const bool moves = nodes_[left].moves || (right && nodes_[*right].moves);
  return add({.kind = Kind::call,
              .fn = fn,
              .a = left,
              .b = right.value_or(left),
              .moves = moves,
              .is_switch = moves && has_jumps(fn),
              .is_pole = moves && has_poles(fn)});
}

/// Whether an exponent is positive, so that it causes no pole.
bool Piecewise::is_positive(Id id) const {
  const Node& node = nodes_[id];
  if (node.kind == Kind::symbol) return symbols_[node.symbol].value.value_or(0) > 0;
  return node.kind == Kind::number && node.value >= 0;
}

Piecewise::Id Piecewise::choice(Id condition, Id yes, Id no) {
  const bool moves = nodes_[condition].moves || nodes_[yes].moves || nodes_[no].moves;
  return add(
      {.kind = Kind::choice, .a = condition, .b = yes, .c = no, .moves = moves, .is_switch = nodes_[condition].moves});
}

namespace {

constexpr int most_lines = 64;
constexpr int most_in_a_gap = 16;  // changes between two samples

}  // namespace

JumpSearch::JumpSearch(const Piecewise& formula) : formula_(formula) {
  for (Id id = 0; id < formula.nodes_.size(); ++id) {
    const Piecewise::Node& node = formula.nodes_[id];
    if (node.is_switch) switches_.push_back(id);
    if (node.is_pole) poles_.push_back(id);
    if (node.kind == Piecewise::Kind::binary && node.moves && is_comparison(node.op)) comparisons_.push_back(id);
    if (node.kind == Piecewise::Kind::number && node.value != 0) hints_.push_back(node.value);
  }
  for (const Piecewise::Symbol& symbol : formula.symbols_) {
    if (symbol.value.value_or(0) != 0) hints_.push_back(*symbol.value);
  }
  judged_.assign(formula.nodes_.size(), 0);
  tried_ = judged_;
  of_divisor_.values.assign(formula.nodes_.size(), 0);
  for (const Id pole : poles_) divisors_.emplace(pole, parts_of_divisor(pole));
}

/// 0 and both signs from 1e-3 to 1e6, sorted.
std::vector<double> JumpSearch::places() {
  std::vector<double> result;
  for (int k = 18; k >= -9; --k) result.push_back(-std::pow(10.0, k / 3.0));
  result.push_back(0);
  for (int k = -9; k <= 18; ++k) result.push_back(std::pow(10.0, k / 3.0));
  return result;
}

/// A start near the numbers of the formula, which include thresholds, or anywhere. Not at 0, where u/sqrt(u^2 + v^2)
/// jumps on lines with v = 0 and on no other.
double JumpSearch::start_of(const Piecewise::Symbol& symbol, bool positive) {
  if (symbol.value) return symbol.moves ? *symbol.value * (1 + 0.1 * normal_(random_)) : *symbol.value;
  if (symbol.low && symbol.high) return *symbol.low + (*symbol.high - *symbol.low) * part_of_one_(random_);
  const bool near = !hints_.empty() && part_of_one_(random_) < 0.5;
  const auto which = static_cast<std::size_t>(part_of_one_(random_) * static_cast<double>(hints_.size()));
  const double value =
      near ? hints_[std::min(which, hints_.size() - 1)] * (1 + 0.1 * normal_(random_)) : normal_(random_) * spread();
  return positive ? std::abs(value) : value;
}

void JumpSearch::choose_line(bool positive, bool one_moves) {
  std::vector<std::size_t> moving;
  base_.clear();
  direction_.assign(formula_.symbols_.size(), 0);
  for (std::size_t i = 0; i < formula_.symbols_.size(); ++i) {
    base_.push_back(start_of(formula_.symbols_[i], positive));
    if (formula_.symbols_[i].moves) moving.push_back(i);
  }
  if (one_moves) {
    const auto which = static_cast<std::size_t>(part_of_one_(random_) * static_cast<double>(moving.size()));
    moving = {moving[std::min(which, moving.size() - 1)]};
  }
  for (const std::size_t i : moving) direction_[i] = normal_(random_) * spread();
  one_moves_ = moving.size() == 1;
}

void JumpSearch::evaluate(const Piecewise::Node& node, Id id, double s, Look& look) const {
  std::vector<double>& values = look.values;
  switch (node.kind) {
    case Piecewise::Kind::number: values[id] = node.value; return;
    case Piecewise::Kind::symbol: values[id] = base_[node.symbol] + s * direction_[node.symbol]; return;
    case Piecewise::Kind::negate: values[id] = -values[node.a]; return;
    case Piecewise::Kind::binary: values[id] = evaluate_binary(node.op, values[node.a], values[node.b]); return;
    case Piecewise::Kind::call:
      values[id] = evaluate_call(node.fn, values[node.a], values[node.b]);
      if (node.is_switch) look.sides.push_back(node.fn == Fn::fraction ? std::floor(values[node.a]) : values[id]);
      return;
    case Piecewise::Kind::choice:
      values[id] = values[node.a] != 0 ? values[node.b] : values[node.c];
      if (node.is_switch) look.sides.push_back(values[node.a]);
      return;
  }
  unreachable("kind of node");
}

JumpSearch::Look JumpSearch::look(double s) const {
  Look result{std::vector<double>(formula_.nodes_.size()), {}};
  for (Id id = 0; id < formula_.nodes_.size(); ++id) evaluate(formula_.nodes_[id], id, s, result);
  return result;
}

std::vector<Piecewise::Id> JumpSearch::operands_of(const Piecewise::Node& node) {
  switch (node.kind) {
    case Piecewise::Kind::number:
    case Piecewise::Kind::symbol: return {};
    case Piecewise::Kind::negate: return {node.a};
    case Piecewise::Kind::binary:
    case Piecewise::Kind::call: return {node.a, node.b};
    case Piecewise::Kind::choice: return {node.a, node.b, node.c};
  }
  unreachable("kind of node");
}

/// Nodes on which the result depends at this point: of a choice only one branch.
std::vector<bool> JumpSearch::needed(const Look& look) const {
  std::vector<bool> result(formula_.nodes_.size(), false);
  result.back() = true;
  for (Id id = formula_.nodes_.size(); id-- > 0;) {
    const Piecewise::Node& node = formula_.nodes_[id];
    if (!result[id]) continue;
    const bool is_choice = node.kind == Piecewise::Kind::choice;
    const Id taken = is_choice && look.values[node.a] != 0 ? node.b : node.c;
    for (const Id operand : operands_of(node)) {
      if (!is_choice || operand == node.a || operand == taken) result[operand] = true;
    }
  }
  return result;
}

/// Whether all varying symbols are in their ranges.
bool JumpSearch::is_possible(double s) const {
  for (std::size_t i = 0; i < formula_.symbols_.size(); ++i) {
    const Piecewise::Symbol& symbol = formula_.symbols_[i];
    const double value = base_[i] + s * direction_[i];
    const bool is_free = !symbol.moves || (symbol.may_leave && one_moves_);
    if (!is_free && !(value >= symbol.low.value_or(value) && value <= symbol.high.value_or(value))) return false;
  }
  return true;
}

/// Whether no needed node is NaN. min and max of NaN and a number return the number, but if a root inside them ceases
/// to be real, this is the end of the formula's domain and no switch.
bool JumpSearch::is_defined(const Look& look, const std::vector<bool>& needed) const {
  for (Id id = 0; id < formula_.nodes_.size(); ++id) {
    if (needed[id] && std::isnan(look.values[id])) return false;
  }
  return true;
}

/// Whether a switch that needs more tests has changed sides, or a comparison of a condition has: an interval bounded by
/// two comparisons may be between points that are both outside.
bool JumpSearch::is_open(const Look& one, const Look& other) const {
  for (const Id id : comparisons_) {
    if (one.values[id] != other.values[id] && judged_[id] < enough) return true;
  }
  for (std::size_t i = 0; i < switches_.size(); ++i) {
    const bool differs = one.sides[i] != other.sides[i] && !std::isnan(one.sides[i]) && !std::isnan(other.sides[i]);
    if (differs && judged_[switches_[i]] < enough) return true;
  }
  return false;
}

/// Whether all switches and comparisons agree.
bool JumpSearch::is_alike(const Look& one, const Look& other) const {
  return one.sides == other.sides &&
         std::ranges::all_of(comparisons_, [&](Id id) { return one.values[id] == other.values[id]; });
}

/// Steps over a single point with a side of its own, as u = 0 in sign(u): half of the jump is before it and half after
/// it. By rounding this may be a few adjacent numbers.
JumpSearch::Place JumpSearch::beside_one_place(double before, double behind) const {
  const double wide = widest_place * (behind - before);
  const bool is_at_low = !is_alike(look(before), look(before - wide));
  const bool is_at_high = !is_alike(look(behind), look(behind + wide));
  return {is_at_low ? before - wide : before, is_at_high ? behind + wide : behind};
}

/// Tests a switch that changes sides between these (almost) adjacent points.
std::optional<Piecewise::Id> JumpSearch::judge(double low_side, double high_side) {
  const auto [before, behind] = beside_one_place(low_side, high_side);
  if (!is_possible(before) || !is_possible(behind)) return std::nullopt;
  const Look low = look(before), high = look(behind);
  const std::vector<bool> needed_low = needed(low), needed_high = needed(high);
  if (!is_defined(low, needed_low) || !is_defined(high, needed_high)) return std::nullopt;
  std::optional<Id> changed;
  for (std::size_t i = 0; i < switches_.size() && !changed; ++i) {
    if (low.sides[i] != high.sides[i] && (needed_low[switches_[i]] || needed_high[switches_[i]]))
      changed = switches_[i];
  }
  if (!changed) return std::nullopt;
  const double gap = behind - before, apart = distance * gap;
  const double near = std::abs(look(behind + apart).result() - look(before - apart).result());
  if (!std::isfinite(high.result() - low.result())) return std::nullopt;
  ++judged_[*changed];
  return is_visible(before, low, behind, high) && !(jump_between(low, high) <= most_left_of_continuous * near)
             ? changed
             : std::nullopt;
}

/// Whether the jump is visible compared with the formula's size and its change on either side.
bool JumpSearch::is_visible(double before, const Look& low, double behind, const Look& high) const {
  const double gap = behind - before, jump = jump_between(low, high);
  const double beside = std::max(std::abs(low.result() - look(before - 2 * gap).result()),
                                 std::abs(high.result() - look(behind + 2 * gap).result()));
  const double size = std::max({std::abs(low.result()), std::abs(high.result()), typical_});
  return jump > smallest_jump * size && !(jump <= 10 * beside);
}

std::optional<Piecewise::Id> JumpSearch::search_between(double from, const Look& at_from, double to,
                                                        const Look& at_to) {
  Look here = at_from;
  for (int found = 0; found < most_in_a_gap && is_open(here, at_to); ++found) {
    double low = from, high = to;
    for (int k = 0; k < bisections; ++k) {
      const double middle = low + (high - low) / 2;
      if (middle == low || middle == high) break;
      (is_open(here, look(middle)) ? high : low) = middle;
    }
    if (const std::optional<Id> jump = judge(low, high)) return jump;
    from = high;
    here = look(high);
    const Look below = look(low);
    for (const Id id : comparisons_) judged_[id] += below.values[id] != here.values[id] ? 1 : 0;
  }
  return std::nullopt;
}

std::optional<Piecewise::Id> JumpSearch::search_line() {
  const std::vector<double> at = places();
  std::vector<Look> looks;
  std::vector<double> sizes;
  for (const double s : at) {
    looks.push_back(look(s));
    if (std::abs(s) <= 1 && std::isfinite(looks.back().result())) sizes.push_back(std::abs(looks.back().result()));
  }
  std::ranges::sort(sizes);
  typical_ = sizes.empty() ? 0 : sizes[sizes.size() / 2];
  const std::size_t middle = at.size() / 2;  // nearest intervals first: far away all values are large
  for (std::size_t k = 0; k < middle; ++k) {
    for (const std::size_t i : {middle + k, middle - 1 - k}) {
      if (const std::optional<Id> jump = search_between(at[i], looks[i], at[i + 1], looks[i + 1])) return jump;
    }
  }
  return search_poles(at, looks);
}

std::optional<Piecewise::Id> JumpSearch::run() {
  const auto is_done = [&](Id id) { return is_judged(id); };
  const int lines = switches_.empty() && poles_.empty() ? 0 : most_lines;
  for (int line = 0; line < lines; ++line) {
    choose_line(line % 2 == 1, line % 4 >= 2);
    if (const std::optional<Id> jump = search_line()) return jump;
    if (std::ranges::all_of(switches_, is_done) && std::ranges::all_of(poles_, is_done)) break;
  }
  return std::nullopt;
}

std::optional<Piecewise::Id> find_jump(const Piecewise& formula) { return JumpSearch(formula).run(); }

std::optional<double> JumpSearch::sign() {
  const auto is_known = [](const Piecewise::Symbol& s) { return s.value || (s.low && s.high); };
  if (!std::ranges::all_of(formula_.symbols_, is_known)) return std::nullopt;
  std::optional<double> result;
  for (int k = 0; k < most_lines; ++k) {
    choose_line(false, false);
    const double value = look(0).result(), sign = (value > 0) - (value < 0);
    if (result.value_or(sign) != sign) return 0;
    result = sign;
  }
  return result;
}

std::optional<double> find_sign(const Piecewise& formula) { return JumpSearch(formula).sign(); }

}  // namespace dpde
