// SPDX-License-Identifier: Apache-2.0
// Formulas of a problem as functions of independent symbols (support/maths/piecewise.h), to see where they jump.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/analyse/switches.h"
#include "support/maths/piecewise.h"

namespace dpde::model {

/// Fields that no name of the problem is, as an operator's parameters: whether they move, and what they are in terms of
/// the problem, where that is known.
struct LocalField {
  bool moves = false;
  std::optional<Expr> value = {};
};
using LocalFields = std::map<std::string, LocalField>;

/// nullopt where it is made of what is not known.
std::optional<Expr> in_terms_of_problem(const Expr& e, const LocalFields& scope);
/// What a switch hangs on: a condition, or what sign, floor and fraction are of.
const Expr* operand_of_switch(const Expr& e);
/// What is 0 where there is a pole: a divisor, what a power is of, or stands in a logarithm or a tangent.
const Expr* operand_of_pole(const Expr& e);
const Expr* operand_of_jump(const Expr& e);
/// In the bodies of operators, too. What is divided by a number has no pole.
bool may_jump(const Expr& e);

/// A formula as one of independent symbols. What is no arithmetic, as a derivative, is a symbol, and what stands inside
/// is a formula of its own.
class FormulaSymbols {
 public:
  struct Inner {
    Expr value;
    LocalFields scope;
    std::string within;
  };

  FormulaSymbols(const Problem& problem, const Movement& movement, Inner whole)
      : problem_(problem), movement_(movement), scope_(std::move(whole.scope)), within_(std::move(whole.within)) {
    convert(whole.value);
  }

  const Piecewise& formula() const { return formula_; }
  const Expr& source_of(Piecewise::Id id) const { return sources_.at(id); }
  void trust(Piecewise::Id id) { formula_.trust(id); }
  const std::vector<Inner>& inner() const { return inner_; }

 private:
  using Id = Piecewise::Id;
  using Offset = std::vector<int>;
  void convert(const Expr& e) { convert(e, Offset(problem_.axes.size(), 0)); }
  Id convert(const Expr& e, const Offset& offset);
  Id convert_new(const Expr& e, const Offset& offset);
  Id symbol(const Expr& e, const Offset& offset, const Piecewise::Symbol& symbol);
  Id param(const Expr& e, const std::string& name);
  Id field(const Expr& e, const std::string& name, const Offset& offset);
  Id coordinate(const Expr& e, int axis, const Offset& offset);
  Id opaque(const Expr& e, const Offset& offset, const LocalFields& inside);
  Id shifted(const Shift& shift, Offset offset);
  bool moves(const Expr& e) const;
  bool moves(const std::string& name) const;

  const Problem& problem_;
  const Movement& movement_;
  LocalFields scope_;
  std::string within_;
  Piecewise formula_;
  std::map<std::pair<const Node*, Offset>, Id> known_;
  std::map<Id, Expr> sources_;
  std::vector<std::pair<std::pair<Expr, Offset>, Id>> symbols_;
  std::vector<Inner> inner_;
};

}  // namespace dpde::model
