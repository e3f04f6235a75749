// SPDX-License-Identifier: Apache-2.0
// Stencil level: programs of kernels with constant offsets. No derivatives are left, everything is explicit.
//
// Semantics
//  - A grid has 1 to 3 axes (x, y, z), each periodic or bounded, with n >= 1 cells; field values sit at cell centres.
//  - A kernel is one loop over a region: the interior, extended on each side of each *bounded* axis by `grow` cells.
//    All reads of a point see the fields as they were before the kernel ran; therefore a field that is stored
//    may be read in the same kernel only at offset 0, and only when its store accumulates (`+=`).
//  - Stores and sums of all points happen first, scatters after them. The interpreter adds in the order of the points;
//    back ends may add contributions of several points in another order, which is the same in each run.
//  - A program is a straight line of fills, folds, reductions, kernel runs and repeats. Every field is written by one
//    statement with `=` before any `+=` to it; inputs are the fields that are read before they are written.
//  - fill u: sets the halo of u from its interior, axis by axis (x, y, z). Each axis includes the halo of the axes
//    before it. Periodic axis: u[p] = u[p mod n]. On a bounded axis ghost cell -1-k (high side: n+k) is computed from
//    its mirror cell k (n-1-k). Ghost cells are filled from k = 0 outwards, so a mirror cell that is itself a ghost
//    cell is already filled: every n >= 1 and every width works. Let u be the value in the mirror cell, v in the ghost
//    cell, and s = (2k+1)*hx their distance. Then (u+v)/2 is the value at the wall and (v-u)/s the outward derivative.
//    value c: (u+v)/2 = c. zero_gradient: v = u. gradient c: (v-u)/s = c. mixed(a, b, c): a*(u+v)/2 + b*(v-u)/s = c.
//    c is constant along the wall, or a field that is read at the ghost cell -1-k itself (its index wraps along
//    periodic axes).
//    on_wall(condition), on both sides of an axis or on neither: the values lie on the upper faces of the cells, so
//    -1 and n-1 are on the walls. The fill sets both wall values, low after high. value c is set directly. The other
//    conditions use the wall value w for (u+v)/2 and the one-sided derivative (3w - 4u' + u'')/(2*hx) for (v-u)/s,
//    where u' and u'' lie one and two cells inside; for n = 2 the derivative is (w - u')/hx. For n = 1 no cell lies
//    inside: a high side that reads u' keeps its value, and then low takes (w - u')/hx with that value for u'. From
//    k = 1 outwards, low before high, the conditions above hold about the wall: -1-k from k-1, n-1+k from n-1-k,
//    s = 2k*hx. n-1 is the only interior point that a fill ever changes: such a field is filled before any read.
//    In a result of a program, n-1 has the value that its kernel stored, or that a later fill of the program or the
//    fill of the next step sets.
//    outflow, an on_wall condition of a high side only: n-1 is an ordinary value that no fill changes; beyond it and
//    between cells the condition acts as linear.
//    linear: linear extrapolation, v = (k+2)*u - (k+1)*u', u and u' the first two cells inside; v = u where n = 1.
//    On walls w = 2u' - u'' (u' where n < 3), and beyond them v = (k+1)*w - k*u'.
//    gradient_at_cell(c): mirrored about the centre of the first cell, -1-k from k+1 and n+k from n-2-k, (v-u)/s = c
//    with s = (2k+2)*hx. Where n = 1, and on walls, it is gradient(c).
//    pole: the value half a turn away, v = u; opposite_pole, for vector components: v = -u. -1-k from k and n+k from
//    n-1-k, with the mirror cell shifted by n'/2 cells (rounded down) along the other one of x and y, which is periodic
//    and has n' cells.
//    So each ghost value is weight*u + second_weight*u' + rate*c, with u' one cell farther inside than its mirror value
//    u. support/side_conditions.h lists these coefficients, for this level, its derivatives and all back ends. The
//    author of a program states a HaloRule for each field; a pass puts fills where reads need them and removes the
//    rules. So a field has one rule in a program, and a block has rules of its own.
//  - fold u grow g: the transpose of the linear part of a fill of g halo cells on each side of bounded axes (periodic
//    axes are not touched: their transposes are fills of the seeds). Axes are taken in reverse. Each of those halo
//    values, times its weight, is added to the cell it was filled from and then set to 0. If c is a field, the halo
//    value times the weight of c is first added to that field at the same point. On walls this includes n-1, and the
//    g+1 layers of the high side up to n-1+g. Along the other axes a fold covers the interior extended by g (bounded
//    axes not yet folded) or the interior (axes already folded).
//  - reduce m = mean u over y: m at each interior cell is the mean of u over the interior cells along y through it, so
//    m is constant along y; sum, max and min likewise. Without named axes the reduction covers all axes. Sums are
//    added in f64. A NaN makes the result NaN. m is a field like any other: a fill sets its halo.
//  - apply N(a, b) to c, d: the outputs of the network N for these fields, in the interior cells; beyond them the
//    network's padding applies. tangent N(a, b) by a_dot, b_dot to c_dot, d_dot: the tangents of the outputs.
//    adjoint N(a, b) by c_bar, d_bar to a_bar, b_bar: the transpose of that. A tangent or seed _ is 0, a result _ is
//    not computed. With `weights` the tangent includes the tangents of the weights, and the adjoint adds to their
//    gradient. second N(a, b) by a_dot, b_dot, c_bar, d_bar to a_bar, b_bar, a_dot_bar, b_dot_bar: the adjoint of
//    that tangent, where c_bar and d_bar are seeds of c_dot and d_dot; `weights` acts as in both. It has no derivative.
//    Weights of networks are inputs of the run.
//  - transform u by m to v: each wave exp(i k.x) of u in the interior is multiplied by its value of m. ikx, iky and
//    ikz in m stand for i times the wave numbers. m is a polynomial of them, or phiN(p)*q or inverseN(p)*q with two
//    polynomials: phi0(z) = exp(z), phiN(z) = (phiM(z) - 1/M!)/z with M = N-1; inverseN(z) = z^-N, and 0 where z is 0.
//    Axes whose wave numbers occur in m are periodic, and the transform runs along these axes only. A wave of two
//    cells stands for both k and -k: m is then the mean of both, so that v is real. ikx0, iky0 and ikz0 are ikx, iky
//    and ikz, but 0 for waves of two cells along their axis. `within two_thirds`: 0 for waves of three cells or fewer
//    along any axis; all axes are then periodic. Several terms are added.
//  - solve y = b for x { block }: the block, a program of its own, computes y from x and is linear in x: y = Ax over
//    the interior cells. The solve sets x, in the interior only, to the least-squares solution (least |Ax - b|) of
//    smallest norm. So if A maps every constant to 0 and each Ax sums to 0, the mean of b is ignored and x has mean 0.
//    The block sees only the interior of outside fields; fields that it writes are visible only in the block. `by`
//    names a method, `tolerance` is the largest |Ax - b|/|b| of an iterative method, `iterations` the number of steps
//    after which the solve is an error or, with `or warn`, a warning (the interpreter solves exactly). A solve may
//    have several unknowns: solve y, w = b, c for x, v { ... }: A computes y and w from x and v.
//    `preconditioner N(r, k) to d` replaces the inverse of A in an iterative method: r is the residual divided by its
//    root mean square, and d is the direction of the next iteration. It does not change the solution.
//  - newton y, w = b, c for x, v { block }: the same for a nonlinear block, y, w = F(x, v). It sets x, v to the
//    solution to which Newton's method converges from b, c; `tolerance` is the last change of a field relative to the
//    field.
//  - repeat n { block } to a, b: runs the block n times, each time as a program of its own: a pass sees only the
//    interior of outside fields, and fields that it writes are visible only in the pass. With `swap u, v` the v of a
//    pass is the u of the next one, and the v of the last pass is a (of the second swap b). The block writes v, which
//    occurs in one swap; it does not write u, which keeps its value outside. After the repeat, the halo (and the values
//    on walls) of an outside field that the repeat fills is undefined: before the repeat it is not read without a
//    fill, and afterwards it is neither read nor a result. Sums accumulate over all passes, and t is that of the
//    program. save u in s: pushes the u of each pass onto the stack s, with its value at the start of the pass or, if
//    the block writes u without a swap, at the end. load u from s, in a later repeat of as many passes: each pass
//    begins with the u that was saved last and not loaded yet. Stacks are not fields: one repeat saves, one loads.
//    repeat k in 0 .. n: k, the number of the pass, is a parameter in the block and in its boundary values; n .. 0
//    counts down, from n-1 to 0. Nothing else in the program has that name.
//  - inside[k] grow g: true where the point displaced by k lies in the interior extended by g on bounded axes; always
//    true along periodic axes. A Select reads only the branch it takes (the other may be NaN or garbage).
//  - interp(u, d): interpolation of u at the point displaced by `offset` and then d (in cells, one value per axis).
//    The position lies f = d - floor(d) beyond cell j. Along a periodic axis the cell index wraps; along a bounded axis
//    the position is clamped to [-1/2, n-1/2] (j = -1 or n-1, f = 1/2). along[a] is the basis along axis a:
//    linear: (1-f) u[j] + f u[j+1]. lower: u[j]. upper: u[j+1]. cubic: Lagrange's polynomial through u[j-1] to u[j+2],
//    with the weights -f(1-f)(2-f)/6, (1+f)(1-f)(2-f)/2, f(1+f)(2-f)/2, -f(1-f)(1+f)/6. slope: the derivative of linear
//    by d; cubic_slope, cubic_bend, cubic_third: the first to third derivatives of cubic (from the right where d is an
//    integer; 0 where the position was clamped). Cubics read two halo cells at most, the others one.
//  - sums: name += value, added over all points of the region; they start at 0 when the program starts.
//  - Parameters hx, hy, hz (spacing), dt, t (time at the start of the step) and cells (number of cells of the
//    grid) are bound by the scene; the fields x, y, z are the cells' coordinates, halo included.
//  - Kinks: at a tie max(a,b) has the derivative of a and min(a,b) that of b (so their sum has that of a + b); abs has
//    derivative 0 at 0. Cells that share the max or min of a reduction have equal parts of the derivative.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "network/network.h"
#include "source/source_file.h"
#include "support/expression.h"
#include "support/side_conditions.h"
#include "support/vocabulary.h"
#include "support/wave_function.h"

namespace dpde::stencil {

constexpr int max_rank = 3;
using Offset = std::array<int, max_rank>;

struct Node;
using Expr = ExprOf<Node>;
using Neg = NegOf<Expr>;
using Binary = BinaryOf<Expr>;
using Call = CallOf<Expr>;
using Select = SelectOf<Expr>;

/// A scalar that is the same at all points.
struct Param {
  std::string name;
  bool operator==(const Param&) const = default;
};
/// A let of the same kernel.
struct Local {
  std::string name;
  bool operator==(const Local&) const = default;
};
/// field[i + offset]
struct Access {
  std::string field;
  Offset offset{};
  bool operator==(const Access&) const = default;
};
struct Interp {
  std::string field;
  Offset offset{};
  std::vector<Expr> displacement;  // one per axis
  std::array<InterpolationBasis, max_rank> along{};
  bool operator==(const Interp&) const = default;
};
struct Inside {
  Offset offset{};
  int grow = 0;
  bool operator==(const Inside&) const = default;
};

using Kind = std::variant<Literal, Param, Local, Access, Interp, Inside, Neg, Binary, Call, Select>;
struct Node {
  Kind kind;
  bool operator==(const Node&) const = default;
};
void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f);
void for_each_child(Node& node, FunctionRef<void(Expr&)> f);
Expr rebuilt(Node node);  // through the constructors of build.h

/// A named scalar at the current point: defined once, before use; the only form of sharing.
struct Let {
  std::string name;
  Expr value;
  bool operator==(const Let&) const = default;
};
/// field[i] = value, or field[i] += value
struct Store {
  std::string field;
  bool accumulate = false;
  Expr value;
  Origin origin;
  bool operator==(const Store&) const = default;
};
/// name += value over all points of the region
struct Sum {
  std::string name;
  Expr value;
  bool operator==(const Sum&) const = default;
};
/// Adds value to target.field with the weights with which `target` would read it.
struct Scatter {
  Interp target;
  Expr value;
  bool operator==(const Scatter&) const = default;
};

/// The user's formula for the adjoint of an input: x_bar of a field x at each point, or each point's contribution to
/// p_bar of a parameter p. Seeds are read as fields y_bar, one for each field y that the kernel stores. `value` is
/// linear in them: the transpose of the derivative for points with cells on all sides. The adjoint handles walls.
struct CustomAdjoint {
  std::string input;
  Expr value;
  Origin origin;
  bool operator==(const CustomAdjoint&) const = default;
};

/// Names that the user wrote, for messages, where programs rename kernels and fields. Always equal, as Origin is.
struct KernelOrigin {
  std::string kernel;                         // "": not renamed
  std::map<std::string, std::string> fields;  // by their names in the program
  SourceRange range;
  bool is_stored_part = false;  // part of the values of other kernels: see passes/displaced_values.h
  friend bool operator==(const KernelOrigin&, const KernelOrigin&) { return true; }
};

struct Kernel {
  std::string name;
  int rank = 1;
  std::vector<Let> lets;
  std::vector<Store> stores;
  std::vector<Sum> sums;
  std::vector<Scatter> scatters;
  std::vector<CustomAdjoint> custom_adjoints =
      {};  // replace the formulas that adjoint() would derive; they do not change the kernel itself
  KernelOrigin origin = {};
  bool operator==(const Kernel&) const = default;
};

/// One side of a bounded axis. `value` consists of params and numbers, or is one field at offset 0 (for a fold: the
/// field to which the transpose adds). `a` and `b` consist of params and numbers; those that the condition does not
/// use are 0. `on_wall`: the field's last value along the axis lies on the wall.
struct Side {
  SideKind kind = SideKind::value;
  Expr value = 0.0;
  Expr a = 0.0, b = 0.0;
  bool on_wall = false;
  bool operator==(const Side&) const = default;
};
struct AxisBoundary {
  Topology topology = Topology::periodic;
  Side low, high;  // ignored if periodic
  bool operator==(const AxisBoundary& other) const {
    return topology == other.topology && (topology == Topology::periodic || (low == other.low && high == other.high));
  }
};

/// The user's name of the field of a statement, for messages. Always equal, as Origin is.
struct Written {
  std::string field;  // "": not renamed
  SourceRange range;
  friend bool operator==(const Written&, const Written&) { return true; }
};

struct Fill {
  std::string field;
  std::vector<AxisBoundary> axes;  // rank entries
  Written written = {};
  bool operator==(const Fill&) const = default;
};
/// The reads of a field that need its fill.
enum class FillNeed {
  around,  // reads of neighbours along periodic axes; the program itself sets the values beyond walls
  beyond,  // all reads outside the interior
  reads,   // all reads: the fill also sets values on walls
  results  // all reads, and results of the program: only the fill sets the values on walls
};
/// Extension of a field beyond the interior, in a program or a block. The author of a program states one for each
/// field; passes/place_fills.h turns it into fills.
struct HaloRule {
  Fill fill;
  FillNeed need = FillNeed::beyond;
  bool operator==(const HaloRule&) const = default;
};
struct Fold {
  std::string field;
  int grow = 0;  // how many halo cells on each side of bounded axes are folded; the others are not touched
  std::vector<AxisBoundary> axes;
  Written written = {};
  bool operator==(const Fold&) const = default;
};
/// result = the mean, sum, ... of `field` along the axes `over`, at all interior cells.
struct Reduce {
  std::string result;
  Reduction kind = Reduction::mean;
  std::string field;
  std::array<bool, max_rank> over{};
  bool operator==(const Reduce&) const = default;
};
using network::NetworkCall;
/// Multiplier of a wave exp(i k.x): function(argument)*factor, or the factor alone. Argument and factor are polynomials
/// of ikx, iky, ikz, ikx0, iky0, ikz0, with params and numbers.
struct Multiplier {
  WaveFunction function = {};
  Expr argument = 0.0, factor = 1.0;
  bool within_two_thirds = false;
  bool operator==(const Multiplier&) const = default;
};
/// result = the sum over all terms of the field with its waves multiplied by the term's multiplier.
struct Transform {
  struct Term {
    std::string field;
    Multiplier by;
    bool operator==(const Term&) const = default;
  };
  std::vector<Term> terms;
  std::string result;
  bool operator==(const Transform&) const = default;
};
struct Run {
  std::string kernel;
  int grow = 0;
  bool operator==(const Run&) const = default;
};
struct Solve;
struct Repeat;
struct Statement;
/// Sets `unknowns` so that the block, applied to them, makes `images` equal to `rights`. All three have the same size.
struct Solve {
  std::vector<std::string> images, rights, unknowns;
  std::vector<Statement> body;
  SolveBy by = {};
  Written written = {};
  bool is_linear = true;
  /// The Newton step of a nonlinear solve, if known (adjoint/reverse/newton_steps.h): a linear solve that maps the
  /// residual of `rights` to the correction of the unknowns.
  std::vector<Statement> step;
  /// Fields: iterative methods start from their linear combination with the smallest residual. The solution changes
  /// only within the tolerance, so guesses have no derivative.
  std::vector<std::string> guesses = {};
  std::vector<HaloRule> halos = {};  // none where fills are placed
  /// For an iterative linear solve with one unknown: maps the residual of an iteration, its first input, to the
  /// direction of the next one. Residual and direction are local to the solve. It has no derivative either.
  std::optional<NetworkCall> preconditioner = {};
  bool operator==(const Solve& other) const;
};

/// After the program, or after a pass of a repeat, `state` takes the value of `next`.
struct Swap {
  std::string state, next;
  bool operator==(const Swap&) const = default;
};
/// A swap of a repeat; `result`: the `next` of the last pass.
struct LoopCarried {
  std::string state, next, result;
  bool operator==(const LoopCarried&) const = default;
};
/// A field whose values are pushed onto a stack in each pass, or popped from one.
struct TapeEntry {
  std::string field, stack;
  bool operator==(const TapeEntry&) const = default;
};
/// A parameter that is the number of the pass, from 0 upwards or, backwards, down to 0.
struct Counter {
  std::string name;  // "": no counter
  bool is_backwards = false;
  bool operator==(const Counter&) const = default;
};
struct Repeat {
  int count = 1;
  std::vector<Statement> body;
  std::vector<LoopCarried> carries;
  std::vector<TapeEntry> saves = {};
  std::vector<TapeEntry> loads = {};
  Counter counter = {};
  std::vector<HaloRule> halos = {};  // none where fills are placed
  bool operator==(const Repeat& other) const;
};
/// A class and not an alias, so that copies of all kinds are compiled once, in signature.cpp.
struct Statement : std::variant<Fill, Fold, Reduce, NetworkCall, Transform, Run, Solve, Repeat> {
  using variant::variant;
  Statement();
  Statement(const Statement& other);
  Statement(Statement&& other) noexcept;
  Statement& operator=(const Statement& other);
  Statement& operator=(Statement&& other) noexcept;
  ~Statement();
};

struct Program {
  std::string name;
  std::vector<Topology> axes;  // rank entries
  std::vector<Statement> body;
  std::vector<Swap> swaps;
  std::vector<std::string> keeps;    // results in addition to those of swaps and sums
  std::vector<HaloRule> halos = {};  // none where fills are placed
  bool operator==(const Program&) const = default;
};

inline bool Solve::operator==(const Solve& other) const {
  return images == other.images && rights == other.rights && unknowns == other.unknowns && body == other.body &&
         by == other.by && is_linear == other.is_linear && step == other.step && guesses == other.guesses &&
         halos == other.halos && preconditioner == other.preconditioner;
}
inline bool Repeat::operator==(const Repeat& other) const {
  return count == other.count && body == other.body && carries == other.carries && saves == other.saves &&
         loads == other.loads && counter == other.counter && halos == other.halos;
}

/// loop counter in from .. to { programs }; from > to runs backwards.
struct Loop {
  std::string counter = "n";
  int from = 0, to = 0;
  std::vector<std::string> programs;
  bool operator==(const Loop&) const = default;
};

struct Module {
  std::vector<Kernel> kernels;
  std::vector<Program> programs;
  std::vector<Loop> loops;
  std::vector<network::Network> networks = {};
  bool operator==(const Module&) const = default;

  const Kernel* find_kernel(const std::string& name) const;
  const Program* find_program(const std::string& name) const;
  const network::Network* find_network(const std::string& name) const;
};
/// Adds the networks that `module` does not have yet.
void add_networks(Module& module, const std::vector<network::Network>& networks);

}  // namespace dpde::stencil

extern template class dpde::ExprOf<dpde::stencil::Node>;
