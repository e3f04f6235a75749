// SPDX-License-Identifier: Apache-2.0
#include "loop/from_stencil.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "loop/expressions.h"
#include "loop/from_stencil/rows.h"
#include "loop/from_stencil/uniforms.h"
#include "loop/overwrites.h"
#include "loop/schedule.h"
#include "loop/share_rows.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/operator_reach.h"
#include "stencil/analyse/operator_traits.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/match.h"
#include "support/names/name_supply.h"
#include "support/names/wave_names.h"

namespace dpde::loop {

namespace {

void add_once(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

/// Lets that vary in space; the others become uniforms and keep their names.
std::set<std::string> varying_lets(const stencil::Kernel& kernel) {
  std::set<std::string> varying;
  for (const stencil::Let& let : kernel.lets) {
    visit(let.value, [&](const stencil::Expr& e) {
      const stencil::Local* local = as<stencil::Local>(e);
      const bool varies =
          is<stencil::Access, stencil::Interp, stencil::Inside>(e) || (local && varying.contains(local->name));
      if (varies) varying.insert(let.name);
    });
  }
  return varying;
}

/// Names of the module, which must not get a second meaning.
NameSupply taken_names(const stencil::Module& module) {
  NameSupply taken;
  for (const stencil::Kernel& kernel : module.kernels) {
    for (const std::string& let : varying_lets(kernel)) taken.reserve(let);
    const stencil::Signature s = stencil::signature(kernel);
    for (const stencil::Signature::Read& read : s.reads) taken.reserve(read.field);
    for (const std::string& field : s.writes) taken.reserve(field);
    for (const std::string& field : s.updates) taken.reserve(field);
    for (const std::string& sum : s.sums) taken.reserve(sum);
  }
  for (const stencil::Program& program : module.programs) {
    for (const stencil::Statement& statement : program.body) {
      const stencil::Effects e = stencil::effects(module, statement);
      for (const auto* fields : {&e.reads, &e.writes, &e.updates, &e.block_locals}) {
        for (const std::string& field : *fields) taken.reserve(field);
      }
    }
  }
  return taken;
}

/// Fields that programs fill differently. Programs share their memory, halo included, so a program cannot use the halo
/// that another one has filled. (The halo of a state is filled anew for each program.)
std::set<std::string> contested_fields(const stencil::Module& module) {
  std::map<std::string, const stencil::Fill*> first;
  std::set<std::string> fields, states;
  for (const stencil::Program& program : module.programs) {
    for (const stencil::Swap& swap : program.swaps) states.insert(swap.state);
    for_each_kind<stencil::Fill>(program.body, [&](const stencil::Fill& fill) {
      if (first.try_emplace(fill.field, &fill).first->second->axes != fill.axes) fields.insert(fill.field);
    });
  }
  for (const std::string& state : states) fields.erase(state);
  return fields;
}

/// Fields with a boundary that depends on time, on the number of a pass or on fields: it changes in the next step or
/// pass.
std::set<std::string> time_dependent_fields(const stencil::Program& program, std::vector<std::string> counters) {
  std::set<std::string> fields;
  counters.push_back("t");
  for_each_kind<stencil::Fill>(program.body, [&](const stencil::Fill& fill) {
    stencil::for_each_side_value(fill.axes, [&](const stencil::Expr& value) {
      visit(value, [&](const stencil::Expr& e) {
        const stencil::Param* param = as<stencil::Param>(e);
        const bool is_time = param && contains(counters, param->name);
        if (is_time || is<stencil::Access>(e)) fields.insert(fill.field);
      });
    });
  });
  return fields;
}

class ModuleBuilder {
 public:
  ModuleBuilder(const stencil::Module& source, std::vector<std::string> params, Precision real,
                const ParamValues& values)
      : source_(source),
        uniforms_(std::move(params), taken_names(source), real, values),
        contested_(contested_fields(source)) {
    for (const stencil::Kernel& kernel : source.kernels) row_names_.reserve(kernel.name);
  }

  void add_program(const stencil::Program& program);
  Module take();

 private:
  using RowKey = std::tuple<std::string, std::vector<Topology>, int, std::vector<std::string>>;

  const std::vector<std::string>& rows_for(const stencil::Run& run, const std::vector<Topology>& axes);
  std::vector<AxisBoundary> boundaries(const std::vector<stencil::AxisBoundary>& axes, bool with_values);
  Side side(const stencil::Side& side, int axis, bool with_value);
  int uniform_of(const stencil::Expr& value);
  std::vector<Monomial> monomials(const stencil::Expr& symbol);
  ScheduleItem transform_item(const stencil::Transform& source, std::size_t rank);
  std::vector<ScheduleItem> items_of(const stencil::Program& program);
  void add_repeat(std::vector<ScheduleItem>& items, const stencil::Repeat& repeat, const stencil::Program& program);
  void add_solve(std::vector<ScheduleItem>& items, const stencil::Solve& solve, const stencil::Program& program);
  Solve solve_of(const stencil::Solve& solve, const stencil::Program& program,
                 const std::set<std::string>& filled_each_run, std::vector<Fill>& prepare);
  int stack_number(const std::string& name);
  void add_sweeps(std::vector<ScheduleItem>& items, const stencil::Run& run, const stencil::Program& program);

  const stencil::Module& source_;
  UniformTable uniforms_;
  std::set<std::string> contested_;
  NameSupply row_names_;
  std::map<RowKey, std::vector<std::string>> rows_;
  std::vector<std::string> counters_;     // of the enclosing repeats
  std::vector<std::string> stack_names_;  // of the current program
  std::vector<int> stacks_;
  Module result_;
};

/// Rows of a kernel, created at its first use; a kernel used with other axes gets separate rows, NAME_2.
const std::vector<std::string>& ModuleBuilder::rows_for(const stencil::Run& run, const std::vector<Topology>& axes) {
  const stencil::Kernel* kernel = source_.find_kernel(run.kernel);
  require(kernel != nullptr, "a program runs a kernel of its module");
  std::vector<std::string> counters;
  for (const std::string& param : stencil::signature(*kernel).params) {
    if (contains(counters_, param)) counters.push_back(param);
  }
  const bool specific = depends_on_axes(*kernel);
  const RowKey key = specific ? RowKey{run.kernel, axes, run.grow, counters} : RowKey{run.kernel, {}, 0, counters};
  const auto found = rows_.find(key);
  if (found != rows_.end()) return found->second;

  const bool first = std::none_of(rows_.begin(), rows_.end(),
                                  [&](const auto& entry) { return std::get<0>(entry.first) == run.kernel; });
  stencil::Kernel named = *kernel;
  if (!first) named.name = row_names_.fresh(kernel->name);
  std::vector<std::string> names;
  for (Row& row : rows_of(named, axes, run.grow, uniforms_)) {
    names.push_back(row.name);
    result_.rows.push_back(std::move(row));
  }
  return rows_.emplace(key, std::move(names)).first->second;
}

int ModuleBuilder::uniform_of(const stencil::Expr& value) {
  const Expr definition = uniform_definition(value, uniforms_);
  return is_literal(definition, 0) ? uniform_zero : uniforms_.index_of(definition);
}

Side ModuleBuilder::side(const stencil::Side& side, int axis, bool with_value) {
  Side result{&stencil::rule_of(side)};
  const std::string* wall = stencil::wall_field(side);
  if (wall) result.field = *wall;
  if (!wall && with_value) result.value = uniform_of(side.value);
  std::ranges::transform(stencil::coefficients_of(side), result.coefficients.begin(), [&](const auto& coefficient) {
    const stencil::Expr& value = coefficient.value;
    if (coefficient.per_spacing) return uniform_of(value / stencil::param(std::string("h") + "xyz"[axis]));
    return is_literal(value, 1) ? uniform_one : uniform_of(value);
  });
  return result;
}

/// `with_values` false: the linear part only, as a fold needs.
std::vector<AxisBoundary> ModuleBuilder::boundaries(const std::vector<stencil::AxisBoundary>& axes, bool with_values) {
  std::vector<AxisBoundary> result;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const stencil::AxisBoundary& axis = axes[a];
    if (axis.topology == Topology::periodic) {
      result.push_back({axis.topology, {}, {}});
    } else {
      const int number = static_cast<int>(a);
      result.push_back({axis.topology, side(axis.low, number, with_values), side(axis.high, number, with_values)});
    }
  }
  return result;
}

void ModuleBuilder::add_sweeps(std::vector<ScheduleItem>& items, const stencil::Run& run,
                               const stencil::Program& program) {
  for (const std::string& name : rows_for(run, program.axes)) {
    const Row& row = *result_.find_row(name);
    ScheduleItem item{Sweep{name, run.grow, !row.scatters.empty(), {}}, {}, {}};
    for (const Stream& stream : row.streams) {
      item.touched.insert(stream.field);
      if (stream.mode != Stream::Mode::in) item.modified.insert(stream.field);
    }
    item.touched.insert(row.grids.begin(), row.grids.end());
    for (const Scatter& scatter : row.scatters) item.modified.insert(row.grids[scatter.target.grid]);
    items.push_back(std::move(item));
  }
}

ScheduleItem item_of(const NetworkCall& network_call) {
  const std::vector<std::string> read = network::fields_read(network_call),
                                 written = network::fields_written(network_call);
  std::set<std::string> modified(written.begin(), written.end()), touched = modified;
  touched.insert(read.begin(), read.end());
  return {network_call, std::move(modified), std::move(touched)};
}

/// Monomials in angles: the uniforms contain the spacings.
std::vector<Monomial> ModuleBuilder::monomials(const stencil::Expr& symbol) {
  const auto polynomial = stencil::polynomial_of(symbol);
  require(polynomial.has_value(), "a polynomial of wave numbers");
  std::vector<Monomial> result;
  for (const stencil::Monomial& term : *polynomial) {
    stencil::Expr coefficient = term.coefficient;
    for (int axis = 0; axis < max_rank; ++axis) {
      const int n = term.powers[static_cast<std::size_t>(axis)];
      const stencil::Expr h = stencil::param(std::string("h") + "xyz"[axis]);
      if (n > 0) coefficient = coefficient / (n == 1 ? h : stencil::power(h, n));
    }
    std::array<int, max_rank> powers = term.powers;
    for (std::size_t axis = 0; axis < powers.size(); ++axis)
      powers[axis] += term.vanishes[axis] ? vanishes_for_shortest : 0;
    result.push_back({is_literal(coefficient, 1) ? uniform_one : uniform_of(coefficient), powers});
  }
  return result;
}

ScheduleItem ModuleBuilder::transform_item(const stencil::Transform& source, std::size_t rank) {
  Transform transform{{}, source.result, stencil::axes_of(source, rank)};
  std::set<std::string> touched{source.result};
  for (const stencil::Transform::Term& term : source.terms) {
    touched.insert(term.field);
    Multiplier by{term.by.function, {}, monomials(term.by.factor), term.by.within_two_thirds};
    if (term.by.function) by.argument = monomials(term.by.argument);
    transform.terms.push_back({term.field, std::move(by)});
  }
  return {std::move(transform), {source.result}, std::move(touched)};
}

std::vector<ScheduleItem> ModuleBuilder::items_of(const stencil::Program& program) {
  std::vector<ScheduleItem> items;
  for (const stencil::Statement& statement : program.body) {
    match(
        statement,
        [&](const stencil::Fill& f) {
          std::set<std::string> touched = stencil::wall_fields(f.axes);
          touched.insert(f.field);
          items.push_back({Fill{f.field, boundaries(f.axes, true)}, {}, std::move(touched)});
        },
        [&](const stencil::Fold& f) {
          std::set<std::string> modified = stencil::wall_fields(f.axes);
          modified.insert(f.field);
          items.push_back({Fold{f.field, f.grow, boundaries(f.axes, false)}, modified, modified});
        },
        [&](const stencil::Reduce& r) {
          items.push_back({Reduce{r.result, r.kind, r.field, r.over}, {r.result}, {r.field, r.result}});
        },
        [&](const NetworkCall& i) { items.push_back(item_of(i)); },
        [&](const stencil::Transform& t) { items.push_back(transform_item(t, program.axes.size())); },
        [&](const stencil::Run& run) { add_sweeps(items, run, program); },
        [&](const stencil::Solve& solve) { add_solve(items, solve, program); },
        [&](const stencil::Repeat& repeat) { add_repeat(items, repeat, program); });
  }
  return items;
}

int ModuleBuilder::stack_number(const std::string& name) {
  const auto known = std::ranges::find(stack_names_, name);
  const auto number = static_cast<int>(known - stack_names_.begin());
  if (known != stack_names_.end()) return number;
  stack_names_.push_back(name);
  stacks_.push_back(0);
  return number;
}

/// A pass is scheduled as a program that runs many times: its prepared inputs are filled before the repeat.
void ModuleBuilder::add_repeat(std::vector<ScheduleItem>& items, const stencil::Repeat& repeat,
                               const stencil::Program& program) {
  const stencil::Program pass = stencil::pass_of(repeat, program);
  const stencil::Effects known = stencil::effects(source_, repeat);
  Repeat result{repeat.count, {}, {}, {}, {}};
  const bool counts = !repeat.counter.name.empty();
  if (counts) {
    result.counter = uniforms_.counter(repeat.counter.name);
    result.is_backwards = repeat.counter.is_backwards;
    counters_.push_back(repeat.counter.name);
    uniforms_.set_counters(counters_);
  }
  ScheduleInput input{items_of(pass), known.reads, {}, program.axes, time_dependent_fields(pass, counters_)};
  for (const stencil::LoopCarried& carry : repeat.carries) {
    result.carries.push_back({carry.state, carry.next, carry.result});
    input.swaps.push_back({carry.state, carry.next});
  }
  for (const stencil::TapeEntry& load : repeat.loads) result.loads.push_back({load.field, stack_number(load.stack)});
  for (const stencil::TapeEntry& save : repeat.saves) {
    const auto is_it = [&](const auto& other) { return other.field == save.field; };
    const bool has_memory = std::ranges::any_of(repeat.loads, is_it) || std::ranges::any_of(result.saves, is_it);
    const int number = stack_number(save.stack), first = contains(known.reads, save.field) ? 1 : 0;
    stacks_[static_cast<std::size_t>(number)] = has_memory ? 0 : repeat.count - first;
    result.saves.push_back({save.field, number});
  }
  input.filled_each_run.insert(contested_.begin(), contested_.end());
  Schedule scheduled = schedule(std::move(input));
  for (Fill& fill : scheduled.prepare) items.push_back({fill, {}, {fill.field}});
  result.body = std::move(scheduled.body);
  if (counts) counters_.pop_back();
  uniforms_.set_counters(counters_);
  std::set<std::string> modified(known.writes.begin(), known.writes.end());
  modified.insert(known.invalidates_halo.begin(), known.invalidates_halo.end());
  for (const Fill& fill : scheduled.prepare) modified.erase(fill.field);
  std::set<std::string> touched = modified;
  touched.insert(known.reads.begin(), known.reads.end());
  items.push_back({std::move(result), std::move(modified), std::move(touched)});
}

/// The operator is scheduled as a program that runs many times with other unknowns; fills of its other inputs go to
/// `prepare`. The operator of a Newton step also reads the unknowns of the outer solve, which change with each step.
Solve ModuleBuilder::solve_of(const stencil::Solve& solve, const stencil::Program& program,
                              const std::set<std::string>& filled_each_run, std::vector<Fill>& prepare) {
  const stencil::Program block = stencil::operator_of(solve, program);
  Solve result{solve.images,
               solve.rights,
               solve.unknowns,
               {},
               solve.by,
               stencil::reach_of_operator(source_, solve, program.axes.size()),
               stencil::coefficients_of(source_, solve),
               stencil::effects(source_, solve).params,
               solve.is_linear,
               {},
               solve.guesses,
               solve.preconditioner,
               stencil::certain_traits_of(source_, program, solve)};
  ScheduleInput input{items_of(block), result.coefficients, {}, program.axes, time_dependent_fields(block, counters_)};
  input.filled_each_run.insert(contested_.begin(), contested_.end());
  input.filled_each_run.insert(filled_each_run.begin(), filled_each_run.end());
  Schedule scheduled = schedule(std::move(input));
  result.body = std::move(scheduled.body);
  prepare.insert(prepare.end(), scheduled.prepare.begin(), scheduled.prepare.end());
  for (const stencil::Statement& step : solve.step)
    result.step.emplace_back(
        solve_of(std::get<stencil::Solve>(step), program, {solve.unknowns.begin(), solve.unknowns.end()}, prepare));
  return result;
}

void ModuleBuilder::add_solve(std::vector<ScheduleItem>& items, const stencil::Solve& solve,
                              const stencil::Program& program) {
  const stencil::Effects known = stencil::effects(source_, solve);
  std::vector<Fill> prepare;
  Solve result = solve_of(solve, program, {}, prepare);
  std::set<std::string> modified(known.writes.begin(), known.writes.end()),
      touched(known.reads.begin(), known.reads.end());
  modified.insert(known.invalidates_halo.begin(), known.invalidates_halo.end());
  for (Fill& fill : prepare) {
    modified.erase(fill.field);
    items.push_back({fill, {}, {fill.field}});
  }
  touched.insert(modified.begin(), modified.end());
  items.push_back({std::move(result), std::move(modified), std::move(touched)});
}

/// Inputs first, then the fields that the program writes, then fields that occur in swaps and keeps only.
void set_fields(Program& result, const stencil::Program& program, const stencil::Interface& known) {
  result.fields = known.inputs;
  const auto is_written = [&](const std::string& name) {
    return std::find(known.written.begin(), known.written.end(), name) != known.written.end();
  };
  for (const stencil::Swap& swap : program.swaps) {
    for (const std::string& name : {swap.state, swap.next}) {
      if (!is_written(name)) add_once(result.fields, name);
    }
  }
  for (const std::string& name : program.keeps) {
    if (!is_written(name)) add_once(result.fields, name);
  }
  result.input_count = static_cast<int>(result.fields.size());
  for (const std::string& name : known.written) add_once(result.fields, name);
}

void set_halo(Program& result, const stencil::Module& module, const stencil::Program& program) {
  for (const auto& [field, needed] : stencil::required_halo(module, program)) {
    for (int axis = 0; axis < max_rank; ++axis) result.halo[axis] = std::max(result.halo[axis], needed[axis]);
  }
}

void ModuleBuilder::add_program(const stencil::Program& program) {
  const stencil::Interface known = stencil::interface_of(source_, program);
  Program result{.name = program.name, .axes = program.axes};
  stack_names_.clear();
  stacks_.clear();
  set_fields(result, program, known);
  set_halo(result, source_, program);
  result.sums = known.sums;
  for (const stencil::Swap& swap : program.swaps) result.swaps.push_back({swap.state, swap.next});
  result.keeps = program.keeps;

  std::set<std::string> filled_each_run = time_dependent_fields(program, stencil::counters_of(program.body));
  filled_each_run.insert(contested_.begin(), contested_.end());
  Schedule scheduled =
      schedule({items_of(program), known.inputs, result.swaps, program.axes, std::move(filled_each_run)});
  result.prepare = std::move(scheduled.prepare);
  result.body = std::move(scheduled.body);
  result.stacks = stacks_;
  result_.programs.push_back(std::move(result));
}

Module ModuleBuilder::take() {
  result_.params = uniforms_.params();
  result_.counters = uniforms_.counters();
  result_.uniforms = uniforms_.take();
  return std::move(result_);
}

}  // namespace

Module from_stencil(const stencil::Module& module, const std::vector<std::string>& programs, Precision real,
                    const ParamValues& values) {
  std::vector<const stencil::Program*> chosen;
  std::vector<std::string> params;
  for (const std::string& name : programs) {
    const stencil::Program* program = module.find_program(name);
    require(program != nullptr, "the program is in the module");
    chosen.push_back(program);
    for (const std::string& param : stencil::interface_of(module, *program).params) add_once(params, param);
  }
  ModuleBuilder builder(module, std::move(params), real, values);
  for (const stencil::Program* program : chosen) builder.add_program(*program);
  Module result = builder.take();
  result.real = real;
  result.networks = module.networks;
  return find_overwrites(share_rows(std::move(result)));
}

}  // namespace dpde::loop
