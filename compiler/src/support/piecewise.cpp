// SPDX-License-Identifier: Apache-2.0
#include "support/piecewise.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "support/assert.h"
#include "support/evaluate.h"

namespace dpde {

namespace {

/// Jumps below this part of the formula's size are those of guards, as if(abs(x) > 1e-8, sin(x)/x, 1).
constexpr double smallest_jump = 1e-7;
/// Of a value that is continuous across the switch, the difference across it falls with the distance, that of a tenth
/// root too: to 0.16 where the distance falls to the smallest there is from that many times as much. What is smooth
/// changes by next to nothing over both.
constexpr double most_left_of_continuous = 0.3, distance = 0x1p26;

bool is_comparison(BinaryOp op) {
  switch (op) {
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: return true;
    case BinaryOp::add:
    case BinaryOp::subtract:
    case BinaryOp::multiply:
    case BinaryOp::divide:
    case BinaryOp::power:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return false;
  }
  unreachable("operator");
}

bool has_cases(Fn fn) { return fn == Fn::sign || fn == Fn::floor || fn == Fn::fraction; }

}  // namespace

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
  return add({.kind = Kind::binary, .op = op, .a = left, .b = right, .moves = moves});
}

Piecewise::Id Piecewise::call(Fn fn, Id left, std::optional<Id> right) {
  const bool moves = nodes_[left].moves || (right && nodes_[*right].moves);
  return add({.kind = Kind::call,
              .fn = fn,
              .a = left,
              .b = right.value_or(left),
              .moves = moves,
              .is_switch = moves && has_cases(fn)});
}

Piecewise::Id Piecewise::choice(Id condition, Id yes, Id no) {
  const bool moves = nodes_[condition].moves || nodes_[yes].moves || nodes_[no].moves;
  return add(
      {.kind = Kind::choice, .a = condition, .b = yes, .c = no, .moves = moves, .is_switch = nodes_[condition].moves});
}

bool Piecewise::has_switch() const { return std::ranges::any_of(nodes_, &Node::is_switch); }

class JumpSearch {
 public:
  using Id = Piecewise::Id;
  explicit JumpSearch(const Piecewise& formula);
  std::optional<Id> run();

 private:
  /// All nodes at a point of a line, and on which side each switch is.
  struct Look {
    std::vector<double> values, sides;
    double result() const { return values.back(); }
  };

  void choose_line(bool positive, bool one_moves);
  double start_of(const Piecewise::Symbol& symbol, bool positive);
  double spread() { return std::pow(10.0, exponent_(random_)); }
  Look look(double s) const;
  void evaluate(const Piecewise::Node& node, Id id, double s, Look& look) const;
  std::optional<Id> search_line();
  std::optional<Id> search_between(double from, const Look& at_from, double to, const Look& at_to);
  bool is_open(const Look& one, const Look& other) const;
  std::optional<Id> judge(double before, double behind);
  std::vector<bool> needed(const Look& look) const;
  bool is_defined(const Look& look, const std::vector<bool>& needed) const;
  bool is_possible(double s) const;

  const Piecewise& formula_;
  std::vector<Id> switches_, comparisons_;  // comparisons: of what moves, in conditions
  std::vector<int> judged_;                 // how often each switch was, and each comparison looked at
  std::vector<double> hints_;
  std::vector<double> base_, direction_;  // of the symbols, along the line
  bool one_moves_ = false;
  double typical_ = 0;  // size of the formula along the line
  std::mt19937_64 random_{20240229};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> part_of_one_, exponent_{-1.5, 1.5};
};

namespace {

constexpr int most_lines = 64;
constexpr int enough = 12;         // judgements of a switch
constexpr int most_in_a_gap = 16;  // changes between two looks
constexpr int bisections = 100;

/// 0 and to both sides from 1e-3 to 1e6, in order.
std::vector<double> places() {
  std::vector<double> result;
  for (int k = 18; k >= -9; --k) result.push_back(-std::pow(10.0, k / 3.0));
  result.push_back(0);
  for (int k = -9; k <= 18; ++k) result.push_back(std::pow(10.0, k / 3.0));
  return result;
}

}  // namespace

JumpSearch::JumpSearch(const Piecewise& formula) : formula_(formula) {
  for (Id id = 0; id < formula.nodes_.size(); ++id) {
    const Piecewise::Node& node = formula.nodes_[id];
    if (node.is_switch) switches_.push_back(id);
    if (node.kind == Piecewise::Kind::binary && node.moves && is_comparison(node.op)) comparisons_.push_back(id);
    if (node.kind == Piecewise::Kind::number) hints_.push_back(node.value);
  }
  for (const Piecewise::Symbol& symbol : formula.symbols_) {
    if (symbol.value) hints_.push_back(*symbol.value);
  }
  judged_.assign(formula.nodes_.size(), 0);
}

/// Near the numbers of the formula, as thresholds are among them, or anywhere.
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

/// Which nodes the result hangs on there: of a choice one branch.
std::vector<bool> JumpSearch::needed(const Look& look) const {
  std::vector<bool> result(formula_.nodes_.size(), false);
  result.back() = true;
  for (Id id = formula_.nodes_.size(); id-- > 0;) {
    const Piecewise::Node& node = formula_.nodes_[id];
    if (!result[id]) continue;
    switch (node.kind) {
      case Piecewise::Kind::number:
      case Piecewise::Kind::symbol: break;
      case Piecewise::Kind::negate: result[node.a] = true; break;
      case Piecewise::Kind::binary:
      case Piecewise::Kind::call: result[node.a] = result[node.b] = true; break;
      case Piecewise::Kind::choice: result[node.a] = result[look.values[node.a] != 0 ? node.b : node.c] = true; break;
    }
  }
  return result;
}

/// Whether all that moves is where it may be.
bool JumpSearch::is_possible(double s) const {
  for (std::size_t i = 0; i < formula_.symbols_.size(); ++i) {
    const Piecewise::Symbol& symbol = formula_.symbols_[i];
    const double value = base_[i] + s * direction_[i];
    const bool is_free = !symbol.moves || (symbol.may_leave && one_moves_);
    if (!is_free && !(value >= symbol.low.value_or(value) && value <= symbol.high.value_or(value))) return false;
  }
  return true;
}

/// Whether nothing that the result hangs on is nan there. min and max of nan and a number are that number, but where a
/// root in them ceases to be real is the end of the formula's domain and no switch.
bool JumpSearch::is_defined(const Look& look, const std::vector<bool>& needed) const {
  for (Id id = 0; id < formula_.nodes_.size(); ++id) {
    if (needed[id] && std::isnan(look.values[id])) return false;
  }
  return true;
}

/// Whether a switch that was not judged often enough is on another side, or one of the comparisons of a condition, as
/// a window that two of them bound lies between places that are both outside.
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

/// Between the places no number lies, or next to none, and a switch is on another side.
std::optional<Piecewise::Id> JumpSearch::judge(double before, double behind) {
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
  const double jump = std::abs(high.result() - low.result());
  const double near = std::abs(look(behind + apart).result() - look(before - apart).result());
  const double beside = std::max(std::abs(low.result() - look(before - 2 * gap).result()),
                                 std::abs(high.result() - look(behind + 2 * gap).result()));
  if (!std::isfinite(jump)) return std::nullopt;
  ++judged_[*changed];
  const double size = std::max({std::abs(low.result()), std::abs(high.result()), typical_});
  const bool is_visible = jump > smallest_jump * size && !(jump <= 10 * beside);
  return is_visible && !(jump <= most_left_of_continuous * near) ? changed : std::nullopt;
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
  const std::size_t middle = at.size() / 2;  // the nearest gaps first: far away all is large
  for (std::size_t k = 0; k < middle; ++k) {
    for (const std::size_t i : {middle + k, middle - 1 - k}) {
      if (const std::optional<Id> jump = search_between(at[i], looks[i], at[i + 1], looks[i + 1])) return jump;
    }
  }
  return std::nullopt;
}

std::optional<Piecewise::Id> JumpSearch::run() {
  if (switches_.empty()) return std::nullopt;
  for (int line = 0; line < most_lines; ++line) {
    choose_line(line % 2 == 1, line % 4 >= 2);
    if (const std::optional<Id> jump = search_line()) return jump;
    if (std::ranges::all_of(switches_, [&](Id id) { return judged_[id] >= enough; })) break;
  }
  return std::nullopt;
}

std::optional<Piecewise::Id> find_jump(const Piecewise& formula) { return JumpSearch(formula).run(); }

}  // namespace dpde
