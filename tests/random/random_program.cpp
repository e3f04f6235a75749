// SPDX-License-Identifier: Apache-2.0
#include "random/random_program.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <set>

#include "random/random_adjoint.h"
#include "random/random_expression.h"
#include "random/random_repeat.h"
#include "random/random_ties.h"
#include "stencil/build.h"
#include "stencil/text/print_stencil.h"

namespace dpde::testing {

using namespace stencil;

namespace {

constexpr int any_reach = 99;  // a filled halo is as wide as it has to be

/// A field and where it holds values.
struct Known {
  std::string name;
  bool is_input = true;
  bool is_coordinate = false;
  bool is_filled = false;
  bool is_on_walls = false;  // at n-1 no result: it is what the step stored or what the next fill sets
  bool was_read = false;     // by a kernel or reduction: to change it afterwards is mostly refused
  int reach = 0;             // readable that far outside the interior along bounded axes
  int grown = 0;             // computed that far outside
};

class Builder {
 public:
  explicit Builder(std::uint64_t seed)
      : random_(seed),
        refills_(~seed),
        reductions_(~seed ^ 0x9e3779b97f4a7c15),
        passes_(~seed ^ 0xbf58476d1ce4e5b9),
        adjoints_(~seed ^ 0x94d049bb133111eb),
        ties_(~seed ^ 0xd6e8feb86659fd93),
        lines_(~seed ^ 0x8ebc6af09c88c6e3),
        repeats_(~seed ^ 0xc2b2ae3d27d4eb4f) {
    result_.seed = seed;
    has_derived_names_ = SplitMix(~seed ^ 0xa0761d6478bd642f).percent(20);
  }

  RandomProgram build() {
    choose_grid();
    choose_inputs();
    for (int count = 1 + random_.below(4); count > 0; --count) add_statements();
    choose_results();
    drop_unused();
    if (repeats_.percent(25)) repeat_it(result_.module, program_, repeats_);
    result_.module.programs.push_back(program_);
    return std::move(result_);
  }

 private:
  void choose_grid();
  void choose_inputs();
  void choose_results();
  void drop_unused();
  void add_statements();
  void add_kernel(int grow);
  void add_ties();
  AxisBoundary mirrored(Topology topology);
  void add_update(int grow);
  void add_scatter();
  void add_reduction();
  void add_passes();
  void add_fill(Known& field);
  void add_refill(Known& field);
  void fill(Known& field, const Fill& fill);
  void add_fold(Known& field);
  void run(Kernel kernel, int grow);
  std::vector<AxisBoundary> boundary(const std::string& field, bool for_fold, int least_grown);
  Side side(const std::string& field, bool for_fold, int least_grown);
  Side wall_side(SideKind kind, const std::string& field, bool for_fold, int least_grown);
  bool may_change(const Known& field) { return !field.was_read || random_.percent(6); }
  Expr side_value();
  Scope scope(int grow, const std::string& without = "");
  Kernel kernel_with_lets(const char* name, Scope& scope);

  bool has_bounded() const { return std::ranges::count(program_.axes, Topology::bounded) > 0; }
  int rank() const { return result_.grid.rank; }
  Known* find(const std::string& name) {
    const auto found = std::ranges::find(known_, name, &Known::name);
    return found == known_.end() ? nullptr : &*found;
  }
  std::string fresh_field();

  SplitMix random_, refills_, reductions_, passes_, adjoints_, ties_, lines_, repeats_;
  RandomProgram result_;
  Program program_{"p", {}, {}, {}, {}};
  std::vector<Known> known_;
  std::vector<std::string> params_, side_params_;
  int kernels_ = 0, fields_ = 0;
  bool has_derived_names_ = false;  // fields and lets are called what the compiler likes to call its own
};

void Builder::choose_grid() {
  const int rank = 1 + random_.weighted({45, 35, 20});
  result_.grid.rank = rank;
  const int most[] = {9, 5, 4};
  for (int axis = 0; axis < rank; ++axis) {
    result_.grid.cells[axis] = 1 + random_.below(most[rank - 1]);
    program_.axes.push_back(random_.percent(50) ? Topology::periodic : Topology::bounded);
  }
}

void Builder::choose_inputs() {
  const std::vector<std::string> names = {"u", "v", "kappa", "u_bar", "t1", "double"};
  for (int count = 1 + random_.below(3), first = random_.percent(80) ? 0 : random_.below(4); count > 0; --count) {
    known_.push_back({names[static_cast<std::size_t>(first + count - 1)]});
  }
  for (const Known& field : known_) {
    if (random_.percent(85)) result_.wrt.fields.insert(field.name);
  }
  for (int axis = 0; axis < rank(); ++axis) {
    if (random_.percent(20))
      known_.push_back({std::string(1, "xyz"[axis]), true, true, true, false, false, any_reach, any_reach});
  }
  params_ = {"dt", "hx", "a", "nu"};
  side_params_ = {"g", "dt", "t"};
  for (const char* name : {"a", "nu"}) {
    if (random_.percent(60)) result_.wrt.params.insert(name);
  }
  if (result_.wrt.fields.empty()) result_.wrt.fields.insert(known_[0].name);
  if (random_.percent(2)) side_params_.push_back("a");  // refused where it is active
}

std::string Builder::fresh_field() {
  constexpr const char* derived[] = {"w1_bar", "t3", "u_next", "hx2", "shared_bar", "v_dot", "bar", "p_adjoint"};
  ++fields_;
  if (has_derived_names_ && fields_ <= std::ssize(derived)) return derived[fields_ - 1];
  if (fields_ == 2 && random_.percent(20)) return "u_dot";
  return fmt::format("w{}", fields_);
}

Expr Builder::side_value() {
  const Expr number = random_.uniform(-1.0, 2.0);
  const Expr name = param(side_params_[random_.below(static_cast<int>(side_params_.size()))]);
  switch (random_.below(4)) {
    case 0: return number;
    case 1: return name;
    case 2: return name * number;
    default: return call(Fn::sin, {name}) + number;
  }
}

Side Builder::side(const std::string& field, bool for_fold, int least_grown) {
  constexpr SideKind kinds[] = {SideKind::value, SideKind::zero_gradient, SideKind::gradient, SideKind::mixed};
  return wall_side(kinds[random_.weighted({4, 3, 2, 2})], field, for_fold, least_grown);
}

Side Builder::wall_side(SideKind kind, const std::string& field, bool for_fold, int least_grown) {
  Side result{kind};
  if (kind == SideKind::zero_gradient && lines_.percent(30)) result.kind = SideKind::linear;
  if (kind == SideKind::zero_gradient) return result;
  std::vector<std::string> walls;
  for (const Known& other : known_) {
    if (!other.is_input && other.name != field && std::min(other.grown, other.reach) >= least_grown)
      walls.push_back(other.name);
  }
  if (!walls.empty() && random_.percent(for_fold ? 10 : 30)) {
    result.value = access(walls[random_.below(static_cast<int>(walls.size()))]);
  } else if (!for_fold) {
    result.value = side_value();
  }
  if (result.kind == SideKind::mixed) {
    result.a = random_.percent(50) ? Expr(random_.uniform(0.2, 2.0)) : param("g");
    result.b = random_.percent(50) ? Expr(random_.uniform(0.2, 2.0)) : param("g") + 0.5;
  }
  return result;
}

/// Fields on walls are filled before anything reads them.
std::vector<AxisBoundary> Builder::boundary(const std::string& field, bool for_fold, int least_grown) {
  const bool on_walls = for_fold || !find(field)->was_read;
  std::vector<AxisBoundary> axes;
  for (const Topology topology : program_.axes) {
    AxisBoundary axis{topology, {}, {}};
    if (topology == Topology::bounded && on_walls && random_.percent(12)) {
      axis.low = side(field, for_fold, least_grown);
      axis.high = side(field, for_fold, least_grown);
      axis.low.on_wall = axis.high.on_wall = true;
      if (axis.high.kind == SideKind::linear && lines_.percent(50)) axis.high.kind = SideKind::outflow;
    } else if (topology == Topology::bounded) {
      axis.low = side(field, for_fold, least_grown);
      axis.high = random_.percent(30) ? axis.low : side(field, for_fold, least_grown);
    }
    axes.push_back(axis);
  }
  return axes;
}

void Builder::add_fill(Known& field) { fill(field, {field.name, boundary(field.name, false, 1)}); }

void Builder::fill(Known& field, const Fill& fill) {
  field.is_filled = true;
  field.is_on_walls |= is_on_walls(fill.axes);
  field.reach = any_reach;
  for (const std::string& wall : wall_fields(fill.axes))
    field.reach = std::min({field.reach, find(wall)->grown, find(wall)->reach});
  field.grown = std::min(field.grown, field.reach);
  program_.body.push_back(fill);
}

/// The fill before once more, with the sides of an axis exchanged or a number in the place of one.
void Builder::add_refill(Known& field) {
  for (auto statement = program_.body.rbegin(); statement != program_.body.rend(); ++statement) {
    const Fill* before = std::get_if<Fill>(&*statement);
    if (!before || before->field != field.name) continue;
    Fill again = *before;
    AxisBoundary& axis = again.axes[static_cast<std::size_t>(refills_.below(rank()))];
    if (refills_.percent(50) && axis.high.kind != SideKind::outflow) std::swap(axis.low, axis.high);
    if (refills_.percent(50) && !is_on_walls(axis)) axis.low = Side{SideKind::value, refills_.uniform(-1.0, 2.0)};
    return fill(field, again);
  }
}

/// Halo values that were computed or scattered to go back to the cells they would be filled from.
void Builder::add_fold(Known& field) {
  const int grow = 1 + random_.below(field.grown);
  const Fold fold{field.name, grow, boundary(field.name, true, grow)};
  for (const std::string& wall : wall_fields(fold.axes)) {
    find(wall)->is_filled = false;
    find(wall)->reach = find(wall)->grown;
  }
  field.is_filled = false;
  field.reach = field.grown;
  program_.body.push_back(fold);
}

/// What a kernel that runs `grow` cells beyond the interior may read.
Scope Builder::scope(int grow, const std::string& without) {
  Scope result{program_.axes, {}, params_, {}};
  const bool is_mixed = has_bounded() && std::ranges::count(program_.axes, Topology::periodic) > 0;
  for (const Known& field : known_) {
    if (field.name == without || field.reach < grow) continue;
    const bool interpolates = field.is_filled && field.reach > grow + 1;  // as far as cubics do
    // around periodic axes beyond walls: refused where what is computed is read there
    const bool is_around = field.is_filled && (grow == 0 || !is_mixed || refills_.percent(4));
    const bool is_active = !(field.is_input && !result_.wrt.fields.contains(field.name));
    result.fields.push_back({field.name, field.reach - grow, is_around, interpolates || !has_bounded(), is_active,
                             std::min(field.reach, 2)});
  }
  return result;
}

Kernel Builder::kernel_with_lets(const char* name, Scope& scope) {
  Kernel kernel{fmt::format("{}{}", name, ++kernels_), rank(), {}, {}, {}, {}};
  using Names = std::vector<std::string>;
  const Names names = has_derived_names_ ? Names{"a_bar", "nu_dot", "t2", "k1"} : Names{"d", "ux", "i", "row"};
  for (int count = random_.below(4); count > 0; --count) {
    const Expr value = ExpressionGenerator(random_, scope).value(1 + random_.below(3));
    kernel.lets.push_back({names[kernel.lets.size()], value});
    scope.locals.push_back(kernel.lets.back().name);
  }
  return kernel;
}

void Builder::run(Kernel kernel, int grow) {
  for (const Signature::Read& read : signature(kernel).reads) find(read.field)->was_read = true;
  if (adjoints_.percent(30)) {
    const bool is_wrong = adjoints_.percent(8);
    give_adjoint(kernel, adjoints_, is_wrong);
    result_.has_wrong_adjoint |= is_wrong && !kernel.custom_adjoints.empty();
  }
  program_.body.push_back(Run{kernel.name, grow});
  result_.module.kernels.push_back(std::move(kernel));
}

void Builder::add_kernel(int grow) {
  Scope readable = scope(grow);
  Kernel kernel = kernel_with_lets("k", readable);
  ExpressionGenerator generator(random_, readable);
  std::vector<Known> made;
  for (int count = 1 + random_.percent(30); count > 0; --count) {
    made.push_back({fresh_field(), false, false, false, false, false, grow, grow});
    kernel.stores.push_back({made.back().name, false, generator.stored(), {}});
  }
  if (random_.percent(25)) kernel.sums.push_back({random_.percent(70) ? "s" : "e", generator.value(2)});
  known_.insert(known_.end(), made.begin(), made.end());
  run(std::move(kernel), grow);
}

/// Adds to a field that is there. A field that is read and varies may not be added to: seldom, as that is refused.
void Builder::add_update(int grow) {
  std::vector<std::string> targets;
  for (const Known& field : known_) {
    if (!field.is_input && field.grown >= grow && may_change(field)) targets.push_back(field.name);
  }
  if (targets.empty()) return;
  const std::string target = targets[random_.below(static_cast<int>(targets.size()))];
  Scope readable = scope(grow, target);
  if (readable.fields.empty()) return;
  Kernel kernel = kernel_with_lets("add", readable);
  ExpressionGenerator generator(random_, readable);
  Expr value = generator.stored();
  if (random_.percent(2)) value = value * access(target);
  kernel.stores.push_back({target, true, value, {}});
  run(std::move(kernel), grow);
  find(target)->is_filled = false;
  find(target)->reach = find(target)->grown;
}

void Builder::add_scatter() {
  std::vector<std::string> targets;
  for (const Known& field : known_) {
    if (!field.is_input && may_change(field)) targets.push_back(field.name);
  }
  if (targets.empty()) return;
  const std::string target = targets[random_.below(static_cast<int>(targets.size()))];
  Scope readable = scope(0, target);
  if (readable.fields.empty()) return;
  Kernel kernel = kernel_with_lets("scatter", readable);
  ExpressionGenerator generator(random_, readable);
  Interp place = generator.place({target});
  kernel.scatters.push_back({std::move(place), generator.value(2)});
  run(std::move(kernel), 0);
  Known& field = *find(target);
  field.is_filled = false;
  field.reach = field.grown;
  if (has_bounded() && field.grown > 0 && random_.percent(70)) add_fold(field);
}

/// Of any field there is, over some axes or all.
void Builder::add_reduction() {
  constexpr Reduction kinds[] = {Reduction::mean, Reduction::sum, Reduction::max, Reduction::min};
  Reduce reduce{"",
                kinds[reductions_.weighted({4, 2, 2, 2})],
                known_[static_cast<std::size_t>(reductions_.below(static_cast<int>(known_.size())))].name,
                {}};
  for (int axis = 0; axis < rank(); ++axis) reduce.over[axis] = reductions_.percent(50);
  reduce.over[static_cast<std::size_t>(reductions_.below(rank()))] = true;
  find(reduce.field)->was_read = true;
  reduce.result = fresh_field();
  known_.push_back({reduce.result, false, false, false, false, true, 0, 0});  // the derivative of max and min reads it
  program_.body.push_back(std::move(reduce));
}

/// The kernel before again and again, on what it has written, as a repeat does it: rows that are alike.
void Builder::add_passes() {
  Kernel kernel = result_.module.kernels.back();
  kernel.custom_adjoints.clear();
  const int grow = std::get<Run>(program_.body.back()).grow;
  const Signature s = signature(kernel);
  const auto may_be_written = [&](const Signature::Read& read) {
    const Known& field = *find(read.field);
    return !field.is_coordinate && (!field.is_input || result_.wrt.fields.contains(field.name));
  };
  const auto read = std::ranges::find_if(s.reads, may_be_written);
  if (kernel.stores.size() != 1 || read == s.reads.end()) return;
  std::string from = kernel.stores[0].field;
  for (int pass = 2, last = 2 + passes_.below(3); pass <= last; ++pass) {
    Fill fill{from, {}};
    for (const Topology topology : program_.axes)
      fill.axes.push_back({topology, {SideKind::zero_gradient}, {SideKind::value, passes_.uniform(-1.0, 2.0)}});
    Builder::fill(*find(from), fill);
    Kernel again = map_expressions(kernel, [&](const Expr& e) {
      return rename_fields(e, [&](const std::string& name) { return name == read->field ? from : name; });
    });
    again.name += fmt::format("_{}", pass);
    again.stores[0].field = from = fmt::format("{}_{}", kernel.stores[0].field, pass);
    known_.push_back({from, false, false, false, false, false, grow, grow});
    run(std::move(again), grow);
  }
}

/// Of a field at a wall: even, odd, or one on each side.
AxisBoundary Builder::mirrored(Topology topology) {
  const auto side = [&] { return ties_.percent(60) ? Side{SideKind::zero_gradient} : Side{SideKind::value, 0.0}; };
  const Side low = side();
  return {topology, low, ties_.percent(50) ? low : side()};
}

/// A kernel that chooses between neighbours, of fields with mirror images beyond the walls.
void Builder::add_ties() {
  for (Known& field : known_) {
    if (field.is_coordinate || field.is_filled || (field.grown > 0 && !may_change(field)) || !ties_.percent(80))
      continue;
    Fill fill{field.name, {}};
    for (const Topology topology : program_.axes) fill.axes.push_back(mirrored(topology));
    Builder::fill(field, fill);
  }
  const Scope readable = scope(0);
  if (readable.fields.empty()) return;
  const Expr value = tie(ties_, readable);
  if (is<Literal>(value)) return;
  const std::string made = fresh_field();
  Kernel kernel{fmt::format("ties{}", ++kernels_), rank(), {}, {}, {}, {}};
  if (ties_.percent(25)) kernel.sums.push_back({"s", tie(ties_, readable)});
  kernel.stores.push_back({made, false, access(readable.fields[0].field) + param("dt") * value, {}});
  known_.push_back({made, false, false, false, false, false, 0, 0});
  run(std::move(kernel), 0);
}

void Builder::add_statements() {
  if (ties_.percent(25)) add_ties();
  if (reductions_.percent(20)) add_reduction();
  for (Known& field : known_) {
    const bool may_fill = field.grown == 0 || may_change(field);
    if (!field.is_coordinate && !field.is_filled && may_fill && random_.percent(70)) add_fill(field);
    if (!field.is_coordinate && field.is_filled && refills_.percent(field.was_read ? 1 : 8)) add_refill(field);
  }
  int grow = has_bounded() && random_.percent(35) ? 1 + random_.below(2) : 0;
  if (scope(grow).fields.empty()) grow = 0;
  if (random_.percent(20)) add_update(grow);
  if (random_.percent(20)) add_scatter();
  if (scope(grow).fields.empty()) grow = 0;
  add_kernel(grow);
  if (passes_.percent(10)) add_passes();
  Known& last = known_.back();
  if (has_bounded() && last.grown > 0 && random_.percent(10)) add_fold(last);
}

void Builder::choose_results() {
  std::vector<std::string> states;
  for (const Known& field : known_) {
    if (field.is_input && !field.is_coordinate && !field.is_on_walls) states.push_back(field.name);
  }
  const bool has_sum = std::ranges::any_of(result_.module.kernels, [](const Kernel& k) { return !k.sums.empty(); });
  for (const Known& field : known_) {
    if (field.is_input || field.is_on_walls) continue;
    const bool is_last = &field == &known_.back() && program_.swaps.empty() && program_.keeps.empty() && !has_sum;
    if (!is_last && random_.percent(40)) continue;
    if (!states.empty() && random_.percent(50)) {
      program_.swaps.push_back({states.back(), field.name});
      states.pop_back();
    } else {
      program_.keeps.push_back(field.name);
    }
  }
}

/// The text of a program does not know fields that no kernel has.
void Builder::drop_unused() {
  std::set<std::string> used;
  for (const Kernel& kernel : result_.module.kernels) {
    const Signature s = signature(kernel);
    for (const Signature::Read& read : s.reads) used.insert(read.field);
    used.insert(s.writes.begin(), s.writes.end());
  }
  for (const Statement& statement : program_.body) {
    const Reduce* reduce = std::get_if<Reduce>(&statement);
    if (reduce) used.insert({reduce->field, reduce->result});
  }
  std::erase_if(program_.body, [&](const Statement& statement) {
    const Fill* fill = std::get_if<Fill>(&statement);
    return fill && !used.contains(fill->field);
  });
  for (Swap& swap : program_.swaps) {
    if (!used.contains(swap.state)) program_.keeps.push_back(swap.next);
  }
  std::erase_if(program_.swaps, [&](const Swap& swap) { return !used.contains(swap.state); });
}

}  // namespace

RandomProgram random_program(std::uint64_t seed) { return Builder(seed).build(); }

std::string describe(const RandomProgram& program) {
  return fmt::format("# seed {}, by fields {} and params {}, on {} cells\n{}", program.seed,
                     fmt::join(program.wrt.fields, ", "), fmt::join(program.wrt.params, ", "),
                     fmt::join(program.grid.cells.begin(), program.grid.cells.begin() + program.grid.rank, " x "),
                     print(program.module));
}

}  // namespace dpde::testing
