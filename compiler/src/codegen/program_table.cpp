// SPDX-License-Identifier: Apache-2.0
#include "codegen/program_table.h"

#include <algorithm>
#include <deque>
#include <utility>

#include "codegen/network_table.h"
#include "dpde/wave_functions.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/names/wave_names.h"

namespace dpde::codegen {

namespace {

/// A list of strings with the array of pointers that the ABI needs.
struct Names {
  explicit Names(std::vector<std::string> given) : names(std::move(given)) {
    for (const std::string& name : names) pointers.push_back(name.c_str());
  }
  Names(const Names&) = delete;
  int32_t count() const { return static_cast<int32_t>(names.size()); }
  int32_t find(const std::string& name) const {
    const auto found = std::find(names.begin(), names.end(), name);
    return found == names.end() ? -1 : static_cast<int32_t>(found - names.begin());
  }
  int32_t index_of(const std::string& name) const {
    const int32_t index = find(name);
    require(index >= 0, "the program knows the name");
    return index;
  }

  std::vector<std::string> names;
  std::vector<const char*> pointers;
};

struct KernelStorage {
  std::string name;
  loop::Binding binding;
  std::vector<dpde_stream> streams;
  std::vector<dpde_grid> grids;
  std::vector<int32_t> sums;
  RowCode code;
};

dpde_ghost_number table_of(const GhostNumber& number) { return {number.fixed, number.per_distance}; }

dpde_ghost_row table_of(const GhostRow& row) {
  dpde_ghost_row result{{}, table_of(row.rate), row.first, row.step};
  std::ranges::transform(row.terms, result.terms, [](const GhostRow::Term& term) {
    return dpde_ghost_term{table_of(term.ghost), table_of(term.mirror), table_of(term.second)};
  });
  return result;
}

dpde_ghost_rows table_of(const GhostRows& rows) { return {table_of(rows.row), rows.least, table_of(rows.of_few)}; }

dpde_rule table_of(const GhostRule& rule) {
  return {rule.on_walls ? 1 : 0, rule.turns ? 1 : 0, table_of(rule.wall), table_of(rule.beyond)};
}

static_assert(DPDE_SIDE_COEFFICIENTS == side_coefficients);
static_assert(DPDE_ZERO == loop::uniform_zero && DPDE_ONE == loop::uniform_one);

int32_t kind_of(Reduction reduction) {
  switch (reduction) {
    case Reduction::mean: return DPDE_MEAN;
    case Reduction::sum: return DPDE_SUM;
    case Reduction::max: return DPDE_MAX;
    case Reduction::min: return DPDE_MIN;
  }
  unreachable("kind of reduction");
}

int32_t kind_of(SolveMethod method) {
  switch (method) {
    case SolveMethod::automatic: return DPDE_SOLVE_AUTOMATIC;
    case SolveMethod::direct: return DPDE_SOLVE_DIRECT;
    case SolveMethod::tridiagonal: return DPDE_SOLVE_TRIDIAGONAL;
    case SolveMethod::fourier: return DPDE_SOLVE_FOURIER;
    case SolveMethod::multigrid: return DPDE_SOLVE_MULTIGRID;
    case SolveMethod::cg: return DPDE_SOLVE_CG;
    case SolveMethod::bicgstab: return DPDE_SOLVE_BICGSTAB;
    case SolveMethod::gmres: return DPDE_SOLVE_GMRES;
  }
  unreachable("kind of solve");
}

int32_t kind_of(Preconditioner preconditioner) {
  switch (preconditioner) {
    case Preconditioner::automatic: return DPDE_PRECONDITIONER_AUTOMATIC;
    case Preconditioner::multigrid: return DPDE_PRECONDITIONER_MULTIGRID;
    case Preconditioner::none: return DPDE_PRECONDITIONER_NONE;
  }
  unreachable("kind of preconditioner");
}

int32_t kind_of(Smoother smoother) {
  switch (smoother) {
    case Smoother::automatic: return DPDE_SMOOTHER_AUTOMATIC;
    case Smoother::red_black: return DPDE_SMOOTHER_RED_BLACK;
    case Smoother::jacobi: return DPDE_SMOOTHER_JACOBI;
    case Smoother::chebyshev: return DPDE_SMOOTHER_CHEBYSHEV;
  }
  unreachable("kind of smoother");
}

int32_t mode_of(loop::Stream::Mode mode) {
  switch (mode) {
    case loop::Stream::Mode::in: return 0;
    case loop::Stream::Mode::out: return 1;
    case loop::Stream::Mode::inout: return 2;
  }
  unreachable("mode of stream");
}

constexpr dpde_side periodic{nullptr, {DPDE_ZERO, DPDE_ZERO}, DPDE_ZERO, -1};

}  // namespace

struct ProgramTables::Strings {
  explicit Strings(const loop::Module& module) : params(module.params) {
    for (const network::Network& network : module.networks) networks.emplace_back(network);
  }
  const dpde_rule* rule(const GhostRule* source) {
    const auto found = std::ranges::find(rules, source, [](const auto& known) { return known.first; });
    return found == rules.end() ? &rules.emplace_back(source, table_of(*source)).second : &found->second;
  }
  Names params;
  std::deque<NetworkTable> networks;
  std::deque<std::pair<const GhostRule*, dpde_rule>> rules;
};

/// One program with all arrays of its struct.
struct ProgramTables::Table {
  Table(const loop::Module& module, const loop::Program& program, const RowResolver& row_code, Strings& shared,
        ComputeUniforms compute_uniforms, ComputeUniforms compute_counted);

  dpde_fill fill(const std::string& field, const std::vector<loop::AxisBoundary>& axes, Strings& shared) const;
  void set_grow(dpde_operation& operation, int grow, const std::vector<Topology>& axes) const;
  dpde_operation operation(const loop::Module& module, const loop::Program& program, const loop::Operation& source,
                           const RowResolver& row_code, Strings& shared);
  int32_t kernel(const loop::Module& module, const loop::Sweep& sweep, const RowResolver& row_code);
  dpde_inference inference(const loop::NetworkCall& network_call, const Strings& shared);
  dpde_symbol symbol(const std::vector<loop::Monomial>& source);
  dpde_transform transform(const loop::Transform& source);
  dpde_solve solve(const loop::Module& module, const loop::Program& program, const loop::Solve& source,
                   const RowResolver& row_code, Strings& shared);
  dpde_repeat repeat(const loop::Module& module, const loop::Program& program, const loop::Repeat& source,
                     const RowResolver& row_code, Strings& shared);
  void set_links(const std::vector<TableLink>& given, const Names& params);

  std::string name;
  Names fields, sums;
  std::deque<KernelStorage> kernel_storage;
  std::deque<std::vector<dpde_fill>> fills;
  std::vector<dpde_kernel> kernels;
  std::vector<dpde_fill> prepare;
  std::vector<dpde_operation> operations;
  std::vector<dpde_swap> swaps;
  std::deque<std::vector<int32_t>> lists;
  std::deque<dpde_solve> steps;
  std::deque<dpde_inference> inferences;  // for preconditioners
  std::deque<std::vector<dpde_monomial>> symbols;
  std::deque<std::vector<dpde_transform_term>> transform_terms;
  std::deque<std::vector<dpde_operation>> blocks;
  std::deque<std::vector<dpde_carry>> carries;
  std::deque<std::vector<dpde_stacked>> stacked;
  std::vector<int64_t> stacks;
  std::vector<const dpde_network*> networks;
  std::deque<std::string> primals;
  std::vector<dpde_link> links;
  dpde_program program{};
};

dpde_fill ProgramTables::Table::fill(const std::string& field, const std::vector<loop::AxisBoundary>& axes,
                                     Strings& shared) const {
  dpde_fill result{fields.index_of(field), {{periodic, periodic}, {periodic, periodic}, {periodic, periodic}}};
  const auto side = [&](const loop::Side& s) {
    const int32_t field = s.field.empty() ? -1 : fields.index_of(s.field);
    return dpde_side{shared.rule(s.rule), {s.coefficients[0], s.coefficients[1]}, s.value, field};
  };
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (axes[a].topology == Topology::periodic) continue;
    result.axes[a] = {side(axes[a].low), side(axes[a].high)};
  }
  return result;
}

void ProgramTables::Table::set_grow(dpde_operation& operation, int grow, const std::vector<Topology>& axes) const {
  for (std::size_t a = 0; a < axes.size(); ++a) operation.grow[a] = axes[a] == Topology::bounded ? grow : 0;
}

/// Index of the kernel (a row with its bindings), added at its first use.
int32_t ProgramTables::Table::kernel(const loop::Module& module, const loop::Sweep& sweep,
                                     const RowResolver& row_code) {
  const loop::Binding& binding = sweep.binding;
  const auto same = [&](const KernelStorage& known) { return known.name == sweep.row && known.binding == binding; };
  const auto found = std::find_if(kernel_storage.begin(), kernel_storage.end(), same);
  if (found != kernel_storage.end()) return static_cast<int32_t>(found - kernel_storage.begin());

  const loop::Row* source = module.find_row(sweep.row);
  require(source != nullptr, "the row is in the module");
  KernelStorage& storage = kernel_storage.emplace_back();
  storage.name = sweep.row;
  storage.binding = binding;
  for (const loop::Stream& s : source->streams) {
    storage.streams.push_back(
        {fields.index_of(binding.field(s.field)), {s.offset[0], s.offset[1], s.offset[2]}, mode_of(s.mode)});
  }
  for (const std::string& grid : source->grids) storage.grids.push_back({fields.index_of(binding.field(grid)), 0});
  for (const loop::Scatter& scatter : source->scatters)
    storage.grids[static_cast<std::size_t>(scatter.target.grid)].is_written = 1;
  for (const loop::Sum& sum : source->sums) storage.sums.push_back(sums.index_of(binding.sum(sum.name)));
  if (row_code) storage.code = row_code(sweep.row);
  kernels.push_back({storage.name.c_str(), storage.code.row, static_cast<int32_t>(storage.streams.size()),
                     storage.streams.data(), static_cast<int32_t>(storage.grids.size()), storage.grids.data(),
                     static_cast<int32_t>(storage.sums.size()), storage.sums.data(),
                     static_cast<int32_t>(storage.code.variants.size()), storage.code.variants.data(),
                     source->own + binding.own});
  return static_cast<int32_t>(kernels.size()) - 1;
}

namespace {

int32_t mode_of(loop::NetworkCall::Mode mode) {
  switch (mode) {
    case loop::NetworkCall::Mode::value: return DPDE_NETWORK_VALUE;
    case loop::NetworkCall::Mode::tangent: return DPDE_NETWORK_TANGENT;
    case loop::NetworkCall::Mode::adjoint: return DPDE_NETWORK_ADJOINT;
    case loop::NetworkCall::Mode::second: return DPDE_NETWORK_SECOND;
  }
  unreachable("mode of a network");
}

}  // namespace

dpde_inference ProgramTables::Table::inference(const loop::NetworkCall& network_call, const Strings& shared) {
  const auto list = [&](const std::vector<std::string>& names) {
    std::vector<int32_t>& indices = lists.emplace_back();
    for (const std::string& field : names) indices.push_back(field.empty() ? -1 : fields.index_of(field));
    return indices.data();
  };
  const auto is_it = [&](const NetworkTable& table) { return table.name() == network_call.network; };
  const dpde_network* network = std::find_if(shared.networks.begin(), shared.networks.end(), is_it)->get();
  auto place = std::find(networks.begin(), networks.end(), network);
  if (place == networks.end()) place = networks.insert(place, network);
  return dpde_inference{static_cast<int32_t>(place - networks.begin()),
                        mode_of(network_call.mode),
                        list(network_call.inputs),
                        list(network_call.rates),
                        list(network_call.results),
                        network_call.weights};
}

static_assert(vanishing_power == vanishes_for_shortest);

dpde_symbol ProgramTables::Table::symbol(const std::vector<loop::Monomial>& source) {
  std::vector<dpde_monomial>& monomials = symbols.emplace_back();
  for (const loop::Monomial& m : source) monomials.push_back({m.uniform, {m.powers[0], m.powers[1], m.powers[2]}});
  return {static_cast<int32_t>(monomials.size()), monomials.data()};
}

dpde_transform ProgramTables::Table::transform(const loop::Transform& source) {
  std::vector<dpde_transform_term>& terms = transform_terms.emplace_back();
  for (const auto& [field, by] : source.terms)
    terms.push_back({fields.index_of(field), static_cast<int32_t>(by.function.kind), by.function.number,
                     symbol(by.argument), symbol(by.factor), by.within_two_thirds});
  return {static_cast<int32_t>(terms.size()),
          terms.data(),
          fields.index_of(source.result),
          {source.axes[0], source.axes[1], source.axes[2]}};
}

dpde_operation ProgramTables::Table::operation(const loop::Module& module, const loop::Program& program,
                                               const loop::Operation& source, const RowResolver& row_code,
                                               Strings& shared) {
  dpde_operation result{};
  match(
      source,
      [&](const loop::Fill& f) {
        result.kind = DPDE_FILL;
        result.fill = fill(f.field, f.axes, shared);
      },
      [&](const loop::Fold& f) {
        result.kind = DPDE_FOLD;
        result.fill = fill(f.field, f.axes, shared);
        set_grow(result, f.grow, program.axes);
      },
      [&](const loop::Reduce& r) {
        result.kind = DPDE_REDUCE;
        result.reduce = {
            kind_of(r.kind), fields.index_of(r.field), fields.index_of(r.result), {r.over[0], r.over[1], r.over[2]}};
      },
      [&](const loop::NetworkCall& i) {
        result.kind = DPDE_NETWORK;
        result.inference = inference(i, shared);
      },
      [&](const loop::Transform& t) {
        result.kind = DPDE_TRANSFORM;
        result.transform = transform(t);
      },
      [&](const loop::Sweep& s) {
        result.kind = DPDE_SWEEP;
        result.kernel = kernel(module, s, row_code);
        set_grow(result, s.grow, program.axes);
        result.serial = s.serial;
        std::vector<dpde_fill>& then = fills.emplace_back();
        for (const loop::Fill& f : s.then) then.push_back(fill(f.field, f.axes, shared));
        result.then_count = static_cast<int32_t>(then.size());
        result.then = then.data();
      },
      [&](const loop::Solve& s) {
        result.kind = DPDE_SOLVE;
        result.solve = solve(module, program, s, row_code, shared);
      },
      [&](const loop::Repeat& r) {
        result.kind = DPDE_REPEAT;
        result.repeat = repeat(module, program, r, row_code, shared);
      });
  return result;
}

dpde_solve ProgramTables::Table::solve(const loop::Module& module, const loop::Program& program,
                                       const loop::Solve& source, const RowResolver& row_code, Strings& shared) {
  std::vector<dpde_operation> made;
  for (const loop::Operation& o : source.body) made.push_back(operation(module, program, o, row_code, shared));
  const std::vector<dpde_operation>& block = blocks.emplace_back(std::move(made));
  std::vector<int32_t>& coefficients = lists.emplace_back();
  for (const std::string& field : source.coefficients) coefficients.push_back(fields.index_of(field));
  std::vector<int32_t>& params = lists.emplace_back();
  for (const std::string& name : source.params) {
    const auto counter = std::ranges::find(module.counters, name);
    const bool is_counter = counter != module.counters.end();
    params.push_back(is_counter ? shared.params.count() + static_cast<int32_t>(counter - module.counters.begin())
                                : shared.params.index_of(name));
  }
  const auto indices = [&](const std::vector<std::string>& names) {
    std::vector<int32_t>& list = lists.emplace_back();
    for (const std::string& name : names) list.push_back(fields.index_of(name));
    return list.data();
  };
  const dpde_solve* step = nullptr;
  for (const loop::Operation& one : source.step)
    step = &steps.emplace_back(solve(module, program, std::get<loop::Solve>(one), row_code, shared));
  const dpde_inference* preconditioner =
      source.preconditioner ? &inferences.emplace_back(inference(*source.preconditioner, shared)) : nullptr;
  return {static_cast<int32_t>(source.unknowns.size()),
          indices(source.images),
          indices(source.rights),
          indices(source.unknowns),
          static_cast<int32_t>(block.size()),
          block.data(),
          kind_of(source.by.method),
          kind_of(source.by.smoother),
          source.by.tolerance,
          source.by.most_iterations,
          source.by.warns,
          {source.reach[0], source.reach[1], source.reach[2]},
          static_cast<int32_t>(coefficients.size()),
          coefficients.data(),
          static_cast<int32_t>(params.size()),
          params.data(),
          source.is_linear,
          step,
          kind_of(source.by.preconditioner),
          static_cast<int32_t>(source.guesses.size()),
          indices(source.guesses),
          preconditioner,
          source.traits.is_symmetric,
          source.traits.takes_constants_to_zero,
          source.traits.sums_to_zero};
}

dpde_repeat ProgramTables::Table::repeat(const loop::Module& module, const loop::Program& program,
                                         const loop::Repeat& source, const RowResolver& row_code, Strings& shared) {
  std::vector<dpde_operation>& block = blocks.emplace_back();
  for (const loop::Operation& o : source.body) block.push_back(operation(module, program, o, row_code, shared));
  std::vector<dpde_carry>& carried = carries.emplace_back();
  for (const loop::LoopCarried& c : source.carries)
    carried.push_back({fields.index_of(c.state), fields.index_of(c.next), fields.index_of(c.result)});
  const auto stacked_fields = [&](const std::vector<loop::TapeEntry>& all) -> const std::vector<dpde_stacked>& {
    std::vector<dpde_stacked>& list = stacked.emplace_back();
    for (const loop::TapeEntry& s : all) list.push_back({fields.index_of(s.field), s.stack});
    return list;
  };
  const std::vector<dpde_stacked>&saves = stacked_fields(source.saves), &loads = stacked_fields(source.loads);
  const auto size = [](const auto& list) { return static_cast<int32_t>(list.size()); };
  return {source.count,
          size(block),
          block.data(),
          size(carried),
          carried.data(),
          size(saves),
          saves.data(),
          size(loads),
          loads.data(),
          std::max(source.counter, 0),
          source.is_backwards ? source.count - 1 : 0,
          source.counter < 0    ? 0
          : source.is_backwards ? -1
                                : 1};
}

void ProgramTables::Table::set_links(const std::vector<TableLink>& given, const Names& params) {
  for (const TableLink& link : given) {
    const Names& names = link.derived_kind == DPDE_LINK_FIELD   ? fields
                         : link.derived_kind == DPDE_LINK_PARAM ? params
                                                                : sums;
    links.push_back(
        {link.kind, primals.emplace_back(link.primal).c_str(), link.derived_kind, names.find(link.derived)});
  }
  program.link_count = static_cast<int32_t>(links.size());
  program.links = links.data();
}

ProgramTables::Table::Table(const loop::Module& module, const loop::Program& source, const RowResolver& row_code,
                            Strings& shared, ComputeUniforms compute_uniforms, ComputeUniforms compute_counted)
    : name(source.name), fields(source.fields), sums(source.sums) {
  for (const loop::Fill& f : source.prepare) prepare.push_back(fill(f.field, f.axes, shared));
  for (const loop::Operation& o : source.body) operations.push_back(operation(module, source, o, row_code, shared));
  for (const loop::Swap& s : source.swaps)
    swaps.push_back({fields.index_of(s.state), fields.index_of(s.next), s.is_over ? 1 : 0});

  program.version = DPDE_ABI_VERSION;
  program.name = name.c_str();
  program.rank = static_cast<int32_t>(source.axes.size());
  program.real = module.real == Precision::f32 ? DPDE_F32 : DPDE_F64;
  std::copy(source.halo.begin(), source.halo.end(), program.halo);
  program.field_count = fields.count();
  program.input_count = source.input_count;
  program.fields = fields.pointers.data();
  program.param_count = shared.params.count();
  program.params = shared.params.pointers.data();
  program.uniform_count = static_cast<int32_t>(module.uniforms.size());
  program.counter_count = static_cast<int32_t>(module.counters.size());
  program.compute_uniforms = compute_uniforms;
  program.compute_counted = module.counters.empty() ? nullptr : compute_counted;
  program.sum_count = sums.count();
  program.sums = sums.pointers.data();
  program.kernel_count = static_cast<int32_t>(kernels.size());
  program.kernels = kernels.data();
  program.prepare_count = static_cast<int32_t>(prepare.size());
  program.prepare = prepare.data();
  program.operation_count = static_cast<int32_t>(operations.size());
  program.operations = operations.data();
  stacks.assign(source.stacks.begin(), source.stacks.end());
  program.stack_count = static_cast<int32_t>(stacks.size());
  program.stacks = stacks.data();
  program.swap_count = static_cast<int32_t>(swaps.size());
  program.swaps = swaps.data();
  program.network_count = static_cast<int32_t>(networks.size());
  program.networks = networks.data();
}

ProgramTables::ProgramTables(const loop::Module& module, const RowResolver& row_code, ComputeUniforms compute_uniforms,
                             ComputeUniforms compute_counted)
    : strings_(std::make_unique<Strings>(module)) {
  for (const loop::Program& program : module.programs) {
    tables_.push_back(std::make_unique<Table>(module, program, row_code, *strings_, compute_uniforms, compute_counted));
  }
}

ProgramTables::~ProgramTables() = default;
ProgramTables::ProgramTables(ProgramTables&&) noexcept = default;
ProgramTables& ProgramTables::operator=(ProgramTables&&) noexcept = default;

const dpde_program* ProgramTables::find(const std::string& name) const {
  for (const auto& table : tables_) {
    if (table->name == name) return &table->program;
  }
  return nullptr;
}

std::vector<std::string> ProgramTables::names() const {
  std::vector<std::string> names;
  for (const auto& table : tables_) names.push_back(table->name);
  return names;
}

void ProgramTables::set_links(const std::string& program, const std::vector<TableLink>& links) {
  for (const auto& table : tables_) {
    if (table->name == program) return table->set_links(links, strings_->params);
  }
  unreachable("the program is in the tables");
}

void ProgramTables::set_interpreter(const std::string& program, Interpret interpret, void* context) {
  for (const auto& table : tables_) {
    if (table->name != program) continue;
    table->program.interpret = interpret;
    table->program.context = context;
    return;
  }
  unreachable("the program is in the tables");
}

}  // namespace dpde::codegen
