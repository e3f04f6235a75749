// SPDX-License-Identifier: Apache-2.0
// Formulas with choices and quotients in them, and whether their values jump where a choice switches or a divisor is 0.
// A kink (both branches have the same value there, as in if(u > 0, u, 0)) is no jump.
//
// Symbols are independent of one another. Some of them move, and a choice that hangs on these is a switch. Along random
// lines through the values of all that moves, the places where a switch changes sides are bisected down to
// neighbouring numbers, and the values of the whole formula on both sides are compared. So v*if(v > 0, a, b) does not
// jump though its branches do not meet. Places where a divisor is 0 are found in the same way, those too that it only
// touches, as z/sqrt(z^2) does: what is made of continuous functions jumps nowhere else.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "support/vocabulary.h"

namespace dpde {

class Piecewise {
 public:
  using Id = std::size_t;

  /// What is not known has any value, or one between `low` and `high`. What moves stays there, unless it `may_leave`
  /// them where nothing else moves. With a `sign` it keeps that where something is divided by it, as a length or a
  /// temperature does, for which formulas are written; at a kink it does not, since abs(u)/u is made to switch. An
  /// unknown sign, as of values from a file, is one for which formulas are written, too.
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
  /// `right` is that of min and max.
  Id call(Fn fn, Id left, std::optional<Id> right = {});
  /// if(condition, yes, no)
  Id choice(Id condition, Id yes, Id no);

  /// It is known not to jump.
  void trust(Id id) { nodes_[id].is_switch = nodes_[id].is_pole = false; }

 private:
  friend class JumpSearch;
  enum class Kind { number, symbol, negate, binary, call, choice };
  struct Node {
    Kind kind;
    double value = 0;  // of a number
    Id symbol = 0;     // its place among all
    BinaryOp op = BinaryOp::add;
    Fn fn = Fn::sin;
    Id a = 0, b = 0, c = 0;  // operands; of a choice condition, yes and no
    bool moves = false;
    bool is_switch = false;  // a choice, sign, floor or fraction that hangs on what moves
    bool is_pole = false;    // a quotient, power, logarithm or tangent that may have one where something moves
  };
  Id add(Node node);
  bool is_positive(Id id) const;

  std::vector<Node> nodes_;  // operands stand before what is made of them
  std::vector<Symbol> symbols_;
};

/// A switch of `formula`, or a node with a pole, at which the value of its last node jumps. Deterministic.
std::optional<Piecewise::Id> find_jump(const Piecewise& formula);

/// Whether the last node, a quotient, divides by what is 0 somewhere and has one sign around that, as 1 - cos(z) does.
bool touches_zero(const Piecewise& reciprocal);

/// 1 or -1 where the last node has that sign wherever its symbols may be, as far as random values tell; 0 where it has
/// both or is 0, and nothing where a symbol is not known.
std::optional<double> find_sign(const Piecewise& formula);

}  // namespace dpde
