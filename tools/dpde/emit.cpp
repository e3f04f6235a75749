// SPDX-License-Identifier: Apache-2.0
// dpde emit: prints one stage of the compiler as text.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "codegen/cpp/emit_cpp.h"
#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm/jit.h"
#include "command.h"
#include "driver/scene/param_values.h"
#include "driver/scene/scene_text.h"
#include "files/files.h"
#include "loop/print_loop.h"
#include "model/print/print_model.h"
#include "preparing.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct EmitOptions : CommonOptions {
  std::string stage, output;
  bool optimised = false;
};

/// Only the tangent or adjoint programs, without values that other programs read of shared kernels.
stencil::Module derivatives(const driver::Compiled& compiled, bool adjoint) {
  return stencil::remove_dead_code(driver::extract(compiled.stencil, compiled.derivative_programs(adjoint)));
}

loop::Module adjoint_loop(const driver::Compiled& compiled) {
  const std::vector<std::string> adjoints = compiled.derivative_programs(true);
  std::vector<std::string> read = adjoints;
  read.push_back(compiled.step_name());  // a variant of the step stores values for the adjoints
  return driver::lower_to_loop(driver::extract(compiled.stencil, read), adjoints, compiled.real(),
                               driver::step_to_reverse(compiled), driver::values_of(compiled))
      .module;
}

std::string model_text(const driver::Compiled& compiled, Job& job) {
  if (compiled.problem) return print(*compiled.problem);
  job.sink().report("nothing-to-do", {}, {"a hand-written program has no model stage"});
  return "";
}

/// The programs of the scene and task; for a file of hand-written programs also unused ones, in their original order,
/// so that emitted text is read back unchanged.
stencil::Module primal(const driver::Compiled& compiled) {
  const stencil::Module used = driver::extract(compiled.stencil, compiled.primal_programs);
  if (!compiled.problem || compiled.problem->program.empty()) return used;
  DiagnosticSink reported;
  stencil::Module all = stencil::from_ast(compiled.ast, reported);
  for (const stencil::Pass& pass : stencil::default_passes) all = pass.run(all);
  const auto take_over = [](auto& into, const auto& from) {
    for (const auto& each : from) {
      const auto same = std::ranges::find(into, each.name, [](const auto& known) { return known.name; });
      if (same != into.end()) {
        *same = each;
      } else {
        into.push_back(each);
      }
    }
  };
  take_over(all.kernels, used.kernels);
  take_over(all.programs, used.programs);
  stencil::add_networks(all, used.networks);
  return all;
}

std::string stencil_text(const driver::Compiled& compiled) {
  const std::string text = print(primal(compiled));
  const std::string scene = compiled.problem ? driver::scene_text(compiled) : "";
  return scene.empty() ? text : text + "\n" + scene;
}

std::string stage_text(Job& job, const EmitOptions& options) {
  if (options.stage == "ast") {
    ast::File file = parse(job.source(), job.sink());
    std::erase_if(file.declarations,
                  [](const ast::Declaration& d) { return std::holds_alternative<ast::Import>(d.kind); });
    return job.failed() ? "" : print(file);
  }
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!compile_options) return "";
  compile_options->backend.reset();
  compile_options->tangent = options.stage == "tangent";
  compile_options->adjoint = options.stage.starts_with("adjoint");
  const bool is_of_llvm = options.stage.ends_with("llvm") || options.stage.ends_with("asm");
  if (is_of_llvm && !codegen::has_llvm()) {
    job.sink().report("bad-option", {}, {fmt::format("--stage {}: this dpde was built without LLVM", options.stage)},
                      "write --stage cpp, or build with -DDPDE_LLVM=ON");
    return "";
  }
  const Preparing preparing(job, "stopped before anything was emitted");
  const std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return "";
  if (options.stage == "model") return model_text(*compiled, job);
  if (options.stage == "stencil") return stencil_text(*compiled);
  if (options.stage == "tangent") return print(derivatives(*compiled, false));
  if (options.stage == "adjoint") return print(derivatives(*compiled, true));
  if (options.stage == "loop") return print(compiled->loop);
  if (options.stage == "adjoint-loop") return print(adjoint_loop(*compiled));
  if (options.stage == "cpp") return codegen::emit_cpp(compiled->loop, &job.source());
  if (options.stage == "adjoint-cpp") return codegen::emit_cpp(adjoint_loop(*compiled), &job.source());
  if (options.stage == "llvm") return codegen::emit_llvm(compiled->loop, options.optimised);
  if (options.stage == "adjoint-llvm") return codegen::emit_llvm(adjoint_loop(*compiled), options.optimised);
  if (options.stage == "adjoint-asm") return codegen::emit_assembly(adjoint_loop(*compiled));
  return codegen::emit_assembly(compiled->loop);
}

/// C++, LLVM IR and assembly do not look like .dpde; these stages nearly do.
bool looks_as_if_read_back(const std::string& stage) {
  return stage == "model" || stage == "loop" || stage == "adjoint-loop";
}

int emit(const EmitOptions& options) {
  Job job(options);
  guarded(job, [&] {
    if (!job.load_source()) return;
    const std::string text = stage_text(job, options);
    if (job.failed()) return;
    if (options.output.empty()) {
      fmt::print(options.streams.out, "{}", text);
    } else {
      files::write_file(options.output, text, job.sink());
    }
    if (looks_as_if_read_back(options.stage) && !options.quiet)
      job.tell(fmt::format("text of the stage {} is to be looked at: dpde reads ast, stencil, tangent and adjoint back",
                           options.stage));
  });
  return job.finish(Json::object());
}

}  // namespace

void add_emit(CLI::App& app, Console& console) {
  const auto options = std::make_shared<EmitOptions>();
  CLI::App* verb = app.add_subcommand("emit", "print one stage of the compiler as text");
  add_common_options(*verb, *options, console, {.out = false, .seed = false, .json = false});
  verb->add_option("--stage", options->stage, "which one; dpde reads ast, stencil, tangent and adjoint back")
      ->required()
      ->check(CLI::IsMember({"ast", "model", "stencil", "tangent", "adjoint", "loop", "adjoint-loop", "cpp",
                             "adjoint-cpp", "llvm", "adjoint-llvm", "asm", "adjoint-asm"}));
  verb->add_option("-o,--output,--out", options->output, "file to write instead of standard output")->type_name("PATH");
  verb->add_flag("--optimised", options->optimised, "of llvm: after the passes, for this processor");
  verb->footer(
      "Examples:\n  dpde emit burgers.dpde --stage adjoint\n  dpde emit burgers.dpde --stage stencil -o step.dpde && "
      "dpde run step.dpde");
  on_call(*verb, console, [options] { return emit(*options); });
}

}  // namespace dpde::tools
