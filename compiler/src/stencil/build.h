// SPDX-License-Identifier: Apache-2.0
// Smart constructors with the identities that never change a finite value's meaning (x*1, x+0, 0*x, --x, folding of
// numbers), and the traversals every pass shares.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

Expr param(std::string name);
Expr local(std::string name);
Expr access(std::string field, Offset offset = {});
Expr inside(Offset offset, int grow);
Expr interp(Interp value);
Expr operator-(const Expr& a);
Expr operator+(const Expr& a, const Expr& b);
Expr operator-(const Expr& a, const Expr& b);
Expr operator*(const Expr& a, const Expr& b);
Expr operator/(const Expr& a, const Expr& b);
Expr power(const Expr& base, const Expr& exponent);
Expr binary(BinaryOp op, const Expr& a, const Expr& b);  // any operator, through the constructors above
Expr call(Fn fn, std::vector<Expr> arguments);
Expr select(const Expr& condition, const Expr& yes, const Expr& no);

bool is_literal(const Expr& e);
bool is_literal(const Expr& e, double value);
/// Whether the value of `e` is 0 or 1 by construction.
bool is_truth(const Expr& e);

/// The fields of coordinates, see stencil.h.
bool is_coordinate(const std::string& field);

/// Rebuilds `e` with `f` applied to each direct child (leaves come back unchanged), through the constructors above.
Expr map_children(const Expr& e, const std::function<Expr(const Expr&)>& f);
/// Calls `f` on each direct child.
void for_each_child(const Expr& e, const std::function<void(const Expr&)>& f);
/// Calls `f` on `e` and everything below it, parents first.
void visit(const Expr& e, const std::function<void(const Expr&)>& f);

/// How many cells beyond bounded axes `i` reads or adds to: its position is clamped, whatever its offset.
int reach_of(const Interp& i, const std::vector<Topology>& axes);
/// `e` evaluated at the point displaced by `k`: every Access, Interp and Inside moves by k. Locals are renamed by
/// `rename` (they stand for values at a point, so a shifted use needs a shifted let).
Expr shift(const Expr& e, Offset k, const std::function<std::string(const std::string&)>& rename);
Expr substitute_params(const Expr& e, const std::map<std::string, Expr>& values);
Expr rename_fields(const Expr& e, const std::function<std::string(const std::string&)>& rename);

/// What a kernel touches, in order of first appearance.
struct Signature {
  struct Read {
    std::string field;
    std::array<int, max_rank> halo{};  // largest |offset| an axis; interp counts as 1
    bool interpolated = false;
  };
  std::vector<Read> reads;           // fields read (accumulated ones are not, unless read elsewhere)
  std::vector<std::string> writes;   // fields stored with `=`
  std::vector<std::string> updates;  // fields stored with `+=` or scattered to
  std::vector<std::string> params;
  std::vector<std::string> sums;
  const Read* find_read(const std::string& field) const;
};
Signature signature(const Kernel& kernel);

/// Fields a program needs from outside, and everything it writes, in order of first appearance.
struct Interface {
  std::vector<std::string> inputs;  // read before written
  std::vector<std::string> written;
  std::vector<std::string> params;  // of kernels and of boundary values
  std::vector<std::string> sums;
  std::vector<std::string> networks = {};  // that it applies
};
Interface interface_of(const Module& module, const Program& program);

/// What the rule of a side is given: a and b, each over the spacing where `per_spacing`.
struct SideCoefficient {
  Expr value;
  bool per_spacing = false;
};
std::array<SideCoefficient, side_coefficients> coefficients_of(const Side& side);
const GhostRule& rule_of(const Side& side);
/// Whether points on the wall are made from those inside.
bool derives_wall(const Side& side, int cells);

/// The field that holds the values of a side; nullptr where they are the same along the wall.
const std::string* wall_field(const Side& side);
/// Whether the field's values lie on the walls of a bounded axis, the last one on the high wall.
bool is_on_walls(const AxisBoundary& axis);
bool is_on_walls(const std::vector<AxisBoundary>& axes);
std::set<std::string> wall_fields(const std::vector<AxisBoundary>& axes);
void for_each_side(const std::vector<AxisBoundary>& axes, const std::function<void(const Side&)>& f);
/// Everything a boundary is made of: its expressions, and the spacings along axes where the rows of a side need it.
void for_each_side_value(const std::vector<AxisBoundary>& axes, const std::function<void(const Expr&)>& f);
/// The boundary with `f` applied to the expressions of its sides.
std::vector<AxisBoundary> map_sides(std::vector<AxisBoundary> axes, const std::function<Expr(const Expr&)>& f);

/// Halo each field of the program needs, an axis: reads at offsets plus the grown regions of the runs.
std::map<std::string, std::array<int, max_rank>> required_halo(const Module& module, const Program& program);

/// Adds the kernel, under a name of its own where another one has its name; returns that.
std::string add_kernel(Module& module, Kernel kernel);

/// Applies `f` to every expression of a kernel.
Kernel map_kernel(const Kernel& kernel, const std::function<Expr(const Expr&)>& f);

}  // namespace dpde::stencil
