// SPDX-License-Identifier: Apache-2.0
#include "random/check_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <ranges>

#include "codegen/llvm/jit.h"
#include "dpde/runtime/error.h"
#include "loop/from_stencil.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"
#include "random/variants.h"
#include "random/written_out.h"
#include "source/render.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/interpret/with_rounding.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"

namespace dpde::testing {

using namespace stencil;

namespace {

constexpr double rounding_of_one = 1e-14;
constexpr double largest_dot_error = 1e-11;
constexpr double largest_difference = 1e-5;

bool is_finite(const Outcome& outcome) { return distance(outcome, outcome) == 0; }

class ProgramCheck {
 public:
  ProgramCheck(const RandomProgram& program, const Checks& checks) : random_(program), checks_(checks) {
    add_to(variants_, program.module, "p");
  }

  Verdict run() {
    if (is_valid(random_.module, "verify") && is_finite_itself() && reads_back(random_.module, "p", "text") &&
        differentiate() && derivatives_agree() && wanted_is_finite() && passes_agree() && checks_.jit) {
      if (checks_.without_passes) jit_agrees(false);
      jit_agrees(true);
      jit_agrees(true, codegen::Effort::quick);
      if (checks_.threads || checks_.ranks) larger_grids_agree();
    }
    return verdict_;
  }

 private:
  bool fail(const std::string& check, const std::string& detail) {
    if (verdict_.kind != Verdict::Kind::failed) {
      verdict_.kind = Verdict::Kind::failed;
      verdict_.check = check;
      verdict_.detail = detail;
    }
    return false;
  }

  bool is_valid(const Module& module, const std::string& check) {
    const std::vector<std::string> problems = verify(module);
    return problems.empty() || fail(check, problems[0] + "\n" + print(module));
  }

  /// Few programs overflow: a power of a power, or many divisions by the spacing. A value that does not yet may do so
  /// in a derivative, where powers of it stand: cos(cos(1e90*u)*1e90)*1e90.
  bool is_finite_itself() {
    constexpr double too_large = 1e60;
    Module module = written_out(random_.module, "p");
    Program& program =
        *std::find_if(module.programs.begin(), module.programs.end(), [](const Program& p) { return p.name == "p"; });
    for (const Kernel* kernel : kernels_run(module, program)) {
      for (const Store& store : kernel->stores) {
        const bool is_swapped =
            std::ranges::any_of(program.swaps, [&](const Swap& swap) { return swap.next == store.field; });
        if (!is_swapped) program.keeps.push_back(store.field);
      }
    }
    const RunInputs inputs = inputs_for(variants_.module, "p", random_.grid, random_.seed);
    const Outcome all = run_interpreted(module, program, inputs);
    for (const auto& [field, values] : interpreted(random_.module, "p").fields) {
      if (all.fields.at(field) != values && is_finite(all)) return fail("repeat", field);
    }
    if (is_finite(all) && largest(all) < too_large) return true;
    verdict_.kind = Verdict::Kind::refused;
    verdict_.detail = "overflow";
    return false;
  }

  /// The text reads back to the same text, and the program gives the same bits.
  bool reads_back(const Module& module, const std::string& name, const std::string& check) {
    const std::string text = print(module);
    const SourceFile source("random.dpde", text);
    DiagnosticSink sink;
    const Module read = from_ast(parse(source, sink), sink);
    if (sink.has_errors()) return fail(check, render_text(source, sink.all()[0]));
    const std::string again = print(read);
    if (again != text) return fail(check, text + "\nreads back as\n" + again);
    const RunInputs inputs = inputs_for(module, name, random_.grid, random_.seed);
    const Outcome wanted = run_interpreted(module, *module.find_program(name), inputs);
    if (!is_finite(wanted)) return true;  // wanted_is_finite() has a word for it
    return distance(run_interpreted(read, *read.find_program(name), inputs), wanted) == 0 ||
           fail(check, text + "\ndoes something else when it is read back");
  }

  bool differentiate() {
    DiagnosticSink sink;
    derived_.tangent = adjoint::tangent(random_.module, "p", random_.wrt, sink);
    derived_.adjoint = adjoint::adjoint(random_.module, "p", random_.wrt, sink);
    if (sink.has_errors()) {
      const std::string code(sink.all()[0].kind->code);
      if (code == "E0606" && !random_.has_wrong_adjoint)
        return fail("given adjoint", sink.all()[0].message + "\n" + sink.all()[0].hint);
      if (!code.starts_with("E06")) return fail("differentiate", code + " " + sink.all()[0].message);
      verdict_.kind = Verdict::Kind::refused;
      verdict_.detail = code;
      return false;
    }
    for (const adjoint::Derivative* d : {&derived_.tangent, &derived_.adjoint}) {
      const bool reads = is_valid(d->module, "verify " + d->program) &&
                         reads_back(remove_dead_code(d->module), d->program, "text " + d->program);
      if (!reads) return false;
      add_to(variants_, d->module, d->program);
    }
    return true;
  }

  bool derivatives_agree() {
    const Check check = check_derivatives(random_.module, "p", derived_, random_.wrt, random_.grid, random_.seed);
    verdict_.dot_product = check.dot_product;
    verdict_.finite_difference = check.finite_difference;
    if (!(check.dot_product <= largest_dot_error) && !is_rounding_of_products(check)) {
      return fail("adjoint", fmt::format("dot product: {:.3e}", check.dot_product));
    }
    if (check.finite_difference <= largest_difference) return true;
    // Between the one-sided differences; or differences agree on nothing, as those of the sine of what was divided by
    // hx^10.
    constexpr double nothing = 0.1;
    const double explained = std::max({check.bend, 10 * check.spread, check.change});
    if (!(check.finite_difference <= explained) && check.spread < nothing) {
      return fail("tangent", fmt::format("against differences: {:.3e}, bend {:.3e}, spread {:.3e}, change {:.3e}",
                                         check.finite_difference, check.bend, check.spread, check.change));
    }
    verdict_.kind = Verdict::Kind::kink;
    return true;
  }

  /// Where the terms cancel: the products differ by no more than ten times what rounding does to them. Inputs are of
  /// order 1, so weights inside an interpolation that cancel, as those of a slope on a single cell, leave
  /// `rounding_of_one`.
  bool is_rounding_of_products(const Check& check) {
    if (std::abs(check.forward - check.reverse) <= rounding_of_one) return true;
    const auto rounded = [](const adjoint::Derivative& d) {
      return adjoint::Derivative{with_rounding(d.module), d.program, d.links, d.is_adjoint};
    };
    const Derivatives noisy{rounded(derived_.tangent), rounded(derived_.adjoint)};
    const Check other = check_derivatives(random_.module, "p", noisy, random_.wrt, random_.grid, random_.seed);
    const double rounding = std::abs(other.forward - check.forward) + std::abs(other.reverse - check.reverse);
    return std::abs(check.forward - check.reverse) <= 10 * rounding;
  }

  bool is_rounding_of(double error, const std::string& name) const {
    return is_rounding(error, variants_.module, name, random_.grid, random_.seed);
  }

  Outcome interpreted(const Module& module, const std::string& name) {
    const Program& program = *module.find_program(name);
    // Inputs of the program before any pass: a pass may leave some unread.
    return run_interpreted(module, program, inputs_for(variants_.module, name, random_.grid, random_.seed));
  }

  bool wanted_is_finite() {
    for (const std::string& name : variants_.programs) {
      wanted_[name] = interpreted(variants_.module, name);
      if (!is_finite(wanted_[name])) return fail("finite " + name, "a result is not a number");
    }
    return true;
  }

  bool pass_agrees(const Pass& pass, bool may_round) {
    const Module module = pass.run(variants_.module);
    const std::string check = "pass " + std::string(pass.name);
    if (!is_valid(module, check)) return false;
    for (const std::string& name : variants_.programs) {
      const double error = distance(interpreted(module, name), wanted_[name]);
      if (error == 0 || (may_round && is_rounding_of(error, name))) continue;
      return fail(check, fmt::format("{}: {:.3e}\n{}", name, error, print(module)));
    }
    return true;
  }

  /// Only distribute and regroup change results, by rounding.
  bool passes_agree() {
    for (const Pass& pass : default_passes) {
      if (!pass_agrees(pass, false)) return false;
    }
    for (const Pass& pass : loop_passes) {
      const bool reorders = pass.run == distribute_uniforms || pass.run == regroup_updates;
      if (!pass_agrees(pass, reorders)) return false;
    }
    return is_valid(lowered(variants_.module, true), "all passes");
  }

  std::shared_ptr<codegen::CompiledModule> compiled(const std::string& check, bool with_passes,
                                                    codegen::Effort effort = codegen::Effort::full) {
    const loop::Module loops = loop::from_stencil(lowered(variants_.module, with_passes), variants_.programs);
    const std::vector<std::string> problems = loop::verify(loops);
    if (!problems.empty()) fail(check, problems[0] + "\n" + loop::print(loops));
    if (!problems.empty()) return nullptr;
    codegen::JitResult result = codegen::jit(loops, {.effort = effort});
    if (!result.module) fail(check, result.error);
    return result.module;
  }

  bool jit_agrees(bool with_passes, codegen::Effort effort = codegen::Effort::full) {
    const std::string check = effort == codegen::Effort::quick ? "quick jit" : with_passes ? "jit with passes" : "jit";
    const auto code = compiled(check, with_passes, effort);
    if (!code) return false;
    for (const std::string& name : variants_.programs) {
      const Program& program = *variants_.module.find_program(name);
      const RunInputs inputs = inputs_for(variants_.module, name, random_.grid, random_.seed);
      const double error = distance(run_executed(*code->find(name), program, inputs, 1), wanted_[name]);
      verdict_.back_end = std::max(verdict_.back_end, error);
      if (!is_rounding_of(error, name)) return fail(check, fmt::format("{}: {:.3e}", name, error));
    }
    return true;
  }

  bool larger_grids_agree() {
    const auto code = compiled("larger grids", true);
    return code && (!checks_.threads || threads_agree(*code)) && (!checks_.ranks || ranks_agree(*code));
  }

  bool threads_agree(const codegen::CompiledModule& code) {
    constexpr int cells[3][3] = {{40000, 1, 1}, {203, 190, 1}, {41, 31, 33}};
    Grid grid = random_.grid;
    for (int axis = 0; axis < grid.rank; ++axis) grid.cells[axis] = cells[grid.rank - 1][axis];
    for (const std::string& name : variants_.programs) {
      const Program& program = *variants_.module.find_program(name);
      const RunInputs inputs = inputs_for(variants_.module, name, grid, random_.seed);
      const Outcome one = run_executed(*code.find(name), program, inputs, 1);
      if (distance(run_executed(*code.find(name), program, inputs, 2), one) != 0) return fail("threads", name);
    }
    return true;
  }

  /// Fields to the last bit where nothing is added up for them and rows stay whole: the last cells of a row fill no
  /// vector, and of -2*u - 0.1*u LLVM makes one product exact in these, x + x, and the other one in vectors. What ranks
  /// cannot do together is refused.
  bool ranks_agree(const codegen::CompiledModule& code) {
    constexpr int cells[3][3] = {{77, 1, 1}, {70, 17, 1}, {37, 12, 15}};
    const std::array<int64_t, 3> divisions[] = {{1, 2, 1}, {1, 1, 2}, {2, 1, 1}};
    Grid grid = random_.grid;
    for (int axis = 0; axis < grid.rank; ++axis) grid.cells[axis] = cells[grid.rank - 1][axis];
    for (const std::string& name : variants_.programs) {
      const Program& program = *variants_.module.find_program(name);
      const dpde_program& table = *code.find(name);
      const RunInputs inputs = inputs_for(variants_.module, name, grid, random_.seed);
      const Outcome whole = run_executed(table, program, inputs, 1);
      if (!is_finite(whole)) continue;
      for (const auto& ranks : divisions) {
        const bool has_axes = std::ranges::all_of(std::views::iota(grid.rank, 3), [&](int a) { return ranks[a] == 1; });
        if (has_axes && !ranks_agree(table, program, inputs, whole, ranks)) return false;
      }
    }
    return true;
  }

  bool ranks_agree(const dpde_program& table, const Program& program, const RunInputs& inputs, const Outcome& whole,
                   const std::array<int64_t, 3>& ranks) {
    Outcome divided;
    try {
      divided = run_divided(table, program, inputs, ranks);
    } catch (const Error& error) {
      const std::string why = error.what();
      return why.find("divided among") != std::string::npos || fail("ranks", program.name + ": " + why);
    }
    ++verdict_.divided;
    const double error = distance(divided, whole);
    if (!is_rounding(error, variants_.module, program.name, inputs.grid, random_.seed))
      return fail("ranks", fmt::format("{}: {:.3e}", program.name, error));
    divided.sums = whole.sums;
    const bool keeps_bits = ranks[0] == 1 && !adds_up_fields(table);
    return !keeps_bits || distance(divided, whole) == 0 || fail("ranks", program.name + ": not the same bits");
  }

  const RandomProgram& random_;
  const Checks& checks_;
  Verdict verdict_;
  Derivatives derived_;
  Variants variants_;
  std::map<std::string, Outcome> wanted_;
};

}  // namespace

Verdict check_program(const RandomProgram& program, const Checks& checks) {
  return ProgramCheck(program, checks).run();
}

}  // namespace dpde::testing
