// SPDX-License-Identifier: Apache-2.0
// The grammar of a .dpde file as types. True here and not later: names are as written, nothing is resolved,
// every node has a range, comments are kept. `Error` is poison: whoever meets it stays silent.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "support/variant.h"
#include "syntax/expression.h"

namespace dpde::ast {

/// Comments around an item, so that `dpde fmt` loses nothing.
struct Trivia {
  std::vector<std::string> before;  // whole-line comments above, each with its #; "" is a blank line below a comment
  std::string after;                // comment at the end of the same line, with its #
  bool blank_before = false;        // one blank line stood above
};

/// How { ... } was written.
struct BlockLayout {
  std::vector<std::string> before;            // comments between the first word and {
  std::string after;                          // comment behind {
  std::vector<std::string> closing_comments;  // whole-line comments above }
  bool one_line = false;
};

// ---- items inside a model ------------------------------------------------------------------------------------------
struct FieldItem {  // field u, v          vector u on faces       (a component for each axis of the scene)
  std::vector<Identifier> names;
  bool vector = false;
  std::optional<Identifier> on;  // centres, faces, faces.x, nodes
};
// coefficient kappa, coefficient vector v      (a given field, constant in time)
// control field F, control vector G            (one field for each interval of time)
struct CoefficientItem {
  std::vector<Identifier> names;
  bool vector = false;
  std::optional<Identifier> on;
  bool control = false;
  bool mask = false;  // mask solid: where a condition of the scene is true
};
struct ParamItem {  // param nu = 0.01, c
  std::vector<Identifier> names;
  std::vector<std::optional<Expr>> values;  // one a name: where the scene says none
};
struct ControlItem {  // control F, G       (a parameter with one value for each interval of time)
  std::vector<Identifier> names;
};
struct LetItem {  // let s = u + v           (models, scenes and kernels)
  Identifier name;
  Expr value;
};
struct EquationItem {  // dt(u) = rhs, or dt(dt(u)) = rhs with field "dt(u)"
  Identifier field;
  Expr rhs;
};

struct SolvedItem {  // solve lap(phi) = omega for phi      (phi is what makes it true at each moment)
  Expr left, right;
  Identifier unknown;
};
struct ConstraintItem {  // 0 = div(u) gives p      (p in the other equations is what makes it true)
  Expr zero, value;      // the left side, which has to be 0, and the right one
  Identifier multiplier;
};
struct HeldItem {  // u = 0 inside solid
  Identifier field;
  Expr value;
  Identifier mask;
};

// ---- items inside a scene ------------------------------------------------------------------------------------------
struct GridItem {  // grid x = -1 .. 1, cells 128, periodic
  Identifier axis;
  Expr low, high;
  std::optional<Expr> cells;
  bool periodic = false;
  std::optional<Expr> stretched;  // where the points lie, of x running uniformly from low to high
};
struct CellsItem {  // cells 64            cells 64, 32      (of all axes, or of one after the other)
  std::vector<Expr> counts;
};
struct CoordinatesItem {  // coordinates polar     coordinates sphere(a)     coordinates metric(1, x)
  Expr kind;              // the Name of a kind, or a Call of one
};
struct ValueItem {  // nu = 0.01/pi          (parameter or coefficient; also the rows of a scheme block)
  Identifier name;
  Expr value;
  std::optional<Expr> every;          // of a control: F = sin(t) every 0.1
  std::optional<Identifier> of = {};  // of a scheme: advect marker = maccormack
};
// initial u = load("run.nc", u) at t = 0.5     initial u = (y, 0) projected     initial dt(u) = 0, with field "dt(u)"
struct InitialItem {
  Identifier field;
  Expr value;
  std::optional<Expr> at;
  std::optional<SourceRange> projected = {};
};
struct ExactItem {  // exact u = exp(-t)*sin(x)
  Identifier field;
  Expr value;
};
struct BoundarySide {  // x.low = 0     x = zero_gradient     all = 0
  Identifier place;
  Expr value;  // an expression, or the Name of a condition, as zero_gradient, or periodic
};
struct BoundaryItem {  // boundary u: x.low = 0, x.high = 1
  Identifier field;
  std::vector<BoundarySide> sides;
  bool bare = false;  // boundary u = 0
};
struct TimeItem {  // time 0 .. 1, step 1/32, courant 0.4, speed |u| + c     time 0 .. 9, step 0.1, until steady 1e-8
                   // time 0 .. 1, step 1/32, tolerance 1e-6, absolute 1e-9, first 1e-3
  Expr from, to;
  std::optional<Expr> step, courant, speed, tolerance, absolute, first, steady;
};
struct StepItem {  // step 1/32             (with a hand-written loop, or where a scene is made from another)
  Expr step;
};
struct OutputItem {  // output u, v every 0.1
  std::vector<Identifier> fields;
  std::optional<Expr> every;
};
/// after step: u = max(u, 0)     every 0.1: a += 1, b = 0     at t = 0.5, 1: u = 0      (all see the values before)
struct EventItem {
  struct Update {
    Identifier field;
    bool accumulate = false;
    Expr value;
  };
  std::optional<Expr> every;  // neither this nor times: after each step
  std::vector<Expr> times;
  std::vector<Update> updates;
};
struct SubcycleItem {  // subcycle b, c in 4
  std::vector<Identifier> fields;
  Expr parts;
};
struct AccuracyItem {  // accuracy 1e-3 on u, v      (relative, at the end of the run; no fields: all)
  Expr tolerance;
  std::vector<Identifier> fields;
};
struct ObserveItem {  // observe energy = 0.5*integral(u^2)
  Identifier name;
  Expr value;
};

// ---- items inside a task -------------------------------------------------------------------------------------------
struct WhenAt {  // at t = 0.5, 1.0
  std::vector<Expr> times;
};
struct WhenOver {};  // over time: every state from the first to the last
struct WhenSteps {   // over 4 steps: each of the states behind so many steps from wherever a run begins
  Expr steps;
};
struct WhenEnd {};  // nothing said: the last state
using When = std::variant<WhenEnd, WhenAt, WhenOver, WhenSteps>;

// data v on faces.x = load("v.npy")  |  data w = trajectories("w.nc", u)  |  data r = u from scene fine at t = 0.5
struct DataItem {
  Identifier name;
  std::optional<Identifier> on;
  Expr value;                       // load("...") or the field's name
  std::optional<Identifier> scene;  // after `from scene`
  When when;
};
struct UnknownItem {  // unknown initial u from 0      unknown nu from 0.01 in 0 .. 1
  bool initial = false;
  Identifier name;
  std::optional<Expr> from, low, high;
};
struct MinimiseItem {  // minimise mean((u - u_ref)^2) at t = 0.5
  Expr loss;
  When when;
};
struct LearnItem {  // learn corrector from "start.safetensors"
  Identifier network;
  std::optional<Expr> from;  // a Text
};
struct UsingItem {  // using adam(rate = 1e-3), batch 4, unroll (1, 2, 4), iterations 50
  Expr optimiser;
  std::vector<Argument> options;  // batch 4 has the name batch and the value 4
};
/// test mae = mean(abs(u - u_true)) over time        growth rate on trajectories("test.nc") for 250 steps
/// test e = mean(u^2) on trajectories("test.nc") for 250 steps beside plain, fine on trajectories("fine.nc")
/// statistic, spectrum energy = u, correlation vorticity = curl(u) above 0.8: likewise
struct TestItem {  // a number reported after optimising
  enum class Kind { test, statistic, spectrum, correlation, growth } kind = Kind::test;
  struct Beside {  // another scene, from a file of its own where it has one
    Identifier scene;
    std::optional<Expr> on;
  };
  Identifier name;
  Expr value;  // of growth none
  When when;
  std::optional<Expr> above;  // of a correlation
  std::optional<Expr> on, steps;
  std::vector<Beside> beside;
};

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
/// adjoint u_bar = expr     adjoint nu_bar += expr      (in a kernel: what stands in place of the derived formula;
/// below an operator)
struct AdjointItem {
  Identifier target;
  bool accumulate = false;
  Expr value;
};
struct FillItem {  // fill u periodic      fill u x periodic, y.low = 0, y.high = zero_gradient
  Identifier field;
  bool fold = false;                // fold u grow 1 ...: the transpose of the fill of 1 halo cell
  int grow = 0;                     // only of fold
  std::vector<BoundarySide> sides;  // place "all" when no axis is written
  std::string written = {};         // the field, where a pass of a repeat fills another in its place
};
struct ReduceItem {  // reduce m = mean u      reduce m = max u over x, y
  Identifier result;
  Reduction kind = Reduction::mean;
  Identifier field;
  std::vector<Identifier> axes;  // none: all
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
/// repeat 8 { fill u ...; run ...; swap u, v } to w      What a swap in it says holds from the next pass on.
/// repeat k in 0 .. 8 { ... }, repeat k in 8 .. 0 { ... }      k is the number of the pass.
/// In a network: its layers so many times, each with weights of its own.
struct RepeatItem {
  int count = 1;
  bool shared = false;  // repeat 3 shared { ... } of a network: the same weights in each pass
  SourceRange count_range;
  std::vector<Item> items;
  BlockLayout layout;
  std::vector<Identifier> to = {};  // what the swaps' fields are called behind it; none: as before it
  std::optional<Identifier> counter = {};
  bool is_backwards = false;  // it counts down
};
/// solve y = b for x from g by multigrid smoother jacobi tolerance 1e-8 iterations 50 or warn { ... y of x ... }
struct SolveItem {
  bool is_linear = true;  // newton y = b for x { ... } where not
  std::vector<Identifier> images, rights, unknowns;
  std::optional<Identifier> guess, method, smoother;
  std::optional<Expr> tolerance, iterations;
  bool warns = false;
  std::vector<Item> items;
  BlockLayout layout;
};
struct KeepItem {  // keep u_bar, w          (results, beside those of swap)
  std::vector<Identifier> names;
};
struct AxesItem {  // axes x periodic, y bounded      (of a program no fill of which tells)
  struct Axis {
    Identifier name;
    Topology topology;
  };
  std::vector<Axis> axes;
};

/// apply corrector(a, b) to c, d
/// tangent corrector(a, b) by a_dot, b_dot to c_dot, d_dot weights
/// adjoint corrector(a, b) by c_bar, d_bar to a_bar, b_bar weights
struct ApplyItem {
  enum class Mode { value, tangent, adjoint };
  Identifier network;
  Mode mode = Mode::value;
  std::vector<Identifier> inputs;
  std::vector<Identifier> by, to;  // fields; one called "_" is none: its rate is 0, or nobody wants it
  bool weights = false;            // with the rates of the weights, or what they get
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
    Identifier name;  // "" where one word holds for all
    Identifier padding;
  };
  std::vector<Axis> axes;
};
struct StartItem {  // initial he, seed 7     (the weights that training begins with)
  std::optional<Identifier> method;
  std::optional<Expr> seed;
};
struct SymmetryItem {  // symmetric flips, rotations about z, galilean(u)
  struct Part {
    Identifier word;                 // flip, flips, rotations or galilean
    std::optional<Identifier> axis;  // of flip, and of rotations about one
    std::vector<Identifier> inputs;  // of galilean; none: all vectors
  };
  std::vector<Part> parts;
};
struct RealItem {  // real f64
  Identifier precision;
};
struct HostItem {  // host weights 120     (in place of layers)
  Expr weights;
};

// ---- items inside a data set ---------------------------------------------------------------------------------------
struct VaryItem {  // vary nu in 0.01 .. 0.1     vary s from 100     (a random number in between; 100, 101, ...)
  Identifier name;
  std::optional<Expr> low, high, from;
};
struct FramesItem {  // frames every 0.1 from 3 to 23
  Expr every;
  std::optional<Expr> from, to;
};
struct OptionItem {  // runs 10     seed 3     coarsen 4     file "train.nc"
  Identifier name;
  Expr value;
};

// ---- items inside a chart ------------------------------------------------------------------------------------------
struct ReferenceItem {  // reference exact      reference manufactured      reference self(cells = 4096)
  Expr value;
};
struct ChoicesItem {  // vary advect in central(2), upwind(3)
  Identifier key;
  std::vector<Expr> values;
};
struct ErrorItem {  // error l2(u), linf(v) at t = 1
  std::vector<Expr> norms;
  std::optional<Expr> at;
};

/// A class of its own, and not another name, so that copies of all kinds are compiled once, in ast.cpp.
struct ItemKind
    : Variant<FieldItem, CoefficientItem, ParamItem, ControlItem, LetItem, EquationItem, SolvedItem, ConstraintItem,
              HeldItem, GridItem, CoordinatesItem, ValueItem, InitialItem, ExactItem, BoundaryItem, TimeItem, StepItem,
              EventItem, SubcycleItem, ObserveItem, OutputItem, DataItem, UnknownItem, MinimiseItem, LearnItem,
              UsingItem, TestItem, AssignItem, ScatterItem, AdjointItem, FillItem, ReduceItem, TransformItem, RunItem,
              SwapItem, StackItem, RepeatItem, SolveItem, KeepItem, AxesItem, ApplyItem, LayerItem, BranchItem,
              PaddingItem, StartItem, SymmetryItem, RealItem, HostItem, VaryItem, FramesItem, OptionItem, AccuracyItem,
              ReferenceItem, ChoicesItem, ErrorItem, CellsItem> {
  using Variant::Variant;
  ItemKind();
  ItemKind(const ItemKind& other);
  ItemKind(ItemKind&& other) noexcept;
  ItemKind& operator=(const ItemKind& other);
  ItemKind& operator=(ItemKind&& other) noexcept;
  ~ItemKind();
};
struct Item {
  ItemKind kind;
  SourceRange range;
  Trivia trivia;
};

// ---- declarations --------------------------------------------------------------------------------------------------
struct Model {  // model NAME { ... }
  Identifier name;
  std::vector<Item> items;
};
struct Scene {  // scene NAME : MODEL [, MODEL] [with SCHEME] { ... }     scene NAME = SCENE [with SCHEME] { ... }
  Identifier name, of;
  std::vector<Identifier> also;  // the models behind the first
  std::optional<Identifier> scheme;
  std::vector<Item> items;
  std::optional<Identifier> like = {};  // the scene behind =; with_whole_scenes puts its items in
};
struct Scheme {  // scheme NAME { key = value; ... }
  Identifier name;
  std::vector<Item> items;  // ValueItem only
};
struct Task {  // task NAME : SCENE [with SCHEME] { ... }
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;
};
struct Kernel {  // kernel NAME(u: field halo 1, out v: field, nu: param) [on 2 axes] { ... }
  Identifier name;
  std::vector<KernelParameter> parameters;
  std::optional<int> axes;                         // on 2 axes: where no offset in the body tells
  std::vector<Item> items;                         // LetItem, AssignItem, ScatterItem, AdjointItem
  std::string copy_of = {};                        // the kernel that this one was copied from for a repeat
  std::map<std::string, std::string> copied = {};  // and its fields there, by what they are here
};
struct Program {  // program NAME { fill ...; run ...; swap ... }
  Identifier name;
  std::vector<Item> items;
};
struct Loop {  // loop t in 0 .. 32 { wave_step }
  Identifier counter;
  int from = 0, to = 0;
  std::vector<Identifier> body;
};
struct Function {  // function f(a, b) = expr       operator lap9(u) order 2 = (u[+1, 0] + ...)/hx^2
  Identifier name;
  std::vector<Identifier> parameters;
  std::optional<int> order;  // of operators, whose parameters are read at neighbours
  Expr body;
  std::vector<AdjointItem> adjoints;  // of operators: lines below the body
};

struct Import {  // import "flow.dpde"       its blocks stand behind those of this file
  std::string path;
  SourceRange range;  // of the text
};

/// network NAME(u: vector, nu) -> vector { ... }      below the model level of so many channels: network NAME(3) -> 2
struct Network {
  struct Input {
    Identifier name;
    bool vector = false;
  };
  Identifier name;
  std::vector<Input> inputs;
  std::vector<Identifier> outputs;  // none: scalar; the word `scalar` or `vector`, or names
  std::optional<int> input_channels, output_channels;
  std::vector<Item> items;  // PaddingItem, StartItem, SymmetryItem, RealItem, and HostItem or LayerItem, BranchItem,
                            // RepeatItem or LetItem, AssignItem
};

/// dataset NAME : SCENE [with SCHEME] { runs 10; vary nu in 0.01 .. 0.1; ... }      runs of a scene, in one file
struct DataSet {
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;  // VaryItem, FramesItem, OptionItem
};

/// chart NAME : SCENE [with SCHEME] { vary cells in 64, 128; ... }      speed against accuracy of a scene's variants
struct Chart {
  Identifier name, of;
  std::optional<Identifier> scheme;
  std::vector<Item> items;  // ReferenceItem, ChoicesItem, ErrorItem, OptionItem
};

struct DeclarationKind
    : std::variant<Model, Scene, Scheme, Task, Kernel, Program, Loop, Function, Import, Network, DataSet, Chart> {
  using variant::variant;
  DeclarationKind();
  DeclarationKind(const DeclarationKind& other);
  DeclarationKind(DeclarationKind&& other) noexcept;
  DeclarationKind& operator=(const DeclarationKind& other);
  DeclarationKind& operator=(DeclarationKind&& other) noexcept;
  ~DeclarationKind();
};
struct Declaration {
  DeclarationKind kind;
  SourceRange range;
  Trivia trivia;
  BlockLayout layout;
  bool imported = false;  // stands in an imported file
};

struct File {
  std::vector<Declaration> declarations;
  std::vector<std::string> trailing_comments;
};

}  // namespace dpde::ast
