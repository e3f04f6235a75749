// SPDX-License-Identifier: Apache-2.0
// What unit a formula has, read from its text, and whether its terms fit. Three things are known of a formula: its
// unit; that it is made of numbers alone; or nothing, where it holds a name of which no unit is told.
//
// What has no unit fits everything. A number fits every sum; as a factor it is a pure number, so that 0.5*rho*v^2 has
// the unit of rho*v^2. Where the other factors are pure numbers it may carry the unit of its term, as the height in
// 0.1*exp(-(x/L)^2). 0 has any unit.
#pragma once

#include <map>
#include <optional>
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

/// One of each component of a vector or tensor, or one for all of them.
using MeasureList = std::vector<Measure>;

/// Units of places and lengths along the axes of the scene; a unit of a coordinate may be longer than 1.
struct MeasuredAxes {
  MeasureList coordinates, lengths;
  Measure around = {Measure::Kind::number};  // the way around an axis of symmetry
  Measure time;
  bool are_alike() const;  // lengths
  Measure volume() const;
};

class Measures {
 public:
  explicit Measures(Elaboration& elaboration) : elaboration_(elaboration) {}

  /// A name of a field, coefficient, parameter or observable, of a vector as a whole; or of a datum.
  void tell(const std::string& name, const Measure& measure) { names_[name] = measure; }
  bool knows(const std::string& name) const { return names_.contains(name); }
  /// Of a component that of its vector; unknown of what was not told.
  Measure of_name(const std::string& name) const;
  /// A shorthand: its formula is read where it is first used.
  void add_let(const ast::LetItem& let) { lets_.emplace(let.name.name, &let); }
  void set_axes(MeasuredAxes axes) { axes_ = std::move(axes); }
  const MeasuredAxes& axes() const { return axes_; }

  /// Of a formula, whose terms fit one another or are reported.
  MeasureList of(const ast::Expr& e);
  /// Of one that is a number, or alike in all components.
  Measure one(const ast::Expr& e);
  /// Reports each term that does not fit what is called `what`.
  void fit(const ast::Expr& e, const MeasureList& wanted, const std::string& what);
  void fit(const ast::Expr& e, const Measure& wanted, const std::string& what) { fit(e, MeasureList{wanted}, what); }
  /// False after a diagnostic at `range`.
  bool fits(const Measure& found, const Measure& wanted, SourceRange range, const std::string& what);
  /// Of a let, with the unit that its line tells.
  MeasureList of_let(const std::string& name);
  /// Of a formula in which `variables` have the units `ends`.
  Measure one_with(const ast::Expr& e, const std::vector<std::string>& variables, const MeasureList& ends);
  /// Of terms that fit one another or are reported; "" for a sum.
  MeasureList common(const std::vector<ast::Expr>& terms, const std::string& what);
  /// The unit that all of the list have, or the odd one is reported at `range`.
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
  std::vector<SourceRange> calls_;          // of functions, inside one another
  const Arguments* arguments_ = nullptr;    // of the function of the file whose body is read
  std::set<std::pair<int, int>> reported_;  // places: a function is read where it is called
};

}  // namespace dpde::model
