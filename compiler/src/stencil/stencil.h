// SPDX-License-Identifier: Apache-2.0
// Stencil level: programs of kernels with constant offsets. No derivatives are left, everything is explicit.
//
// Semantics
//  - A grid has 1 to 3 axes (x, y, z), each periodic or bounded, with n >= 1 cells; field values sit at cell centres.
//  - A kernel is one loop over a region: the interior, grown on each side of each *bounded* axis by `grow` cells.
//    All reads of a point see the fields as they were before the kernel ran; therefore a field that is stored
//    may be read in the same kernel only at offset 0, and only when its store accumulates (`+=`).
//  - Stores and sums of all points happen first, scatters after them. The interpreter adds in the order of the points;
//    back ends may add the shares of several points in an order of their own, which is the same in each run.
//  - A program is a straight line of fills, folds, reductions, kernel runs and repeats. Every field is written by one
//    statement with `=` before any `+=` to it; inputs are the fields that are read before they are written.
//  - fill u: sets the halo of u from its interior, axis by axis (x, y, z), each axis over the halo of those before.
//    periodic: u[p] = u[p mod n]. Bounded: the place -1-k (or n+k) from its mirror image k (or n-1-k), outwards from k
//    = 0, so that the image is set and any n >= 1 and any width is defined. With u, v at the image and the place and s
//    = (2k+1)*hx the way between them, (u+v)/2 is the value at the wall and (v-u)/s the derivative outwards: value c:
//    (u+v)/2 = c. zero_gradient: v = u. gradient c: (v-u)/s = c. mixed(a, b, c): a*(u+v)/2 + b*(v-u)/s = c. c is the
//    same along the wall, or a field that is read at the place -1-k itself, along periodic axes where the place wraps
//    to. on_wall(condition), at both sides of an axis or at none: the values lie on the upper faces of the cells, so
//    that -1 and n-1 are on the walls. The fill sets both, high before low: a value c as it is, the other conditions
//    with w at the wall for (u+v)/2 and the one-sided derivative (3w - 4u' + u'')/(2*hx) for (v-u)/s, u' and u'' one
//    and two cells inside; (w - u')/hx where n = 2. Where n = 1 nothing lies inside: a high side that reads u' keeps
//    what is there, and then low takes (w - u')/hx with that for u'. From k = 1 outwards, low before high, the
//    conditions are as above, about the wall: -1-k from k-1, n-1+k from n-1-k, s = 2k*hx. n-1 is the only interior
//    place a fill ever changes: such a field is filled before it is read anywhere. What a program leaves at n-1 of a
//    result is what its kernel stored there, or a fill behind it, or what the fill of the next step sets.
//    outflow, as on_wall at a high side alone: n-1 is a value of the field like others, which no fill changes; beyond
//    it and between cells it is as linear.
//    linear: the straight line goes on, v = (k+2)*u - (k+1)*u', u and u' the first two cells inside; v = u where n = 1.
//    On walls w = 2u' - u'' (u' where n < 3), and beyond them v = (k+1)*w - k*u'.
//    gradient_at_cell(c): about the centre of the first cell, -1-k from k+1 and n+k from n-2-k, (v-u)/s = c with s =
//    (2k+2)*hx. Where n = 1, and on walls, it is gradient(c).
//    pole: half a turn away, v = u; opposite_pole, of components of vectors: v = -u. -1-k from k and n+k from n-1-k,
//    the image n'/2 cells farther on (rounded down) along the other one of x and y, which is periodic and has n' cells.
//    So each place gets weight*u + farther*u' + rate*c, u' one cell farther inside than its image u. The rows of
//    support/side_conditions.h are these numbers, for this level, its derivatives and all back ends.
//    Who makes a program states how each field goes on (HaloRule); a pass puts fills where reads need them, and behind
//    it no rules are left. So one field goes on in one way in a program that was made, and a block has rules of its
//    own.
//  - fold u grow g: the transpose of the linear part of a fill of g halo cells on each side of bounded axes (periodic
//    axes are not touched: their transposes are fills of the seeds): axes in reverse, adds each of those halo values,
//    times its weight, onto the cell it was filled from and then sets that halo value to 0; where c is a field, it
//    first adds the halo value, times the weight of c, onto that field at the same place. On walls that holds for n-1
//    too, and for n-1+g with the high side's g+1 layers. Along the other axes it acts on the interior grown by g
//    likewise (axes not yet folded) or the interior (axes folded already).
//  - reduce m = mean u over y: m at each interior cell is the mean of u over the interior cells along y through it, so
//    that m is the same along y; sum, max and min likewise, over all axes where none are named. Sums are added up in
//    f64. A NaN makes the result NaN. m is a field like any other: its halo is what a fill makes of it.
//  - apply N(a, b) to c, d: the outputs of the network N for these fields, in the interior cells; what is around
//    them is the network's padding. tangent N(a, b) by a_dot, b_dot to c_dot, d_dot: the rates of the outputs.
//    adjoint N(a, b) by c_bar, d_bar to a_bar, b_bar: the transpose of that. A rate or seed _ is 0, a result _ is
//    not wanted. With `weights` the tangent takes the rates of the weights along, and the adjoint adds to their
//    gradient. second N(a, b) by a_dot, b_dot, c_bar, d_bar to a_bar, b_bar, a_dot_bar, b_dot_bar: the adjoint of
//    that tangent, where c_bar and d_bar are seeds of c_dot and d_dot; with `weights` as both. It has no derivative.
//    Weights of networks are given from outside.
//  - transform u by m to v: each wave exp(i k.x) of u in the interior is multiplied by m, a number of its own. ikx, iky
//    and ikz in m stand for i times the wave numbers; m is a polynomial of them, or phiN(p)*q or inverseN(p)*q with
//    two polynomials: phi0(z) = exp(z), phiN(z) = (phiM(z) - 1/M!)/z with M = N-1; inverseN(z) = z^-N, and 0 where z is
//    0. Axes whose wave numbers m has are periodic; waves go along these alone. Of a wave of two cells, which is that
//    of k and of -k, m is the mean over both, so that v is real. ikx0, iky0 and ikz0 are ikx, iky and ikz, but 0 for
//    waves of two cells along their axis. `within two_thirds`: 0 for waves of three cells or fewer along any axis, all
//    of which are then periodic. Several terms are added up.
//  - solve y = b for x { block }: the block, a program of its own, makes y of x and is linear in it: y = Ax over the
//    interior cells. Behind it x is what gives b: of all x for which |Ax - b| is least the smallest one, known in the
//    interior. So where A takes every constant to 0 and sums to 0, the mean of b is not looked at and x has none. The
//    block sees the interior of what it reads from outside; what it writes is known in it only. `by` names a method,
//    `tolerance` the largest |Ax - b|/|b| of one that comes near step by step, `iterations` after how many steps it is
//    an error or, with `or warn`, a warning (the interpreter solves exactly). There may be several of each,
//    solve y, w = b, c for x, v { ... }: A makes y and w of x and v. `preconditioner N(r, k) to d` is what a method by
//    steps has for the inverse of A: what an iteration leaves is r, over the root of its mean square, and d is the
//    direction of the next one. What it comes to is the same.
//  - newton y, w = b, c for x, v { block }: the same where the block is not linear, y, w = F(x, v). Behind it x, v is
//    the solution to which Newton's method comes that begins with b, c; `tolerance` is the last change of a field over
//    the field.
//  - repeat n { block } to a, b: the block n times, each time as a program of its own: of what it reads from outside
//    it sees the interior, and what it writes is known inside only. Behind `swap u, v` the v of a pass is the u of the
//    next one, and the v of the last pass is a (of the second swap b). The block writes v, which stands in one swap;
//    it does not write u, which outside keeps its value. Behind the repeat the halo of what it fills from outside is
//    anything, and so is what it fills on walls: before the repeat that is not read without a fill, and behind it
//    neither read nor a result. Sums go on through all passes, and t is that of the program. save u in s: the u of
//    each pass goes onto the stack s, as it begins with it or, where it writes u and swaps it with nothing, as it
//    leaves it. load u from s, in a later repeat of as many passes: each begins with the u that was saved last and not
//    loaded yet. Stacks are no fields: one repeat saves, one loads. repeat k in 0 .. n: in the block, boundary values
//    too, k is a parameter, the number of the pass; n .. 0 counts down, from n-1 to 0. Nothing else in the program has
//    that name.
//  - inside[k] grow g: true where the point displaced by k lies in the interior grown by g on bounded axes; always
//    true along periodic axes. A Select reads only the branch it takes (the other may be NaN or garbage).
//  - interp(u, d): interpolation of u at the point displaced by `offset` and then d (in cells, one value an axis). The
//    place lies f = d - floor(d) beyond the cell j; along a periodic axis the cell index wraps; along a bounded axis
//    the position is clamped to [-1/2, n-1/2] (j = -1 or n-1, f = 1/2). along[a] says what is taken along axis a:
//    linear: (1-f) u[j] + f u[j+1]. lower: u[j]. upper: u[j+1]. cubic: Lagrange's polynomial through u[j-1] to u[j+2],
//    with the weights -f(1-f)(2-f)/6, (1+f)(1-f)(2-f)/2, f(1+f)(2-f)/2, -f(1-f)(1+f)/6. slope: the derivative of linear
//    by d; cubic_slope, cubic_bend, cubic_third: those of cubic (the right-hand ones where d is an integer; 0 where the
//    position was clamped). Cubics read two halo cells at most, the others one.
//  - sums: name += value, added over all points of the region; they start at 0 when the program starts.
//  - Parameters hx, hy, hz (spacing), dt, t (time at the start of the step) and cells (number of cells of the
//    grid) are bound by the scene; the fields x, y, z are the cells' coordinates, halo included.
//  - Kinks: at a tie max(a,b) has the derivative of a and min(a,b) that of b (so their sum has that of a + b); abs has
//    derivative 0 at 0. Where several cells share the max or min of a reduction, each takes an equal part of the
//    derivative.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "network/network.h"
#include "source/source_file.h"
#include "support/side_conditions.h"
#include "support/vocabulary.h"
#include "support/wave_function.h"

namespace dpde::stencil {

constexpr int max_rank = 3;
using Offset = std::array<int, max_rank>;

struct Node;

/// Value handle of an immutable expression; never null. Equality is structural.
class Expr {
 public:
  Expr(double value);  // NOLINT: a number is an expression
  explicit Expr(Node node);
  const Node& node() const { return *node_; }
  const Node* operator->() const { return node_.get(); }
  bool operator==(const Expr& other) const;

 private:
  std::shared_ptr<const Node> node_;
};

struct Literal {
  double value;
  bool operator==(const Literal&) const = default;
};
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
  std::vector<Expr> displacement;  // one an axis
  std::array<InterpolationBasis, max_rank> along{};
  bool operator==(const Interp&) const = default;
};
struct Inside {
  Offset offset{};
  int grow = 0;
  bool operator==(const Inside&) const = default;
};
struct Neg {
  Expr operand;
  bool operator==(const Neg&) const = default;
};
struct Binary {
  BinaryOp op;
  Expr left, right;
  bool operator==(const Binary&) const = default;
};
struct Call {
  Fn fn;
  std::vector<Expr> arguments;
  bool operator==(const Call&) const = default;
};
/// if(condition, yes, no)
struct Select {
  Expr condition, yes, no;
  bool operator==(const Select&) const = default;
};

using Kind = std::variant<Literal, Param, Local, Access, Interp, Inside, Neg, Binary, Call, Select>;
struct Node {
  Kind kind;
  bool operator==(const Node&) const = default;
};

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

/// What a person gave as the adjoint of an input, a field or a parameter: x_bar of field x at each point, or what each
/// point adds to p_bar of parameter p. Seeds are read as fields y_bar, for each field y that the kernel stores. `value`
/// is linear in them, the transpose of the derivative where all points have cells around them; walls are the adjoint's
/// affair.
struct CustomAdjoint {
  std::string input;
  Expr value;
  Origin origin;
  bool operator==(const CustomAdjoint&) const = default;
};

/// What a person wrote, where programs give kernels and fields other names: for messages. Always equal, as Origin is.
struct KernelOrigin {
  std::string kernel;                         // "": as it is called
  std::map<std::string, std::string> fields;  // by what they are called here
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
      {};  // in place of what adjoint() would derive; no part of what the kernel does
  KernelOrigin origin = {};
  bool operator==(const Kernel&) const = default;
};

/// One side of a bounded axis. `value` is made of params and numbers, or is one field at offset 0 (for a fold: the
/// field that the transpose goes to). `a` and `b` are of params and numbers. Where the condition is not given one of
/// them it is 0. `on_wall`: of a field whose last value along the axis lies on the wall.
struct Side {
  SideKind kind = SideKind::value;
  Expr value = 0.0;
  Expr a = 0.0, b = 0.0;
  bool on_wall = false;
  bool operator==(const Side&) const = default;
};
struct AxisBoundary {
  Topology topology = Topology::periodic;
  Side low, high;  // not looked at when periodic
  bool operator==(const AxisBoundary& other) const {
    return topology == other.topology && (topology == Topology::periodic || (low == other.low && high == other.high));
  }
};

/// The field of a statement as a person wrote it, for messages. Always equal, as Origin is.
struct Written {
  std::string field;  // "": as it is called
  SourceRange range;
  friend bool operator==(const Written&, const Written&) { return true; }
};

struct Fill {
  std::string field;
  std::vector<AxisBoundary> axes;  // rank entries
  Written written = {};
  bool operator==(const Fill&) const = default;
};
/// Which reads of a field find what its fill leaves.
enum class FillNeed {
  around,  // those of neighbours along periodic axes; beyond walls the program knows the values itself
  beyond,  // all beyond the cells
  reads,   // all: the fill sets values on walls too
  results  // and so do results, as nothing else sets the values on walls
};
/// How a field goes on beyond the cells of a program, or of a block. A maker of programs states it, once for each
/// field; passes/place_fills.h makes fills of it.
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
/// result = the mean, sum, ... of `field` along the axes named, at all interior cells.
struct Reduce {
  std::string result;
  Reduction kind = Reduction::mean;
  std::string field;
  std::array<bool, max_rank> over{};
  bool operator==(const Reduce&) const = default;
};
using network::NetworkCall;
/// What a wave exp(i k.x) is multiplied by: function(argument)*factor, or the factor alone. Both are made of params and
/// numbers, and of ikx, iky, ikz, ikx0, iky0, ikz0 as polynomials.
struct Multiplier {
  WaveFunction function = {};
  Expr argument = 0.0, factor = 1.0;
  bool within_two_thirds = false;
  bool operator==(const Multiplier&) const = default;
};
/// result = the sum over the terms of the field with its waves multiplied.
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
/// `unknowns` become what the block has to read there to make `images` equal to `rights`, as many of each.
struct Solve {
  std::vector<std::string> images, rights, unknowns;
  std::vector<Statement> body;
  SolveBy by = {};
  Written written = {};
  bool is_linear = true;
  /// Of one that is not, where it is known (adjoint/reverse/newton_steps.h): a linear solve with what is left of
  /// `rights` for what is to be added to the unknowns.
  std::vector<Statement> step;
  /// Fields: methods that come near step by step begin with the sum of multiples of them that leaves the least of
  /// `rights`. What they come to is the same but for what the tolerance leaves, so that it has no derivative.
  std::vector<std::string> guesses = {};
  std::vector<HaloRule> halos = {};  // none where fills are placed
  /// Of a linear solve for one field by iterations: what is made of what one of them leaves, its first input, is the
  /// direction of the next one. That field and the result are known to the solve alone. It has no derivative either.
  std::optional<NetworkCall> preconditioner = {};
  bool operator==(const Solve& other) const;
};

/// After the program, or after a pass, `next` becomes `state`.
struct Swap {
  std::string state, next;
  bool operator==(const Swap&) const = default;
};
/// A swap of a repeat; `result`: the `next` of the last pass.
struct LoopCarried {
  std::string state, next, result;
  bool operator==(const LoopCarried&) const = default;
};
/// A field whose values in each pass go onto a stack, or come from one.
struct TapeEntry {
  std::string field, stack;
  bool operator==(const TapeEntry&) const = default;
};
/// A parameter that is the number of the pass, from 0 on or, backwards, down to 0.
struct Counter {
  std::string name;  // "": the passes have no numbers
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
/// A class of its own, and not another name, so that copies of all kinds are compiled once, in signature.cpp.
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
  std::vector<std::string> keeps;    // results beside those of swaps and sums
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
/// Adds those networks that `module` has not.
void add_networks(Module& module, const std::vector<network::Network>& networks);

}  // namespace dpde::stencil
