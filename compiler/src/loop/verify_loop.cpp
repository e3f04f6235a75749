// SPDX-License-Identifier: Apache-2.0
#include "loop/verify_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "loop/expressions.h"
#include "support/match.h"

namespace dpde::loop {

namespace {

class Verifier {
 public:
  explicit Verifier(const Module& module) : module_(module) {}

  std::vector<std::string> run() {
    check_uniforms();
    for (const Row& row : module_.rows) check_row(row);
    for (const Program& program : module_.programs) check_program(program);
    check_unique("row", module_.rows);
    check_unique("program", module_.programs);
    check_unique("uniform", module_.uniforms);
    return std::move(errors_);
  }

 private:
  void check(bool holds, std::string_view where, std::string_view what) {
    if (!holds) errors_.push_back(fmt::format("{}: {}", where, what));
  }
  static bool is_own_cell(const Stream& stream) { return stream.mode == Stream::Mode::in && stream.offset == Offset{}; }
  static bool is_index(int index, std::size_t size) { return index >= 0 && index < static_cast<int>(size); }

  template <class Named>
  void check_unique(std::string_view kind, const std::vector<Named>& all) {
    std::set<std::string> names;
    for (const Named& one : all)
      check(names.insert(one.name).second, one.name, fmt::format("two {}s of this name", kind));
  }

  void check_uniforms();
  void check_expression(const Row& row, const Expr& e, std::size_t lets);
  void check_interp(const Row& row, const Interp& i);
  void check_streams(const Row& row);
  void check_row(const Row& row);
  void check_boundaries(const Program& program, const std::string& field, const std::vector<AxisBoundary>& axes);
  void check_binding(const Program& program, const Row& row, const Binding& binding);
  void check_sweep(const Program& program, const Sweep& sweep);
  void check_reduce(const Program& program, const Reduce& reduce);
  void check_network(const Program& program, const NetworkCall& network_call);
  void check_transform(const Program& program, const Transform& transform);
  void check_operations(const Program& program, const std::vector<Operation>& operations);
  void check_solve(const Program& program, const Solve& solve);
  void check_repeat(const Program& program, const Repeat& repeat);
  void check_program(const Program& program);

  const Module& module_;
  std::vector<std::string> errors_;
};

void Verifier::check_uniforms() {
  for (std::size_t u = 0; u < module_.uniforms.size(); ++u) {
    const UniformDef& def = module_.uniforms[u];
    visit(def.value, [&](const Expr& e) {
      if (const Param* p = as<Param>(e)) {
        check(is_index(p->index, module_.params.size()), def.name, "no such parameter");
      }
      if (const Counter* c = as<Counter>(e)) {
        check(is_index(c->index, module_.counters.size()), def.name, "no such counter");
      }
      if (const Uniform* other = as<Uniform>(e)) {
        check(is_index(other->index, u), def.name, "reads a uniform that is not defined before it");
      }
      const bool varies = is<Load, Local, Inside, Interp>(e);
      check(!varies, def.name, "a uniform reads what differs from point to point");
    });
  }
}

void Verifier::check_interp(const Row& row, const Interp& i) {
  check(is_index(i.grid, row.grids.size()), row.name, "no such grid");
  check(static_cast<int>(i.displacement.size()) == row.rank, row.name, "a displacement needs one value an axis");
}

/// `lets`: number of the row's lets that are defined already.
void Verifier::check_expression(const Row& row, const Expr& e, std::size_t lets) {
  visit(e, [&](const Expr& part) {
    match(
        part->kind, ignored<Literal, Inside, Neg, Rounded, Binary, Select>,
        [&](const Uniform& u) { check(is_index(u.index, module_.uniforms.size()), row.name, "no such uniform"); },
        [&](const Param&) { check(false, row.name, "a parameter outside the definition of a uniform"); },
        [&](const Counter&) { check(false, row.name, "a counter outside the definition of a uniform"); },
        [&](const Load& l) {
          const bool exists = is_index(l.stream, row.streams.size());
          check(exists, row.name, "no such stream");
          check(!exists || row.streams[l.stream].mode != Stream::Mode::out, row.name,
                "reads a stream that is only written");
        },
        [&](const Local& l) { check(is_index(l.index, lets), row.name, "reads a let that is not defined before it"); },
        [&](const Interp& i) { check_interp(row, i); },
        [&](const Call& c) {
          check(static_cast<int>(c.arguments.size()) == arity(c.fn), row.name, "wrong number of arguments");
        });
  });
}

void Verifier::check_streams(const Row& row) {
  for (std::size_t s = 0; s < row.streams.size(); ++s) {
    const Stream& stream = row.streams[s];
    const bool is_over = stream.over >= 0 && stream.over < static_cast<int>(row.streams.size());
    check(stream.over == -1 || (is_over && stream.mode == Stream::Mode::out && is_own_cell(row.streams[stream.over])),
          row.name, fmt::format("writes {} over what it does not read at the same cell alone", stream.field));
    if (stream.mode == Stream::Mode::in) continue;
    check(stream.offset == Offset{}, row.name, fmt::format("writes {} at an offset", stream.field));
    for (std::size_t other = 0; other < row.streams.size(); ++other) {
      check(other == s || row.streams[other].field != stream.field, row.name,
            fmt::format("writes {} and has another stream of it", stream.field));
    }
    const bool is_grid = std::find(row.grids.begin(), row.grids.end(), stream.field) != row.grids.end();
    check(!is_grid, row.name, fmt::format("writes {} and reads it at computed places", stream.field));
  }
}

void Verifier::check_row(const Row& row) {
  check(row.rank >= 1 && row.rank <= max_rank, row.name, "rank must be 1, 2 or 3");
  check(static_cast<int>(row.axes.size()) == row.rank, row.name, "needs one topology an axis");
  check(row.scatters.empty() || (row.stores.empty() && row.sums.empty()), row.name, "stores and scatters in one row");
  check_streams(row);
  for (std::size_t l = 0; l < row.lets.size(); ++l) check_expression(row, row.lets[l].value, l);
  for (const Store& store : row.stores) {
    const bool exists = is_index(store.stream, row.streams.size());
    check(exists, row.name, "no such stream");
    if (!exists) continue;
    const Stream::Mode mode = row.streams[store.stream].mode;
    check(mode != Stream::Mode::in, row.name, "stores to a stream that is only read");
    check(!store.accumulate || mode == Stream::Mode::inout, row.name, "adds to a stream that is only written");
    check_expression(row, store.value, row.lets.size());
  }
  for (const Sum& sum : row.sums) check_expression(row, sum.value, row.lets.size());
  for (const Scatter& scatter : row.scatters) {
    check_interp(row, scatter.target);
    for (const Expr& d : scatter.target.displacement) check_expression(row, d, row.lets.size());
    check_expression(row, scatter.value, row.lets.size());
    if (!is_index(scatter.target.grid, row.grids.size())) continue;
    const std::string& target = row.grids[scatter.target.grid];
    const auto reads_it = [&](const Expr& e) {
      const Interp* i = as<Interp>(e);
      check(!i || i->grid != scatter.target.grid, row.name, fmt::format("reads {} while scattering to it", target));
    };
    for_each_expression(row, [&](const Expr& e) { visit(e, reads_it); });
    for (const Stream& stream : row.streams) {
      check(stream.field != target, row.name, fmt::format("reads {} while scattering to it", target));
    }
  }
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void Verifier::check_boundaries(const Program& program, const std::string& field,
                                const std::vector<AxisBoundary>& axes) {
  check(has(program.fields, field), program.name, fmt::format("no field {}", field));
  check(axes.size() == program.axes.size(), program.name, fmt::format("{} needs one boundary an axis", field));
  for (std::size_t a = 0; a < std::min(axes.size(), program.axes.size()); ++a) {
    check(axes[a].topology == program.axes[a], program.name,
          fmt::format("boundary of {} on another kind of axis", field));
    for (const Side* side : {&axes[a].low, &axes[a].high}) {
      for (const int uniform : {side->value, side->coefficients[0], side->coefficients[1]}) {
        const bool is_number = uniform == uniform_zero || (uniform == uniform_one && uniform != side->value);
        check(is_number || is_index(uniform, module_.uniforms.size()), program.name, "no such uniform");
      }
      check(side->field.empty() || has(program.fields, side->field), program.name,
            fmt::format("no field {}", side->field));
    }
  }
}

/// Two names of a row must not be bound to the same field: the row's code assumes distinct pointers.
void Verifier::check_binding(const Program& program, const Row& row, const Binding& binding) {
  std::map<std::string, std::string> name_of_field;
  const auto check_field = [&](const std::string& name) {
    const std::string& field = binding.field(name);
    check(has(program.fields, field), program.name, fmt::format("no field {}", field));
    const auto [known, is_new] = name_of_field.emplace(field, name);
    check(is_new || known->second == name, program.name,
          fmt::format("{}: {} and {} stand for the same field", row.name, known->second, name));
  };
  for (const Stream& stream : row.streams) check_field(stream.field);
  for (const std::string& grid : row.grids) check_field(grid);
  for (const Sum& sum : row.sums) {
    const std::string& name = binding.sum(sum.name);
    check(has(program.sums, name), program.name, fmt::format("no sum {}", name));
  }
  for (const int first : {row.own, row.own + binding.own}) {
    const bool exist = first >= 0 && row.row_constant_count >= 0 &&
                       static_cast<std::size_t>(first + row.row_constant_count) <= module_.uniforms.size();
    check(exist, program.name, fmt::format("{}: no such uniforms of its own", row.name));
  }
}

void Verifier::check_sweep(const Program& program, const Sweep& sweep) {
  const Row* row = module_.find_row(sweep.row);
  check(row != nullptr, program.name, fmt::format("no row {}", sweep.row));
  if (!row) return;
  check(row->rank == static_cast<int>(program.axes.size()), program.name,
        fmt::format("{} has another rank", row->name));
  check(sweep.serial == !row->scatters.empty(), program.name, fmt::format("{}: scatters run serially", row->name));
  check(sweep.grow >= 0, program.name, "negative grow");
  check_binding(program, *row, sweep.binding);
  for (const Fill& fill : sweep.then) {
    check_boundaries(program, fill.field, fill.axes);
    const bool written = std::any_of(row->streams.begin(), row->streams.end(), [&](const Stream& s) {
      return sweep.binding.field(s.field) == fill.field && s.mode != Stream::Mode::in;
    });
    check(written, program.name, fmt::format("{} fills {}, which it does not write", row->name, fill.field));
  }
}

void Verifier::check_reduce(const Program& program, const Reduce& reduce) {
  for (const std::string& field : {reduce.field, reduce.result})
    check(has(program.fields, field), program.name, fmt::format("no field {}", field));
  check(reduce.field != reduce.result, program.name, fmt::format("reduces {} to itself", reduce.field));
  for (std::size_t a = program.axes.size(); a < reduce.over.size(); ++a)
    check(!reduce.over[a], program.name, "reduces along an axis it does not have");
}

void Verifier::check_network(const Program& program, const NetworkCall& network_call) {
  const auto is_it = [&](const network::Network& n) { return n.name == network_call.network; };
  check(std::any_of(module_.networks.begin(), module_.networks.end(), is_it), program.name,
        fmt::format("no network {}", network_call.network));
  for (const auto* fields : {&network_call.inputs, &network_call.rates, &network_call.results}) {
    for (const std::string& field : *fields)
      check(field.empty() || has(program.fields, field), program.name, fmt::format("no field {}", field));
  }
}

void Verifier::check_transform(const Program& program, const Transform& transform) {
  check(has(program.fields, transform.result), program.name, fmt::format("no field {}", transform.result));
  for (std::size_t a = 0; a < transform.axes.size(); ++a) {
    const bool is_periodic = a < program.axes.size() && program.axes[a] == Topology::periodic;
    check(!transform.axes[a] || is_periodic, program.name, "transforms along an axis that is not periodic");
  }
  for (const Transform::Term& term : transform.terms) {
    check(has(program.fields, term.field), program.name, fmt::format("no field {}", term.field));
    check(term.field != transform.result, program.name, fmt::format("transforms {} to itself", term.field));
    for (const auto* symbol : {&term.by.argument, &term.by.factor}) {
      for (const Monomial& monomial : *symbol)
        check(monomial.uniform < 0 || is_index(monomial.uniform, module_.uniforms.size()), program.name,
              "no such uniform");
    }
  }
}

void Verifier::check_solve(const Program& program, const Solve& solve) {
  for (const auto* fields : {&solve.images, &solve.rights, &solve.unknowns}) {
    for (const std::string& field : *fields)
      check(has(program.fields, field), program.name, fmt::format("no field {}", field));
    check(fields->size() == solve.unknowns.size(), program.name, "solves for more fields than there are right sides");
  }
  for (const std::string& unknown : solve.unknowns)
    check(!has(solve.rights, unknown) && !has(solve.images, unknown), program.name,
          fmt::format("solves for {} in the memory of another field", unknown));
  for (const std::string& guess : solve.guesses)
    check(has(program.fields, guess) && !has(solve.unknowns, guess), program.name,
          fmt::format("begins with {}, no field or what it solves for", guess));
  if (solve.preconditioner) check_network(program, *solve.preconditioner);
  for (const std::string& field : solve.coefficients)
    check(has(program.fields, field), program.name, fmt::format("no field {}", field));
  for (const std::string& param : solve.params)
    check(has(module_.params, param) || has(module_.counters, param), program.name, fmt::format("no param {}", param));
  check_operations(program, solve.body);
  check_operations(program, solve.step);
}

void Verifier::check_repeat(const Program& program, const Repeat& repeat) {
  check(repeat.count >= 1, program.name, "a repeat without passes");
  check(repeat.counter == -1 || is_index(repeat.counter, module_.counters.size()), program.name, "no such counter");
  for (const LoopCarried& carry : repeat.carries) {
    for (const std::string& field : {carry.state, carry.next, carry.result})
      check(has(program.fields, field), program.name, fmt::format("no field {}", field));
    check(carry.state != carry.next && carry.next != carry.result && carry.state != carry.result, program.name,
          fmt::format("carries {} in one memory", carry.state));
  }
  for (const auto* all : {&repeat.saves, &repeat.loads}) {
    for (const TapeEntry& stacked : *all) {
      check(has(program.fields, stacked.field), program.name, fmt::format("no field {}", stacked.field));
      check(is_index(stacked.stack, program.stacks.size()), program.name, "no such stack");
    }
  }
  check_operations(program, repeat.body);
}

void Verifier::check_operations(const Program& program, const std::vector<Operation>& operations) {
  for (const Operation& operation : operations) {
    match(
        operation, [&](const OneOf<Fill, Fold> auto& f) { check_boundaries(program, f.field, f.axes); },
        [&](const Reduce& r) { check_reduce(program, r); }, [&](const NetworkCall& i) { check_network(program, i); },
        [&](const Transform& t) { check_transform(program, t); }, [&](const Sweep& s) { check_sweep(program, s); },
        [&](const Solve& s) { check_solve(program, s); }, [&](const Repeat& r) { check_repeat(program, r); });
  }
}

void Verifier::check_program(const Program& program) {
  check(program.input_count >= 0 && program.input_count <= static_cast<int>(program.fields.size()), program.name,
        "more inputs than fields");
  std::set<std::string> unique(program.fields.begin(), program.fields.end());
  check(unique.size() == program.fields.size(), program.name, "a field twice");
  for (const Fill& fill : program.prepare) check_boundaries(program, fill.field, fill.axes);
  check_operations(program, program.body);
  for (const Swap& swap : program.swaps) {
    check(has(program.fields, swap.state) && has(program.fields, swap.next), program.name,
          "swaps a field it does not have");
  }
  for (const std::string& name : program.keeps) {
    check(has(program.fields, name), program.name, fmt::format("keeps {}, which it does not have", name));
  }
}

}  // namespace

std::vector<std::string> verify(const Module& module) { return Verifier(module).run(); }

}  // namespace dpde::loop
