// SPDX-License-Identifier: Apache-2.0
// Formulas of a problem as functions of independent symbols (support/maths/piecewise.h), to find their jumps.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/analyse/switches.h"
#include "support/maths/piecewise.h"

namespace dpde::model {

/// A field that is not a name of the problem, as an operator's parameter: whether it changes, and its value in terms of
/// the problem, if known.
struct LocalField {
  bool moves = false;
  std::optional<Expr> value = {};
};
using LocalFields = std::map<std::string, LocalField>;

/// nullopt if it contains a local field of unknown value.
std::optional<Expr> in_terms_of_problem(const Expr& e, const LocalFields& scope);
/// Operand of a switch: the condition of an if, or the argument of sign, floor or fraction.
const Expr* operand_of_switch(const Expr& e);
/// Expression whose zeros are poles: a divisor, the base of a power, or the argument of a logarithm or tangent.
const Expr* operand_of_pole(const Expr& e);
const Expr* operand_of_jump(const Expr& e);
/// Also looks into bodies of operators. A division by a number has no pole.
bool may_jump(const Expr& e);

/// A formula in terms of independent symbols. A non-arithmetic part, as a derivative, becomes a symbol; its operand is
/// treated as a separate formula.
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
