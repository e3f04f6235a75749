// SPDX-License-Identifier: Apache-2.0
// Loop level: row functions and the order in which they are called. In contrast to the stencil level, every read along
// a row is a stream (a pointer of its own, so that loads of neighbours are independent for the vectoriser), every
// uniform value is computed once, and the positions of fills in the schedule are fixed.
//
//   row k(streams; uniforms) { let a = ...; s0 = ...; sum += ... }        one pass over the cells of one row
//   program: prepare { fill u } body { sweep k grow 0 then fill v; fold w }
//
// Rows that differ in names and numbers only are one row: each sweep binds the row's names to its own (Binding).
//
// Memory: all fields of a simulation share one layout (dpde_layout of kernel_abi.h); stream s of a row starts at
// field[s] + layout offset of (z + dz, y + dy, first + dx).
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "network/network.h"
#include "source/source_file.h"
#include "support/expression.h"
#include "support/side_conditions.h"
#include "support/vocabulary.h"
#include "support/wave_function.h"

namespace dpde::loop {

constexpr int max_rank = 3;
using Offset = std::array<int, max_rank>;

struct Node;
using Expr = ExprOf<Node>;
using Neg = NegOf<Expr>;
using Binary = BinaryOf<Expr>;
using Call = CallOf<Expr>;
using Select = SelectOf<Expr>;

struct Uniform {  // index into Module::uniforms
  int index;
  bool operator==(const Uniform&) const = default;
};
struct Param {  // index into Module::params; only inside the definition of a uniform
  int index;
  bool operator==(const Param&) const = default;
};
struct Counter {  // index into Module::counters; only inside the definition of a uniform
  int index;
  bool operator==(const Counter&) const = default;
};
struct Load {  // the stream's value at the current cell
  int stream;
  bool operator==(const Load&) const = default;
};
struct Local {  // index into Row::lets
  int index;
  bool operator==(const Local&) const = default;
};
struct Inside {
  Offset offset;
  int grow;
  bool operator==(const Inside&) const = default;
};
struct Interp {  // `grid` is an index into Row::grids: fields read or scattered to at computed positions
  int grid;
  Offset offset;
  std::vector<Expr> displacement;
  std::array<InterpolationBasis, max_rank> along;
  bool operator==(const Interp&) const = default;
};
/// A product or power that is rounded before an addition, never part of a fused multiply-add: operands of decisions
/// (stencil/space/comparisons.h) then have the same value wherever they are computed.
struct Rounded {
  Expr operand;
  bool operator==(const Rounded&) const = default;
};

using Kind =
    std::variant<Literal, Uniform, Param, Counter, Load, Local, Inside, Interp, Neg, Rounded, Binary, Call, Select>;
struct Node {
  Kind kind;
  bool operator==(const Node&) const = default;
};
void for_each_child(const Node& node, FunctionRef<void(const Expr&)> f);
void for_each_child(Node& node, FunctionRef<void(Expr&)> f);
inline Expr rebuilt(Node node) { return Expr(std::move(node)); }

/// One pointer of a row function.
struct Stream {
  std::string field;
  Offset offset{};
  enum class Mode { in, out, inout } mode = Mode::in;
  bool is_even = false;  // constant along a row: a coordinate across it, read once
  int over = -1;         // for an output: the stream, read at the same cells, whose memory it may share; -1: none
  bool operator==(const Stream&) const = default;
};
struct Let {
  std::string name;
  Expr value;
  bool operator==(const Let&) const = default;
};
struct Store {  // stream (+)= value
  int stream;
  bool accumulate;
  Expr value;
  Origin origin;
  bool operator==(const Store&) const = default;
};
struct Sum {  // index into Module::sums of the program; name kept for the reader
  std::string name;
  Expr value;
  bool operator==(const Sum&) const = default;
};
struct Scatter {
  Interp target;
  Expr value;
  bool operator==(const Scatter&) const = default;
};

/// A function over one row: stores and sums of all its cells, or (never both) scatters of all its cells.
/// A stencil kernel with stores and scatters becomes two rows, run one after the other.
struct Row {
  std::string name;
  int rank = 1;
  std::vector<Topology> axes;  // used by inside and interp
  std::vector<Stream> streams;
  std::vector<std::string> grids;
  std::vector<Let> lets;
  std::vector<Store> stores;
  std::vector<Sum> sums;
  std::vector<Scatter> scatters;
  int own = 0, row_constant_count = 0;  // uniforms from `own` on, which sweeps may bind to others
  bool is_own(int uniform) const { return uniform >= own && uniform < own + row_constant_count; }
  bool operator==(const Row&) const = default;
};

/// After the program `state` takes the value of `next`.
struct Swap {
  std::string state, next;
  bool is_over = false;  // both may share memory
  bool operator==(const Swap&) const = default;
};

/// Special values for the index of a uniform.
constexpr int uniform_zero = -1, uniform_one = -2;
/// The rule of a side with its coefficients and c, as indices of uniforms.
struct Side {
  const GhostRule* rule = nullptr;  // null along periodic axes
  std::array<int, side_coefficients> coefficients{uniform_zero, uniform_zero};
  int value = uniform_zero;
  std::string field = "";  // the field with the values, instead of `value`
  /// v = c
  bool is_value() const { return coefficients[0] == uniform_one && coefficients[1] == uniform_zero; }
  bool operator==(const Side&) const = default;
};
struct AxisBoundary {
  Topology topology;
  Side low, high;
  bool operator==(const AxisBoundary&) const = default;
};
struct Fill {
  std::string field;
  std::vector<AxisBoundary> axes;
  bool operator==(const Fill&) const = default;
};
struct Fold {
  std::string field;
  int grow = 0;  // halo cells folded on each side of bounded axes
  std::vector<AxisBoundary> axes;
  bool operator==(const Fold&) const = default;
};
/// result = the mean, sum, ... of `field` along the axes named.
struct Reduce {
  std::string result;
  Reduction kind = Reduction::mean;
  std::string field;
  std::array<bool, max_rank> over{};
  bool operator==(const Reduce&) const = default;
};
using network::NetworkCall;
/// A uniform times powers of i*angle, with the phase angles (radians per cell) of a wave along the axes.
struct Monomial {
  int uniform = uniform_one;
  std::array<int, max_rank> powers{};
  bool operator==(const Monomial&) const = default;
};
/// function(argument)*factor, or the factor alone.
struct Multiplier {
  WaveFunction function = {};
  std::vector<Monomial> argument, factor;
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
  std::array<bool, max_rank> axes{};  // axes of the Fourier transform
  bool operator==(const Transform&) const = default;
};
/// Replacements for the names of a row that several sweeps share; other names are not replaced. The mapping is
/// injective.
struct Binding {
  std::map<std::string, std::string> fields, sums;
  int own = 0;  // added to the index of each of the row's own uniforms
  bool operator==(const Binding&) const = default;

  const std::string& field(const std::string& of_row) const { return name_in(fields, of_row); }
  const std::string& sum(const std::string& of_row) const { return name_in(sums, of_row); }

 private:
  static const std::string& name_in(const std::map<std::string, std::string>& names, const std::string& of_row) {
    const auto found = names.find(of_row);
    return found == names.end() ? of_row : found->second;
  }
};
/// Calls a row function for every row of the region; `then` fills fields that this sweep has written: the ends of each
/// row right after the row, while it is in cache.
struct Sweep {
  std::string row;
  int grow = 0;
  bool serial = false;  // scatters: rows in order, one thread
  std::vector<Fill> then;
  Binding binding;
  bool operator==(const Sweep&) const = default;
};
struct Solve;
struct Repeat;
struct Operation;
/// Sets `unknowns` so that the body, which computes `images` from them, makes these equal to `rights`.
struct Solve {
  std::vector<std::string> images, rights, unknowns;
  std::vector<Operation> body;
  SolveBy by = {};
  std::array<int, max_rank> reach{};      // stencil radius of the operator; -1: the whole axis
  std::vector<std::string> coefficients;  // the fields that the body reads in addition to the unknowns
  std::vector<std::string> params;        // parameters and counters that it reads
  bool is_linear = true;
  std::vector<Operation> step;                     // if nonlinear: a linear solve for the change of the unknowns
  std::vector<std::string> guesses = {};           // it starts from their best linear combination; none: from 0
  std::optional<NetworkCall> preconditioner = {};  // its first input is the residual
  OperatorTraits traits = {};                      // hold for all values of coefficients
  bool operator==(const Solve& other) const;
};
/// `next` of a pass is the `state` of the next pass, and in the last pass the `result`. Passes write alternately to the
/// memory of `result` and of `next`, so that nothing is copied.
struct LoopCarried {
  std::string state, next, result;
  bool operator==(const LoopCarried&) const = default;
};
/// `field` is pushed onto a stack in each pass, or popped from one.
struct TapeEntry {
  std::string field;
  int stack;  // index into Program::stacks
  bool operator==(const TapeEntry&) const = default;
};
struct Repeat {
  int count = 1;
  std::vector<Operation> body;
  std::vector<LoopCarried> carries;
  std::vector<TapeEntry> saves, loads;
  int counter = -1;  // index into Module::counters: the number of the pass
  bool is_backwards = false;
  bool operator==(const Repeat& other) const;
};
/// A class and not an alias, so that copies of all kinds are compiled once, in loop.cpp.
struct Operation : std::variant<Fill, Fold, Reduce, NetworkCall, Transform, Sweep, Solve, Repeat> {
  using variant::variant;
  Operation();
  Operation(const Operation& other);
  Operation(Operation&& other) noexcept;
  Operation& operator=(const Operation& other);
  Operation& operator=(Operation&& other) noexcept;
  ~Operation();
};
inline bool Solve::operator==(const Solve& other) const {
  return images == other.images && rights == other.rights && unknowns == other.unknowns && body == other.body &&
         by == other.by && reach == other.reach && coefficients == other.coefficients && params == other.params &&
         is_linear == other.is_linear && step == other.step && guesses == other.guesses &&
         preconditioner == other.preconditioner && traits == other.traits;
}
inline bool Repeat::operator==(const Repeat& other) const {
  return count == other.count && body == other.body && carries == other.carries && saves == other.saves &&
         loads == other.loads && counter == other.counter && is_backwards == other.is_backwards;
}

struct Program {
  std::string name;
  std::vector<Topology> axes;
  std::vector<std::string> fields;  // index = field number of the ABI; inputs first
  int input_count = 0;
  std::vector<std::string> sums;
  std::array<int, max_rank> halo{};
  std::vector<int> stacks;  // capacity of each stack, in fields
  /// Fills of inputs: run once when inputs are bound. The body leaves the halo of every swap's `next` filled, so a loop
  /// over steps runs `prepare` once.
  std::vector<Fill> prepare;
  std::vector<Operation> body;
  std::vector<Swap> swaps;
  std::vector<std::string> keeps;
  bool operator==(const Program&) const = default;
};

struct UniformDef {
  std::string name;  // u0, u1, ... or the parameter's own name
  Expr value;        // of Params, Counters, Literals and earlier Uniforms
  bool operator==(const UniformDef&) const = default;
};

struct Module {
  /// Precision of all values in rows; uniforms and sums are computed in f64, and a row rounds the uniforms it reads.
  Precision real = Precision::f64;
  std::vector<std::string> params;
  std::vector<std::string> counters;  // numbers of passes: uniforms of them change from pass to pass
  std::vector<UniformDef> uniforms;
  std::vector<Row> rows;
  std::vector<Program> programs;
  std::vector<network::Network> networks = {};
  bool operator==(const Module&) const = default;
  const Row* find_row(const std::string& name) const;
};

}  // namespace dpde::loop

extern template class dpde::ExprOf<dpde::loop::Node>;
