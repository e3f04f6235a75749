// SPDX-License-Identifier: Apache-2.0
// Units of formulas, from their text, and checks of their terms. A formula has a known unit, or it consists of numbers
// only, or nothing is known because it contains a name without a declared unit.
//
// An unknown unit fits everything. A number fits every sum. As a factor it is a pure number, so 0.5*rho*v^2 has the
// unit of rho*v^2. If the other factors are pure numbers it may carry the unit of its term, as the height in
// 0.1*exp(-(x/L)^2). 0 has any unit.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "model/from_ast/elaboration.h"
#include "support/names/units.h"

namespace dpde::model {

struct Measure {
  enum class Kind { unknown, number, unit } kind = Kind::unknown;
  Unit unit = {};
  bool is_known() const { return kind == Kind::unit; }
  bool operator==(const Measure& other) const {
    return kind == other.kind && (!is_known() || unit.is_same_as(other.unit));
  }
};
Measure measure_of(Unit unit);
Measure product(const Measure& a, const Measure& b);
Measure power(const Measure& base, Fraction exponent);
Measure quotient(const Measure& a, const Measure& b);

/// One for each component of a vector or tensor, or one for all.
using MeasureList = std::vector<Measure>;

/// Units of positions and lengths along the axes of the scene; in curvilinear coordinates they may differ.
struct MeasuredAxes {
  MeasureList coordinates, lengths;
  Measure around = {Measure::Kind::number};  // length of the way around an axis of symmetry
  Measure time;
  bool are_alike() const;  // of the lengths
  Measure volume() const;
};

class Measures {
 public:
  explicit Measures(Elaboration& elaboration) : elaboration_(elaboration) {}

  /// Sets the unit of a field, coefficient, parameter or observable (a vector as a whole), or of a datum.
  void tell(const std::string& name, const Measure& measure) { names_[name] = measure; }
  bool knows(const std::string& name) const { return names_.contains(name); }
  /// A component has its vector's unit; unknown if not declared.
  Measure of_name(const std::string& name) const;
  /// Adds a let; its formula is read at its first use.
  void add_let(const ast::LetItem& let) { lets_.emplace(let.name.name, &let); }
  void set_axes(MeasuredAxes axes) { axes_ = std::move(axes); }
  const MeasuredAxes& axes() const { return axes_; }

  /// The unit of a formula; reports terms that do not fit one another.
  MeasureList of(const ast::Expr& e);
  /// The unit of a number, or of a formula with equal components.
  Measure one(const ast::Expr& e);
  /// Reports each term that does not fit `wanted`, called `what`.
  void fit(const ast::Expr& e, const MeasureList& wanted, const std::string& what);
  void fit(const ast::Expr& e, const Measure& wanted, const std::string& what) { fit(e, MeasureList{wanted}, what); }
  /// False after a diagnostic at `range`.
  bool fits(const Measure& found, const Measure& wanted, SourceRange range, const std::string& what);
  /// Of a let, with the unit declared in its line.
  MeasureList of_let(const std::string& name);
  /// Of a formula with `variables` of the units `ends`.
  Measure one_with(const ast::Expr& e, const std::vector<std::string>& variables, const MeasureList& ends);
  /// The common unit of terms; reports terms that do not fit. `what` is "" for a sum.
  MeasureList common(const std::vector<ast::Expr>& terms, const std::string& what);
  /// The common unit of the list; reports a different one at `range`.
  Measure alike(const MeasureList& list, SourceRange range);
  /// Of a formula that must be a pure number, as the argument of sin.
  Measure pure(const ast::Expr& e, const std::string& what);
  static MeasureList product_of(const MeasureList& a, const MeasureList& b, BinaryOp op);
  int axis_called(const std::string& name) const { return axis_of(elaboration_, name); }

 private:
  using Arguments = std::map<std::string, MeasureList>;

  MeasureList name(const std::string& name);
  MeasureList sum(const ast::Expr& e);
  MeasureList binary(const ast::Binary& e);
  MeasureList raised(const ast::Binary& e);
  MeasureList tuple(const ast::Tuple& e);
  MeasureList component(const ast::Expr& operand, const std::string& part);
  MeasureList call(const ast::Call& e, SourceRange range);
  MeasureList user_call(const ast::Function& function, const ast::Call& e);
  void note_call(Diagnostic& diagnostic) const;

  Elaboration& elaboration_;
  MeasuredAxes axes_;
  std::map<std::string, Measure> names_;
  std::map<std::string, const ast::LetItem*> lets_;
  std::map<std::string, MeasureList> read_lets_;
  std::set<std::string> open_lets_;
  std::vector<SourceRange> calls_;          // nested calls of functions
  const Arguments* arguments_ = nullptr;    // of the function whose body is being read
  std::set<std::pair<int, int>> reported_;  // positions: a function is read at each call
};

}  // namespace dpde::model
