// SPDX-License-Identifier: Apache-2.0
// Units of the names and formulas of a scene. The elaboration notes the unit of each node of a formula next to its
// value, from those of its parts; terms of a sum are compared where the sum is used, with one another or with what the
// line wants. A formula has a known unit, or it consists of numbers only, or nothing is known because it contains a
// name without a declared unit.
//
// An unknown unit fits everything. A number fits every sum. As a factor it is a pure number, so 0.5*rho*v^2 has the
// unit of rho*v^2. If the other factors are pure numbers it may carry the unit of its term, as the height in
// 0.1*exp(-(x/L)^2). 0 has any unit.
#pragma once

#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "model/from_ast/names/names.h"
#include "source/diagnostic.h"
#include "support/names/units.h"
#include "syntax/ast.h"

namespace dpde::model {

struct Measure {
  enum class Kind { unknown, number, unit } kind = Kind::unknown;
  Unit unit = {};
  bool is_known() const { return kind == Kind::unit; }
  bool operator==(const Measure& other) const {
    return kind == other.kind && (!is_known() || unit.is_same_as(other.unit));
  }
};
inline Measure measure_of(Unit unit) { return {Measure::Kind::unit, std::move(unit)}; }

/// A literal number may carry a unit where it would otherwise be a pure number.
inline Measure product(const Measure& a, const Measure& b) {
  if (a.kind == Measure::Kind::unknown || b.kind == Measure::Kind::unknown) return {};
  if (a.is_known() && b.is_known()) return measure_of(a.unit.times(b.unit));
  const Measure& known = a.is_known() ? a : b;
  return known.is_known() && !known.unit.is_pure_number() ? known : Measure{Measure::Kind::number};
}
inline Measure power(const Measure& base, Fraction exponent) {
  return base.is_known() ? measure_of(base.unit.to(exponent)) : base;
}
inline Measure quotient(const Measure& a, const Measure& b) { return product(a, power(b, {-1, 1})); }

/// One for each component of a vector or tensor, or one for all.
using MeasureList = std::vector<Measure>;

/// Units of positions and lengths along the axes of the scene; in curvilinear coordinates they may differ.
struct MeasuredAxes {
  std::map<std::string, int> names;  // in addition to x, y and z
  MeasureList coordinates, lengths;
  Measure around = {Measure::Kind::number};  // length of the way around an axis of symmetry
  Measure time;
  bool are_alike() const;  // of the lengths
  Measure volume() const;
};

class Measures {
 public:
  /// Whether some line tells a unit: else all are unknown, and nothing is noted.
  bool are_told() const { return are_told_; }
  void be_told(bool are_told) { are_told_ = are_told; }

  /// Sets the unit of a field, coefficient, parameter or let (a vector as a whole), or of a datum.
  void tell(const std::string& name, const Measure& measure) { names_[name] = measure; }
  bool knows(const std::string& name) const { return names_.contains(name); }
  /// A component has its vector's unit; unknown if not declared.
  Measure of_name(const std::string& name) const;
  MeasureList of_symbol(const Symbol& meaning, const std::string& name) const;
  void set_axes(MeasuredAxes axes) { axes_ = std::move(axes); }
  const MeasuredAxes& axes() const { return axes_; }
  int axis_called(const std::string& name) const;
  /// Of one axis; unknown if there is none.
  Measure coordinate(int axis) const;

  /// The unit of `e` by those of its parts, which are noted before; of a name or a call it is given, of a sum empty.
  MeasureList note(const ast::Expr& e, MeasureList given);
  /// The unit of a let, with that declared in its line.
  MeasureList define(const std::string& name, const ast::Expr& formula);
  /// Of a let that was defined; of other names as declared.
  MeasureList of_let(const std::string& name) const;
  const std::map<std::string, MeasureList>& lets() const { return lets_; }
  /// Around the body of a function of the file: messages name the outermost call.
  void enter_call(SourceRange callee) { calls_.push_back(callee); }
  MeasureList leave_call(const ast::Expr& body);

  // Formulas that were elaborated; others are unknown.
  /// The unit of a formula; reports terms of a sum that do not fit one another.
  MeasureList of(const ast::Expr& e);
  /// The unit of a number, or of a formula with equal components.
  Measure one(const ast::Expr& e);
  /// Reports each term that does not fit `wanted`, called `what`.
  void fit(const ast::Expr& e, const MeasureList& wanted, const std::string& what);
  void fit(const ast::Expr& e, const Measure& wanted, const std::string& what) { fit(e, MeasureList{wanted}, what); }
  /// False after a diagnostic at `range`.
  bool fits(const Measure& found, const Measure& wanted, SourceRange range, const std::string& what);
  /// The common unit of terms; reports terms that do not fit. `what` is "" for a sum.
  MeasureList common(const std::vector<ast::Expr>& terms, const std::string& what);
  /// The common unit of the list; reports a different one at `range`.
  Measure alike(const MeasureList& list, SourceRange range);
  /// Of a formula that must be a pure number, as the argument of sin.
  Measure pure(const ast::Expr& e, const std::string& what);
  static MeasureList product_of(const MeasureList& a, const MeasureList& b, BinaryOp op);

  /// What does not fit: errors only if the problem has no others.
  const std::vector<Diagnostic>& misfits() const { return misfits_.all(); }

 private:
  MeasureList binary(const ast::Binary& e);
  MeasureList raised(const ast::Binary& e);
  void note_call(Diagnostic& diagnostic) const;

  bool are_told_ = false;
  MeasuredAxes axes_;
  std::map<std::string, Measure> names_;
  std::map<std::string, MeasureList> lets_;
  /// By node. The formula is held, so that no later one is at its address.
  std::unordered_map<const ast::Node*, std::pair<ast::Expr, MeasureList>> noted_;
  std::vector<SourceRange> calls_;          // nested calls of functions
  std::set<std::pair<int, int>> reported_;  // positions: a function is read at each call
  DiagnosticSink misfits_;
};

/// Of one component, S.xy or v.x, with the unit of its whole.
MeasureList unit_of_part(const MeasureList& whole, int axis);

}  // namespace dpde::model
