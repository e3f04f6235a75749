// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/plan.h"

#include <algorithm>
#include <map>
#include <type_traits>

#include "adjoint/reverse/transforms.h"
#include "adjoint/reverse/weights.h"
#include "adjoint/solves.h"
#include "stencil/analyse/effects.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// Names of all values that can have derivatives: fields, parameters, sums, networks and stacks.
std::set<std::string> values_of(const Module& module) {
  std::set<std::string> values;
  for (const Kernel& kernel : module.kernels) {
    const Signature s = signature(kernel);
    for (const auto& read : s.reads) values.insert(read.field);
    for (const auto* names : {&s.writes, &s.updates, &s.params, &s.sums}) values.insert(names->begin(), names->end());
  }
  for (const network::Network& network : module.networks) values.insert(network.name);
  for (const Program& program : module.programs) {
    const Interface known = interface_of(module, program);
    for (const auto* names : {&known.inputs, &known.written, &known.params})
      values.insert(names->begin(), names->end());
    for (const Swap& swap : program.swaps) values.insert({swap.state, swap.next});
    for_each_kind<Repeat>(program.body, [&](const Repeat& repeat) {
      for (const TapeEntry& save : repeat.saves) values.insert(save.stack);
    });
  }
  return values;
}

bool varies(const NetworkCall& network_call, const Varied& varied) {
  const std::vector<std::string> read = fields_read(network_call);
  return varied.params.contains(network_call.network) ||
         std::any_of(read.begin(), read.end(), [&](const std::string& field) { return varied.fields.contains(field); });
}

void grow_varied(const Kernel& kernel, Varied& varied) {
  const Varied inside{varied.fields, varied.params, varied_locals(kernel, varied)};
  for (const Store& store : kernel.stores) {
    if (is_varied(store.value, inside)) varied.fields.insert(store.field);
  }
  for (const Scatter& scatter : kernel.scatters) {
    const bool moves = std::any_of(scatter.target.displacement.begin(), scatter.target.displacement.end(),
                                   [&](const Expr& d) { return is_varied(d, inside); });
    if (moves || is_varied(scatter.value, inside)) varied.fields.insert(scatter.target.field);
  }
}

/// Both fields of a swap vary together: a value that varies after one pass varies before the next. Stacks vary like
/// fields.
void grow_varied(const Repeat& repeat, Varied& varied) {
  const auto together = [&](std::initializer_list<std::string> names) {
    if (std::ranges::any_of(names, [&](const std::string& name) { return varied.fields.contains(name); }))
      varied.fields.insert(names);
  };
  for (const LoopCarried& carry : repeat.carries) together({carry.state, carry.next, carry.result});
  for (const TapeEntry& save : repeat.saves) together({save.field, save.stack});
  for (const TapeEntry& load : repeat.loads) {
    if (varied.fields.contains(load.stack)) varied.fields.insert(load.field);
  }
}

/// One pass over the statements: adds the fields that vary by them.
void grow_varied(const Module& module, const std::vector<Statement>& statements, Varied& varied) {
  for (const Statement& statement : statements) {
    match(
        statement,
        [&](const Fill& fill) {
          for (const std::string& wall : wall_fields(fill.axes)) {
            if (varied.fields.contains(wall)) varied.fields.insert(fill.field);
          }
          if (!sides_with_varied_weights(fill.axes, varied).empty()) varied.fields.insert(fill.field);
        },
        [&](const Fold& fold) {
          if (varied.fields.contains(fold.field)) varied.fields.merge(wall_fields(fold.axes));
        },
        [&](const Reduce& reduce) {
          if (varied.fields.contains(reduce.field)) varied.fields.insert(reduce.result);
        },
        [&](const NetworkCall& network_call) {
          if (!varies(network_call, varied)) return;
          for (const std::string& field : fields_written(network_call)) varied.fields.insert(field);
        },
        [&](const Transform& transform) {
          if (is_varied(transform, varied)) varied.fields.insert(transform.result);
        },
        [&](const Run& run) { grow_varied(*module.find_kernel(run.kernel), varied); },
        [&](const Solve& solve) {
          const auto is_varied = [&](const std::string& field) { return varied.fields.contains(field); };
          if (std::ranges::any_of(solve.rights, is_varied) || has_varied_operator(module, solve, varied))
            varied.fields.insert(solve.unknowns.begin(), solve.unknowns.end());
        },
        [&](const Repeat& repeat) {
          grow_varied(repeat, varied);
          grow_varied(module, repeat.body, varied);
        });
  }
}

bool check_kernel(const Kernel& kernel, const Varied& outside, DiagnosticSink& sink) {
  bool good = true;
  const Signature s = signature(kernel);
  for (const std::string& field : s.updates) {
    if (!outside.fields.contains(field) || !s.find_read(field)) continue;
    sink.report("accumulates-onto-read-field", {}, {kernel.name, field},
                "store the new value in another field and let later statements read that one");
    good = false;
  }
  return good;
}

/// Boundary values that vary must be fields. Weights of a fill may be varied params; those of a fold may not, as its
/// derivative would need the former values of the halo.
template <class FillOrFold>
bool check_sides(const FillOrFold& statement, const Varied& varied, DiagnosticSink& sink) {
  constexpr bool is_fold = std::is_same_v<FillOrFold, Fold>;
  const Written& written = statement.written;
  bool good = true;
  for_each_side(statement.axes, [&](const Side& side) {
    const bool value_varies = !wall_field(side) && is_varied(side.value, varied);
    const bool weights_vary = is_fold && has_varied_weights(side, varied);
    if (!value_varies && !weights_vary) return;
    sink.report("varied-boundary-value", written.range, {written.field.empty() ? statement.field : written.field},
                value_varies
                    ? "let a kernel that runs on the extended region store the value in a field, and fill from that"
                    : "take the derivative of the tangent: a fold with weights of mixed(a, b, c) that vary has none");
    good = false;
  });
  return good;
}

/// The adjoint of a network's tangent exists, except for networks that the host computes, which have no tangents.
/// Weights and their tangents must vary together: a call records only whether its weights vary.
bool check_network(const Module& module, const NetworkCall& call, const Varied& varied, Way way, DiagnosticSink& sink) {
  const auto refuse = [&](const char* hint) {
    sink.report("no-useful-derivative", {}, {"a derivative of the network " + call.network, "here"}, hint);
    return false;
  };
  const bool is_learned = varied.params.contains(call.network);
  if (call.mode == NetworkCall::Mode::value || (!call.weights && !varies(call, varied))) return true;
  if (call.mode != NetworkCall::Mode::tangent || way != Way::reverse)
    return !varies(call, varied) || refuse("networks have first and second derivatives, and none of these");
  if (module.find_network(call.network)->is_host())
    return refuse("the host has none: use an optimiser that needs no second ones, as adam or lbfgs");
  if (call.weights != is_learned)
    return refuse("the adjoint of a tangent is by the network's weights where the tangent is, and else not");
  return true;
}

}  // namespace

DerivedNames::DerivedNames(const Module& module, std::string suffix) : suffix_(std::move(suffix)) {
  const std::set<std::string> values = values_of(module);
  for (const std::string& value : values) supply_.reserve(value);
  for (const Kernel& kernel : module.kernels) {
    for (const Let& let : kernel.lets) supply_.reserve(let.name);
    kernels_.reserve(kernel.name);
  }
  for (const Program& program : module.programs) programs_.reserve(program.name);
  for (const std::string& value : values) kept_.emplace(value, supply_.fresh(value + suffix_));
}

std::string DerivedNames::of(const std::string& name) {
  auto found = derived_.find(name);
  if (found != derived_.end()) return found->second;
  const auto kept = kept_.find(name);
  return derived_.emplace(name, kept == kept_.end() ? supply_.fresh(name + suffix_) : kept->second).first->second;
}

std::vector<Link> DerivedNames::links(const Module& module, const Program& program, const Activity& wrt) const {
  const Interface known = interface_of(module, program);
  std::set<std::string> fields(known.inputs.begin(), known.inputs.end()),
      params(known.params.begin(), known.params.end());
  fields.insert(known.written.begin(), known.written.end());
  fields.insert(wrt.fields.begin(), wrt.fields.end());
  for (const Swap& swap : program.swaps) fields.insert({swap.state, swap.next});
  params.insert(known.networks.begin(), known.networks.end());
  params.insert(wrt.params.begin(), wrt.params.end());
  std::vector<Link> links;
  const auto add = [&](Link::Kind kind, const auto& values) {
    for (const std::string& value : values) {
      const auto found = derived_.find(value);
      if (found != derived_.end()) links.push_back({kind, value, found->second});
    }
  };
  add(Link::Kind::field, fields);
  add(Link::Kind::param, params);
  add(Link::Kind::sum, known.sums);
  // A missing link would mean "does not depend on this input": a gradient that is silently 0.
  const auto is_linked = [&](const std::string& input) { return derived_.contains(input); };
  require(std::ranges::all_of(wrt.fields, is_linked) && std::ranges::all_of(wrt.params, is_linked),
          "each active input has a link");
  return links;
}

const std::string* Derivative::derived(Link::Kind kind, const std::string& primal) const {
  const auto found =
      std::ranges::find_if(links, [&](const Link& link) { return link.kind == kind && link.primal == primal; });
  return found == links.end() ? nullptr : &found->derived;
}

Varied find_varied(const Module& module, const Program& program, const Activity& wrt) {
  Varied varied{wrt.fields, wrt.params, {}};
  bool grew = true;
  while (grew) {
    const size_t before = varied.fields.size();
    for (const Swap& swap : program.swaps) {  // a field that varies after one step varies before the next
      if (varied.fields.contains(swap.state)) varied.fields.insert(swap.next);
      if (varied.fields.contains(swap.next)) varied.fields.insert(swap.state);
    }
    grow_varied(module, program.body, varied);
    grew = varied.fields.size() > before;
  }
  return varied;
}

namespace {

bool check_statements(const Module& module, const std::vector<Statement>& statements, const Varied& varied, Way way,
                      DiagnosticSink& sink) {
  bool good = true;
  for (const Statement& statement : statements) {
    good &= match(
        statement,  //
        [&](const OneOf<Fill, Fold> auto& halo) { return check_sides(halo, varied, sink); },
        [&](const NetworkCall& network_call) { return check_network(module, network_call, varied, way, sink); },
        [&](const Run& run) { return check_kernel(*module.find_kernel(run.kernel), varied, sink); },
        [&](const OneOf<Solve, Repeat> auto& block) { return check_statements(module, block.body, varied, way, sink); },
        always<true, Reduce, Transform>);
  }
  return good;
}

}  // namespace

bool check_differentiable(const Module& module, const Program& program, const Varied& varied, Way way,
                          DiagnosticSink& sink) {
  return check_statements(module, program.body, varied, way, sink);
}

bool check_folds(const Module& module, const Program& program, const Varied& varied, DiagnosticSink& sink) {
  std::string scatters;
  bool good = true;
  for (const Statement& statement : program.body) {
    std::set<std::string> folded;
    match(
        statement, [&](const Fold& fold) { folded = wall_fields(fold.axes); },
        [&](const Run& run) {
          if (!module.find_kernel(run.kernel)->scatters.empty()) scatters = run.kernel;
        },
        [&](const Solve& solve) { good = good && check_folds(module, operator_of(solve, program), varied, sink); },
        [&](const Repeat& repeat) { good = good && check_folds(module, pass_of(repeat, program), varied, sink); },
        ignored<Fill, Reduce, NetworkCall, Transform>);
    if (!good) return false;
    if (scatters.empty()) continue;
    for (const std::string& wall : folded) {
      if (!varied.fields.contains(wall)) continue;
      sink.report("no-useful-derivative", {}, {"interp(...) += next to the walls " + wall, "in kernel " + scatters},
                  "take the derivative of the tangent, or keep these walls from depending on an unknown");
      return false;
    }
  }
  return true;
}

void add_results(const Program& program, const Varied& varied, const Activity& wrt, DerivedNames& names,
                 Program& derived) {
  std::set<std::string> swapped;
  for (const Swap& swap : program.swaps) {
    if (!varied.fields.contains(swap.state)) continue;
    derived.swaps.push_back({names.of(swap.next), names.of(swap.state)});
    swapped.insert(swap.state);
  }
  for (const std::string& field : wrt.fields) {
    if (!swapped.contains(field)) derived.keeps.push_back(names.of(field));
  }
}

std::vector<AxisBoundary> derived_sides(std::vector<AxisBoundary> axes, const DerivedField& derived) {
  for (AxisBoundary& axis : axes) {
    for (Side* side : {&axis.low, &axis.high}) {
      const std::string* wall = wall_field(*side);
      const std::optional<std::string> field = wall ? derived(*wall) : std::nullopt;
      side->value = field ? access(*field) : Expr(0.0);
    }
  }
  return axes;
}

}  // namespace dpde::adjoint
