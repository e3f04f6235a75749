// SPDX-License-Identifier: Apache-2.0
// Finds out whether a formula with choices and quotients jumps where a choice switches or a divisor is 0. A kink (both
// branches have the same value there, as in if(u > 0, u, 0)) is no jump.
//
// Symbols are independent of each other. Some of them vary; a choice that depends on these is a switch. Along random
// lines in the space of varying symbols, the points where a switch changes sides are bisected down to adjacent numbers,
// and the values of the whole formula on both sides are compared. So v*if(v > 0, a, b) does not jump, though its
// branches differ. Zeros of divisors are found likewise, also those without a sign change as in z/sqrt(z^2):
// combinations of continuous functions jump nowhere else.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "support/vocabulary.h"

namespace dpde {

class Piecewise {
 public:
  using Id = std::size_t;

  /// An unknown symbol has any value, or one between `low` and `high`. A varying symbol stays in this range, unless it
  /// `may_leave` it when no other symbol varies. With a `sign` it keeps that sign where it is a divisor, as a length or
  /// temperature does, since formulas are written for it. It does not at a kink, since abs(u)/u is meant to switch.
  /// Formulas are also written for an unknown sign, such as that of values from a file.
  struct Symbol {
    bool moves = false;
    std::optional<double> value = {};
    std::optional<double> low = {}, high = {};
    bool may_leave = false;
    std::optional<double> sign = {};
    bool has_unknown_sign = false;
  };

  Id number(double value);
  Id symbol(const Symbol& symbol);
  Id negate(Id operand);
  Id binary(BinaryOp op, Id left, Id right);
  /// `right`: second argument of min and max.
  Id call(Fn fn, Id left, std::optional<Id> right = {});
  /// if(condition, yes, no)
  Id choice(Id condition, Id yes, Id no);

  /// Marks the node as known not to jump.
  void trust(Id id) { nodes_[id].is_switch = nodes_[id].is_pole = false; }

 private:
  friend class JumpSearch;
  enum class Kind { number, symbol, negate, binary, call, choice };
  struct Node {
    Kind kind;
    double value = 0;  // of a number
    Id symbol = 0;     // index among all symbols
    BinaryOp op = BinaryOp::add;
    Fn fn = Fn::sin;
    Id a = 0, b = 0, c = 0;  // operands; for a choice condition, yes and no
    bool moves = false;
    bool is_switch = false;  // a choice, sign, floor or fraction that depends on varying symbols
    bool is_pole = false;    // a quotient, power, logarithm or tangent with a possible pole
  };
  Id add(Node node);
  bool is_positive(Id id) const;

  std::vector<Node> nodes_;  // operands precede their results
  std::vector<Symbol> symbols_;
};

/// A switch or pole of `formula` at which the value of its last node jumps; nullopt if none is found. Deterministic.
std::optional<Piecewise::Id> find_jump(const Piecewise& formula);

/// Whether the last node, a quotient, has a divisor with a zero but no sign change there, as 1 - cos(z).
bool touches_zero(const Piecewise& reciprocal);

/// 1 or -1 if the last node has that sign over the ranges of its symbols, as tested with random values; 0 if it has
/// both signs or is 0; nullopt if a symbol is unknown.
std::optional<double> find_sign(const Piecewise& formula);

}  // namespace dpde
