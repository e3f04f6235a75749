// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/pipeline.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "adjoint/reverse/newton_steps.h"
#include "codegen/cpp/compile_cpp.h"
#include "codegen/llvm/jit.h"
#include "driver/compile/added_tasks.h"
#include "driver/compile/interpreter_backend.h"
#include "driver/compile/links.h"
#include "driver/compile/lone_models.h"
#include "driver/compile/losses.h"
#include "driver/compile/stencil_exceeds_grid.h"
#include "driver/compile/surroundings.h"
#include "driver/compile/switches.h"
#include "driver/compile/time_averages.h"
#include "driver/memory/tuning.h"
#include "driver/scene/activity.h"
#include "driver/scene/ghost_counts.h"
#include "driver/scene/param_values.h"
#include "driver/scene/values_of_programs.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"
#include "model/analyse/single_numbers.h"
#include "model/boundary/manufactured.h"
#include "model/build.h"
#include "model/print/print_model.h"
#include "model/verify_model.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/lower/from_model.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/contains.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::driver {

namespace {

/// Calls the observer after each stage. Returns false and reports if an invariant does not hold.
class Stages {
 public:
  Stages(const CompileOptions& options, DiagnosticSink& sink) : options_(options), sink_(sink) {}

  bool after(const std::string& stage, const std::function<std::string()>& text,
             const std::function<std::vector<std::string>()>& verify) {
    if (options_.after) options_.after(stage, text);
    if (!options_.verify || !verify) return true;
    const std::vector<std::string> broken = verify();
    for (const std::string& rule : broken) sink_.report("broken-invariant", {}, {stage, rule});
    return broken.empty();
  }

 private:
  const CompileOptions& options_;
  DiagnosticSink& sink_;
};

/// Adds the parts of `extra` that `base` does not have; on equal names the part of `base` stays.
void merge(stencil::Module& base, const stencil::Module& extra) {
  for (const stencil::Kernel& kernel : extra.kernels) {
    if (base.find_kernel(kernel.name) == nullptr) base.kernels.push_back(kernel);
  }
  for (const stencil::Program& program : extra.programs) {
    if (base.find_program(program.name) == nullptr) base.programs.push_back(program);
  }
  add_networks(base, extra.networks);
  for (const stencil::Loop& loop : extra.loops) {
    if (std::find(base.loops.begin(), base.loops.end(), loop) == base.loops.end()) base.loops.push_back(loop);
  }
}

/// Renames the kernels of `module` that have the name, but not the content, of a kernel in `taken`. Two programs may
/// run one kernel under different boundaries and so have different adjoints of it.
stencil::Module with_own_kernels(stencil::Module module, const stencil::Module& taken) {
  std::map<std::string, std::string> renamed;
  for (stencil::Kernel& kernel : module.kernels) {
    const stencil::Kernel* other = taken.find_kernel(kernel.name);
    if (other == nullptr || *other == kernel) continue;
    std::string name = kernel.name;
    for (int n = 2; taken.find_kernel(name) != nullptr || module.find_kernel(name) != nullptr; ++n) {
      name = fmt::format("{}_{}", kernel.name, n);
    }
    renamed[kernel.name] = name;
    kernel.name = name;
  }
  for (stencil::Program& program : module.programs) {
    for_each_kind<stencil::Run>(program.body, [&](stencil::Run& run) {
      if (renamed.contains(run.kernel)) run.kernel = renamed.at(run.kernel);
    });
  }
  return module;
}

stencil::Module run_passes(stencil::Module module) {
  for (const stencil::Pass& pass : stencil::default_passes) module = pass.run(module);
  return module;
}

std::vector<std::string> names_of(const std::vector<stencil::Program>& programs) {
  std::vector<std::string> names;
  for (const stencil::Program& program : programs) names.push_back(program.name);
  return names;
}

bool has_scene(const ast::File& file) {
  return std::any_of(file.declarations.begin(), file.declarations.end(),
                     [](const ast::Declaration& d) { return std::holds_alternative<ast::Scene>(d.kind); });
}

/// Whether `name` selects a hand-written program, not a scene or task.
bool selects_program(const ast::File& file, const std::string& name) {
  if (!has_scene(file)) return true;
  return std::any_of(file.declarations.begin(), file.declarations.end(), [&](const ast::Declaration& d) {
    const ast::Program* program = std::get_if<ast::Program>(&d.kind);
    return program != nullptr && program->name.name == name;
  });
}

/// Text of a program, for comparison. Fills are omitted: emitted scenes have no boundaries, their programs do.
std::string computed_by(const stencil::Module& module, const std::string& program) {
  stencil::Module part = run_passes(extract(module, {program}));
  part.programs.front().body = stencil::without_fills(part.programs.front().body);
  return print(part);
}

/// Reports hand-written programs that replace generated ones of the scene, unless both compute the same.
void tell_replaced(const ast::File& file, const stencil::Module& written, const stencil::Module& made,
                   DiagnosticSink& sink) {
  for (const ast::Declaration& declaration : file.declarations) {
    const ast::Program* program = std::get_if<ast::Program>(&declaration.kind);
    if (program == nullptr || made.find_program(program->name.name) == nullptr) continue;
    const std::string& name = program->name.name;
    if (computed_by(written, name) == computed_by(made, name)) continue;
    sink.report(
        "program-replaced", program->name.range, {name},
        "as text that was emitted does, whose scene states no boundaries; if it is not meant, call it otherwise");
  }
}

/// Programs of the scene and its task, generated from equations and formulas or hand-written.
stencil::Module lower(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink) {
  stencil::Module written = stencil::from_ast(compiled.ast, sink);
  if (sink.has_errors()) return {};
  for (const std::string& rule : stencil::verify(written)) sink.report("broken-program", {}, {rule});
  if (sink.has_errors()) return {};
  if (!compiled.problem) {
    const std::string& name = options.selection.name;
    if (written.programs.empty())
      sink.report("nothing-to-do", {}, {"the file has no scene and no program"},
                  "write scene NAME : MODEL { grid ...; initial ...; time ... }");
    if (name.empty() || sink.has_errors()) return written;
    if (written.find_program(name) == nullptr) {
      sink.report("nothing-to-do", {}, {"there is no program called " + name},
                  nearest_name(name, names_of(written.programs)).empty()
                      ? ""
                      : "did you mean " + nearest_name(name, names_of(written.programs)) + "?");
      return {};
    }
    return extract(written, {name});
  }
  compiled.names = stencil::program_names(*compiled.problem);
  stencil::Module module = stencil::from_model(spread_over_time(*compiled.problem), compiled.names, sink);
  if (compiled.problem->program.empty()) return module;
  tell_replaced(compiled.ast, written, module, sink);
  if (options.real) {
    for (network::Network& network : written.networks) network.real = *options.real;
  }
  // A hand-written program with the name of a scene's program replaces it. So emitted text reads back.
  std::vector<std::string> wanted = names_of(module.programs);
  wanted.push_back(compiled.problem->program);
  stencil::Module result = extract(written, wanted);
  std::erase_if(wanted, [&](const std::string& name) { return result.find_program(name) != nullptr; });
  merge(result, with_own_kernels(extract(module, wanted), result));
  check_values(compiled.ast, *compiled.problem, result, sink);
  return result;
}

/// Programs that gradients pass through: the step, formulas of fields, and losses; without a scene, all programs.
std::vector<std::string> differentiable_programs(const Compiled& compiled) {
  if (!compiled.problem) return compiled.primal_programs;
  std::vector<std::string> names;
  const std::string step = compiled.step_name();
  const std::vector<std::string> formulas = compiled.formula_programs();
  for (const std::string& name : compiled.primal_programs) {
    if (name == step || contains(formulas, name) || contains(compiled.names.losses, name)) names.push_back(name);
  }
  return names;
}

/// The tangent directions of `wrt`. `with_values`: also the values themselves. Weights have no name of their own, so
/// their networks are always included.
adjoint::Activity directions_of(const Compiled& compiled, const adjoint::Activity& wrt,
                                const adjoint::Derivative& tangent, bool with_values) {
  adjoint::Activity result;
  if (with_values) result = wrt;
  for (const std::string& field : wrt.fields) result.fields.insert(*tangent.field(field));
  for (const std::string& param : wrt.params) {
    result.params.insert(*tangent.param(param));
    if (compiled.stencil.find_network(param) != nullptr) result.params.insert(param);
  }
  return result;
}

/// The adjoint of a derivative of `name`. Its names avoid those of all primal programs, as first adjoints do.
std::optional<adjoint::Derivative> adjoint_of_derivative(const Compiled& compiled,
                                                         const adjoint::Derivative& derivative,
                                                         const adjoint::Activity& wrt) {
  stencil::Module base = compiled.stencil;
  merge(base, derivative.module);
  DiagnosticSink sink;
  adjoint::Derivative result = adjoint::adjoint(base, derivative.program, wrt, sink);
  if (sink.has_errors()) return std::nullopt;
  return result;
}

/// Programs without second derivatives are skipped: gradients do not need them.
void differentiate_twice(Compiled& compiled, const std::string& name, const adjoint::Activity& wrt,
                         stencil::Module& derivatives) {
  Derived& derived = compiled.derived.at(name);
  const auto add = [&](const adjoint::Derivative& derivative) {
    merge(derivatives, with_own_kernels(derivative.module, derivatives));
  };
  derived.second =
      adjoint_of_derivative(compiled, *derived.tangent, directions_of(compiled, wrt, *derived.tangent, true));
  if (derived.second) add(*derived.second);
  if (!contains(compiled.names.losses, name)) return;
  DiagnosticSink sink;
  derived.gauss_newton = adjoint::squares_of_tangent(compiled.stencil, name, wrt, sink);
  if (!derived.gauss_newton || sink.has_errors()) return;
  derived.gauss_newton_adjoint = adjoint_of_derivative(compiled, *derived.gauss_newton,
                                                       directions_of(compiled, wrt, *derived.gauss_newton, false));
  if (!derived.gauss_newton_adjoint) return;
  add(*derived.gauss_newton);
  add(*derived.gauss_newton_adjoint);
}

void differentiate(Compiled& compiled, const CompileOptions& options, DiagnosticSink& sink) {
  stencil::Module derivatives;
  const adjoint::Surroundings surroundings = surroundings_of(compiled);
  for (const std::string& name : differentiable_programs(compiled)) {
    const adjoint::Activity wrt = active_inputs(compiled, name);
    if (wrt.fields.empty() && wrt.params.empty()) continue;
    Derived& derived = compiled.derived[name];
    if (options.tangent) {
      derived.tangent = adjoint::tangent(compiled.stencil, name, wrt, sink);
      merge(derivatives, with_own_kernels(derived.tangent->module, derivatives));
    }
    if (options.adjoint) {
      derived.adjoint = adjoint::adjoint(compiled.stencil, name, wrt, sink, surroundings);
      merge(derivatives, with_own_kernels(derived.adjoint->module, derivatives));
    }
    if (options.second && !sink.has_errors()) differentiate_twice(compiled, name, wrt, derivatives);
  }
  if (sink.has_errors()) return;
  // An adjoint may recompute only a part of a stage, in a kernel of its own: the fills are removed with the rest.
  merge(compiled.stencil, with_own_kernels(run_passes(std::move(derivatives)), compiled.stencil));
}

/// Removes the task. Network weights that it loads become the scene's weights.
void leave_task(model::Problem& problem) {
  for (std::size_t i = 0; problem.task && i < problem.task->unknowns.size(); ++i) {
    const model::Unknown& unknown = problem.task->unknowns[i];
    if (unknown.kind != model::Unknown::Kind::network || unknown.from.file.empty()) continue;
    std::erase_if(problem.weights, [&](const model::GivenWeights& given) { return given.network == unknown.name; });
    problem.weights.push_back({unknown.name, unknown.from});
  }
  problem.task.reset();
}

void generate(Compiled& compiled, Backend backend, codegen::CodeCache* cache, DiagnosticSink& sink) {
  std::string error;
  switch (backend) {
    case Backend::jit: {
      const bool is_quick = has_quick_code(compiled);
      const codegen::JitOptions jit{.variants = !is_quick && is_worth_tuning(compiled),
                                    .effort = is_quick ? codegen::Effort::quick : codegen::Effort::full};
      codegen::JitResult result = codegen::jit(compiled.loop, jit, cache);
      compiled.code = std::move(result.module);
      compiled.cached.is_from_cache = result.from_cache;
      compiled.cached.key = std::move(result.key);
      error = result.error;
      break;
    }
    case Backend::cpp: {
      codegen::CompileResult result = codegen::compile_cpp(compiled.loop, "", cache);
      compiled.code = std::move(result.module);
      compiled.cached.is_from_cache = result.from_cache;
      compiled.cached.key = std::move(result.key);
      error = result.error;
      break;
    }
    case Backend::interpreter:  // not compiled.loop, where terms as y - y cancel: the interpreter reads them
      compiled.code = interpreted(
          compiled.stencil, loop::from_stencil(compiled.stencil, names_of(compiled.stencil.programs), compiled.real()));
      break;
  }
  if (!compiled.code) {
    sink.report("machine-failed", {}, {"the back end failed: " + error});
    return;
  }
  for (const LinkedProgram& derivative : linked_programs(compiled))
    compiled.code->set_links(derivative.program, derivative.links);
}

/// Fills ast and model. Returns false after errors.
bool understand(Compiled& compiled, const SourceFile& source, const CompileOptions& options, Stages& stages,
                DiagnosticSink& sink) {
  compiled.ast = parse(source, sink);
  if (sink.has_errors()) return false;
  std::erase_if(compiled.ast.declarations,
                [](const ast::Declaration& d) { return std::holds_alternative<ast::Import>(d.kind); });
  stencil::from_ast(compiled.ast, sink);  // reports broken kernels before a scene reports them as missing
  if (sink.has_errors()) return false;
  if (!stages.after("ast", [&] { return print(compiled.ast); }, {})) return false;
  if (!has_scene(compiled.ast)) check_lone_models(compiled.ast, source, sink);
  if (sink.has_errors()) return false;
  if (selects_program(compiled.ast, options.selection.name)) return true;
  model::Selection selection = options.selection;
  const std::vector<std::string> scenes = model::scene_names(compiled.ast);
  if (options.without_task && selection.name.empty() && scenes.size() == 1) selection.name = scenes[0];
  compiled.problem = model::from_ast(compiled.ast, selection, sink);
  if (sink.has_errors() || !compiled.problem) return false;
  if (options.without_task) leave_task(*compiled.problem);
  if (options.manufactured && !model::manufacture(*compiled.problem, sink)) return false;
  if (options.real) {
    compiled.problem->scheme.real = *options.real;
    for (network::Network& network : compiled.problem->networks) network.real = *options.real;
  }
  if (compiled.real() == Precision::f32) model::check_numbers_of_floats(*compiled.problem, sink);
  if (sink.has_errors()) return false;
  const auto text = [&] { return print(*compiled.problem); };
  if (!stages.after("model", text, [&] { return verify(*compiled.problem); })) return false;
  if (options.certify && !compiled.problem->task) add_certifying_task(*compiled.problem);
  if (options.seeded && compiled.problem->task) seed_the_end(*compiled.problem);
  return true;
}

bool lower_and_differentiate(Compiled& compiled, CompileOptions options, Stages& stages, DiagnosticSink& sink) {
  const model::Optimiser* newton = options.adjoint ? newton_of(compiled) : nullptr;
  if (newton != nullptr) options.tangent = options.second = true;
  stencil::Module lowered = lower(compiled, options, sink);
  if (const stencil::Program* step = compiled.problem ? lowered.find_program(compiled.names.step) : nullptr)
    tell_wide_formulas(lowered, *step, *compiled.problem, sink);
  compiled.stencil = run_passes(std::move(lowered));
  if (sink.has_errors()) return false;
  compiled.primal_programs = names_of(compiled.stencil.programs);
  check_ghosts(compiled, sink);
  compiled.activity = activity_of(compiled, options);
  if (options.tangent || options.adjoint) check_switches(compiled, options, sink);
  if (sink.has_errors()) return false;
  if (options.adjoint) {
    for (stencil::Module& watched : watch_jumps(compiled, options))
      merge(compiled.stencil, with_own_kernels(run_passes(std::move(watched)), compiled.stencil));
  }
  const auto verified = [&] { return stencil::verify(compiled.stencil); };
  if (!stages.after(
          "stencil", [&] { return print(compiled.stencil); }, verified))
    return false;
  if (!options.tangent && !options.adjoint) return true;
  differentiate(compiled, options, sink);
  if (options.adjoint && !sink.has_errors()) check_losses(compiled, sink);
  if (sink.has_errors()) return false;
  const auto derivatives_text = [&](bool adjoint) {
    return print(extract(compiled.stencil, compiled.derivative_programs(adjoint)));
  };
  if (options.tangent && !stages.after(
                             "tangent", [&] { return derivatives_text(false); }, verified))
    return false;
  return !options.adjoint || stages.after(
                                 "adjoint", [&] { return derivatives_text(true); }, verified);
}

}  // namespace

adjoint::Activity active_inputs(const Compiled& compiled, const std::string& name) {
  const stencil::Program& program = *compiled.stencil.find_program(name);
  const stencil::Interface interface = stencil::interface_of(compiled.stencil, program);
  adjoint::Activity wrt;
  for (const std::string& field : interface.inputs) {
    if (compiled.activity.fields.contains(field)) wrt.fields.insert(field);
  }
  for (const stencil::Swap& swap :
       program.swaps) {  // an event may overwrite a state without reading it; the state has an adjoint all the same
    if (compiled.activity.fields.contains(swap.state)) wrt.fields.insert(swap.state);
  }
  for (const std::string& param : interface.params) {
    if (compiled.activity.params.contains(param)) wrt.params.insert(param);
  }
  for (const std::string& network : interface.networks) {
    if (compiled.activity.params.contains(network)) wrt.params.insert(network);
  }
  return wrt;
}

std::vector<std::string> Compiled::formula_programs() const { return {names.coefficients, names.initial}; }

const dpde_program* Compiled::adjoint_of(const std::string& name) const {
  const auto found = derived.find(name);
  return found == derived.end() || !found->second.adjoint ? nullptr : program(found->second.adjoint->program);
}

std::vector<std::string> Compiled::derivative_programs(bool adjoint) const {
  std::vector<std::string> names;
  for (const std::string& primal : primal_programs) {
    const auto found = derived.find(primal);
    if (found == derived.end()) continue;
    const std::optional<adjoint::Derivative>& derivative = adjoint ? found->second.adjoint : found->second.tangent;
    if (derivative) names.push_back(derivative->program);
  }
  return names;
}

std::optional<Compiled> compile(const SourceFile& source, const CompileOptions& options, DiagnosticSink& sink) {
  const auto start = std::chrono::steady_clock::now();
  Compiled compiled;
  compiled.options = options;
  Stages stages(options, sink);
  if (!understand(compiled, source, options, stages, sink)) return std::nullopt;
  if (!lower_and_differentiate(compiled, options, stages, sink)) return std::nullopt;
  LoweredToLoop lowered = lower_to_loop(compiled.stencil, names_of(compiled.stencil.programs), compiled.real(),
                                        step_to_reverse(compiled), values_of(compiled));
  compiled.loop = std::move(lowered.module);
  compiled.variants = std::move(lowered.variants);
  if (!stages.after(
          "loop", [&] { return print(compiled.loop); }, [&] { return verify(compiled.loop); }))
    return std::nullopt;
  if (options.backend) generate(compiled, *options.backend, options.cache.get(), sink);
  if (sink.has_errors()) return std::nullopt;
  compiled.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return compiled;
}

bool Compiled::is_single() const {
  return real() == Precision::f32 ||
         std::ranges::any_of(stencil.networks, [](const network::Network& n) { return n.real == Precision::f32; });
}

stencil::Module extract(const stencil::Module& module, const std::vector<std::string>& programs) {
  stencil::Module result;
  for (const stencil::Program& program : module.programs) {
    if (contains(programs, program.name)) result.programs.push_back(program);
  }
  const stencil::Parts parts = stencil::parts_of(result.programs);
  for (const stencil::Kernel& kernel : module.kernels) {
    if (parts.kernels.contains(kernel.name)) result.kernels.push_back(kernel);
  }
  for (const std::string& network : parts.networks) add_networks(result, {*module.find_network(network)});
  for (const stencil::Loop& loop : module.loops) {
    const auto is_there = [&](const std::string& name) { return contains(programs, name); };
    if (std::all_of(loop.programs.begin(), loop.programs.end(), is_there)) result.loops.push_back(loop);
  }
  return result;
}

}  // namespace dpde::driver
