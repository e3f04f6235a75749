// SPDX-License-Identifier: Apache-2.0
// Smart constructors that apply identities which keep every finite value (x*1, x+0, 0*x, --x, folding of numbers), and
// the traversals that all passes share.
#pragma once

#include <functional>
#include <map>
#include <optional>
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
Expr negate(const Expr& a);  // the same, as support/maths/derivatives.h calls it
Expr operator+(const Expr& a, const Expr& b);
Expr operator-(const Expr& a, const Expr& b);
Expr operator*(const Expr& a, const Expr& b);
Expr operator/(const Expr& a, const Expr& b);
Expr power(const Expr& base, const Expr& exponent);
Expr binary(BinaryOp op, const Expr& a, const Expr& b);  // any operator, through the constructors above
Expr call(Fn fn, std::vector<Expr> arguments);
Expr select(const Expr& condition, const Expr& yes, const Expr& no);

/// 1 - tanh(a)^2; see support/maths/derivatives.h.
Expr slope_of_tanh(const Expr& a);
/// Whether the value of `e` is 0 or 1 by construction.
bool is_truth(const Expr& e);

/// Whether `field` is one of the coordinate fields x, y, z of stencil.h.
bool is_coordinate(const std::string& field);

bool reads_param(const Expr& e, const std::string& name);

/// Number of cells beyond bounded axes that `i` reads or adds to. It does not depend on the offset, as the position is
/// clamped.
int reach_of(const Interp& i, const std::vector<Topology>& axes);
/// `e` evaluated at the point displaced by `k`: every Access, Interp and Inside moves by k. Locals are renamed by
/// `rename` (they stand for values at a point, so a shifted use needs a shifted let).
Expr shift(const Expr& e, Offset k, const std::function<std::string(const std::string&)>& rename);
Expr substitute_params(const Expr& e, const std::map<std::string, Expr>& values);
Expr rename_fields(const Expr& e, const std::function<std::string(const std::string&)>& rename);

/// All names that a kernel reads or writes, in order of first appearance.
struct Signature {
  struct Read {
    std::string field;
    std::array<int, max_rank> halo{};  // largest |offset| per axis; interp counts as 1
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

/// Fields that a program needs from outside, and all fields that it writes, in order of first appearance.
struct Interface {
  std::vector<std::string> inputs;  // read before written
  std::vector<std::string> written;
  std::vector<std::string> params;  // of kernels and of boundary values
  std::vector<std::string> sums;
  std::vector<std::string> networks = {};  // that it applies
};
Interface interface_of(const Module& module, const Program& program);

/// A coefficient a or b of the rule of a side, divided by the spacing if `per_spacing`.
struct SideCoefficient {
  Expr value;
  bool per_spacing = false;
};
std::array<SideCoefficient, side_coefficients> coefficients_of(const Side& side);
const GhostRule& rule_of(const Side& side);
/// Whether values on the wall are computed from values inside.
bool derives_wall(const Side& side, int cells);

/// The field with the values of a side; nullptr if the value is constant along the wall.
const std::string* wall_field(const Side& side);
/// Whether the field's values lie on the walls of a bounded axis, the last one on the high wall.
bool is_on_walls(const AxisBoundary& axis);
bool is_on_walls(const std::vector<AxisBoundary>& axes);
std::set<std::string> wall_fields(const std::vector<AxisBoundary>& axes);
void for_each_side(const std::vector<AxisBoundary>& axes, const std::function<void(const Side&)>& f);
/// Calls `f` on all expressions of a boundary, and on the spacing of each axis where a side's rule needs it.
void for_each_side_value(const std::vector<AxisBoundary>& axes, const std::function<void(const Expr&)>& f);
/// The boundary with `f` applied to the expressions of its sides.
std::vector<AxisBoundary> map_sides(std::vector<AxisBoundary> axes, const std::function<Expr(const Expr&)>& f);

/// Halo that each field of the program needs per axis: the offsets of reads plus `grow` of the run.
std::map<std::string, std::array<int, max_rank>> required_halo(const Module& module, const Program& program);

/// Adds the kernel and returns its name: a new name if a different kernel has the same one.
std::string add_kernel(Module& module, Kernel kernel);

}  // namespace dpde::stencil
