// SPDX-License-Identifier: Apache-2.0
// Formulas with choices in them, and whether their values jump where a choice switches. A kink (both branches have the
// same value there, as in if(u > 0, u, 0)) is no jump.
//
// Symbols are independent of one another. Some of them move, and a choice that hangs on these is a switch. Along random
// lines through the values of all that moves, the places where a switch changes sides are bisected down to
// neighbouring numbers, and the values of the whole formula on both sides are compared. So v*if(v > 0, a, b) does not
// jump though its branches do not meet.
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
  /// them where nothing else moves.
  struct Symbol {
    bool moves = false;
    std::optional<double> value = {};
    std::optional<double> low = {}, high = {};
    bool may_leave = false;
  };

  Id number(double value);
  Id symbol(const Symbol& symbol);
  Id negate(Id operand);
  Id binary(BinaryOp op, Id left, Id right);
  /// `right` is that of min and max.
  Id call(Fn fn, Id left, std::optional<Id> right = {});
  /// if(condition, yes, no)
  Id choice(Id condition, Id yes, Id no);

  /// It is known not to jump: no switch.
  void trust(Id id) { nodes_[id].is_switch = false; }

  /// Whether a choice, sign, floor or fraction hangs on what moves.
  bool has_switch() const;

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
    bool is_switch = false;
  };
  Id add(Node node);

  std::vector<Node> nodes_;  // operands stand before what is made of them
  std::vector<Symbol> symbols_;
};

/// A switch of `formula` at which the value of its last node jumps. Deterministic.
std::optional<Piecewise::Id> find_jump(const Piecewise& formula);

}  // namespace dpde
