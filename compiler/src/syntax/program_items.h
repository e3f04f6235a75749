// SPDX-License-Identifier: Apache-2.0
// Lines of kernels, programs and networks, as written.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "syntax/parse/layout.h"
#include "syntax/physics_items.h"

namespace dpde::ast {

// ---- items inside a kernel or program ------------------------------------------------------------------------------
enum class KernelRole { in, out, inout, param, sum };
struct KernelParameter {  // u: field halo 1    out v: field    sum nu_bar: param    nu: param
  Identifier name;
  KernelRole role;
  std::optional<int> halo;
};
struct AssignItem {  // v = expr     v += expr   (field or sum)
  Identifier target;
  bool accumulate;
  Expr value;
};
struct ScatterItem {  // interp(u_bar, d) += expr
  Expr target;        // the Call interp(...)
  Expr value;
};
/// adjoint u_bar = expr     adjoint nu_bar += expr      (in a kernel or below an operator: replaces the derived
/// formula)
struct AdjointItem {
  Identifier target;
  bool accumulate = false;
  Expr value;
};
struct FillItem {  // fill u periodic      fill u x periodic, y.low = 0, y.high = zero_gradient
  Identifier field;
  bool fold = false;                // fold u grow 1 ...: transpose of the fill of 1 ghost cell
  int grow = 0;                     // only for fold
  std::vector<BoundarySide> sides;  // place "all" if no axis is written
  std::string written = {};         // the written field, if a pass of a repeat fills another one instead
};
struct ReduceItem {  // reduce m = mean u      reduce m = max u over x, y
  Identifier result;
  Reduction kind = Reduction::mean;
  Identifier field;
  std::vector<Identifier> axes;  // empty: all
};
/// transform u by nu*ikx^2, n by phi1(dt*nu*ikx^2)*dt within two_thirds to v
struct TransformItem {
  struct Term {
    Identifier field;
    Expr by;
    bool within_two_thirds = false;
  };
  std::vector<Term> terms;
  Identifier result;
};
struct RunItem {  // run burgers_step      run k grow 1
  Identifier kernel;
  int grow = 0;
};
struct SwapItem {  // swap u, v             (v becomes u for the next step)
  Identifier state, next;
};
struct StackItem {  // save u in passes      load u from passes      (of a repeat)
  Identifier field, stack;
  bool is_save = true;
};
struct Item;
/// repeat 8 { fill u ...; run ...; swap u, v } to w      A swap in it takes effect in the next pass.
/// repeat k in 0 .. 8 { ... }, repeat k in 8 .. 0 { ... }      k is the number of the pass.
/// In a network: repeats its layers, each copy with its own weights.
struct RepeatItem {
  int count = 1;
  bool shared = false;  // repeat 3 shared { ... } in a network: all passes use the same weights
  SourceRange count_range;
  std::vector<Item> items;
  BlockLayout layout;
  std::vector<Identifier> to = {};  // names of the swaps' results after it; empty: as before it
  std::optional<Identifier> counter = {};
  bool is_backwards = false;  // counts down
};
struct NetworkUse {  // smooth(r, k) to d
  Identifier network;
  std::vector<Identifier> inputs, to;
};
/// solve y = b for x from g by multigrid smoother jacobi tolerance 1e-8 iterations 50 or warn { ... y of x ... }
/// solve y = b for x by cg preconditioner smooth(r, k) to d { ... }      r and d exist only inside the solve
struct SolveItem {
  bool is_linear = true;  // false for newton y = b for x { ... }
  std::vector<Identifier> images, rights, unknowns;
  std::vector<Identifier> guesses;
  std::optional<Identifier> method, smoother, preconditioner;
  std::optional<NetworkUse> network;  // used instead of a named preconditioner
  std::optional<Expr> tolerance, iterations;
  bool warns = false;
  std::vector<Item> items;
  BlockLayout layout;
};
struct KeepItem {  // keep u_bar, w          (results, in addition to those of swap)
  std::vector<Identifier> names;
};
struct AxesItem {  // axes x periodic, y bounded      (for a program without fills that show it)
  struct Axis {
    Identifier name;
    Topology topology;
  };
  std::vector<Axis> axes;
};

/// apply corrector(a, b) to c, d
/// tangent corrector(a, b) by a_dot, b_dot to c_dot, d_dot weights
/// adjoint corrector(a, b) by c_bar, d_bar to a_bar, b_bar weights
/// second corrector(a, b) by a_dot, b_dot, c_bar, d_bar to a_bar, b_bar, a_dot_bar, b_dot_bar weights
struct ApplyItem {
  enum class Mode { value, tangent, adjoint, second };
  Identifier network;
  Mode mode = Mode::value;
  std::vector<Identifier> inputs;
  std::vector<Identifier> by, to;  // fields; "_": none, i.e. the tangent is 0 or the adjoint is not needed
  bool weights = false;            // with tangents or adjoints of the weights
};

// ---- items inside a network ----------------------------------------------------------------------------------------
struct LayerItem {  // conv 32, 5, gain = 0.1     relu     leaky_relu(0.2)
  Identifier layer;
  std::vector<Argument> arguments;
  bool parentheses = false;
};
struct BranchItem {  // residual { conv 32, 5; relu }     skip { mean_pool 2; conv 32, 3; upsample 2 }
  enum class Join { add, concat } join = Join::add;
  SourceRange word_range;
  std::vector<Item> items;
  BlockLayout layout;
};
struct PaddingItem {  // padding replicate     padding x periodic, y zero
  struct Axis {
    Identifier name;  // "" if one word applies to all
    Identifier padding;
  };
  std::vector<Axis> axes;
};
struct StartItem {  // initial he, seed 7     (initial weights of training)
  std::optional<Identifier> method;
  std::optional<Expr> seed;
};
struct SymmetryItem {  // symmetric flips, rotations about z, galilean(u)
  struct Part {
    Identifier word;                 // flip, flips, rotations or galilean
    std::optional<Identifier> axis;  // for flip, and rotations about an axis
    std::vector<Identifier> inputs;  // for galilean; empty: all vectors
  };
  std::vector<Part> parts;
};
struct RealItem {  // real f64
  Identifier precision;
};
struct HostItem {  // host weights 120     (instead of layers)
  Expr weights;
};

}  // namespace dpde::ast
