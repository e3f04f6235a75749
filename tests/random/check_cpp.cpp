// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "codegen/cpp/compile_cpp.h"
#include "loop/from_stencil.h"
#include "random/check_program.h"
#include "random/variants.h"
#include "stencil/walk.h"

namespace dpde::testing {

using namespace stencil;

namespace {

/// Names that several programs share, made different.
Module with_suffix(Module module, const std::string& suffix) {
  for (Kernel& kernel : module.kernels) kernel.name += suffix;
  for (Program& program : module.programs) {
    program.name += suffix;
    for_each_kind<Run>(program.body, [&](Run& run) { run.kernel += suffix; });
  }
  return module;
}

/// The program with those of its derivatives that there are.
Variants variants_of(const RandomProgram& program) {
  Variants variants;
  add_to(variants, program.module, "p");
  DiagnosticSink sink;
  const adjoint::Derivative tangent = adjoint::tangent(program.module, "p", program.wrt, sink);
  const adjoint::Derivative adjoint = adjoint::adjoint(program.module, "p", program.wrt, sink);
  if (sink.has_errors()) return variants;
  add_to(variants, tangent.module, tangent.program);
  add_to(variants, adjoint.module, adjoint.program);
  return variants;
}

}  // namespace

std::vector<Verdict> check_in_cpp(const std::vector<RandomProgram>& programs) {
  Variants all;
  std::vector<Variants> each;
  for (std::size_t i = 0; i < programs.size(); ++i) {
    each.push_back(variants_of(programs[i]));
    const std::string suffix = fmt::format("_{}", i);
    const Module renamed = with_suffix(each.back().module, suffix);
    for (const std::string& name : each.back().programs) add_to(all, renamed, name + suffix);
  }
  const codegen::CompileResult compiled =
      codegen::compile_cpp(loop::from_stencil(lowered(all.module, true), all.programs));
  std::vector<Verdict> verdicts(programs.size());
  for (std::size_t i = 0; i < programs.size(); ++i) {
    Verdict& verdict = verdicts[i];
    for (const std::string& name : each[i].programs) {
      const Program& program = *each[i].module.find_program(name);
      const RunInputs inputs = inputs_for(each[i].module, name, programs[i].grid, programs[i].seed);
      const dpde_program* code = compiled.module ? compiled.module->find(fmt::format("{}_{}", name, i)) : nullptr;
      const double error =
          code ? distance(run_executed(*code, program, inputs, 1), run_interpreted(each[i].module, program, inputs))
               : INFINITY;
      verdict.back_end = std::max(verdict.back_end, error);
      if (is_rounding(error, each[i].module, name, programs[i].grid, programs[i].seed)) continue;
      verdict.kind = Verdict::Kind::failed;
      verdict.check = "cpp";
      verdict.detail = code ? fmt::format("{}: {:.3e}", name, error) : compiled.error;
    }
  }
  return verdicts;
}

}  // namespace dpde::testing
