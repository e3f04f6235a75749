// SPDX-License-Identifier: Apache-2.0
// Compiles a .dpde file through all levels. The order of the levels is defined here only:
//   text -> ast -> model::Problem -> stencil::Module -> + tangent, adjoint -> loop::Module -> compiled programs
//
// After each stage an observer gets its name and can ask for its text.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adjoint/adjoint.h"
#include "adjoint/reverse/accumulating_adjoint.h"
#include "adjoint/reverse/kept.h"
#include "codegen/code_cache.h"
#include "codegen/compiled_module.h"
#include "loop/from_stencil.h"
#include "loop/loop.h"
#include "model/analyse/switches.h"
#include "model/from_ast.h"
#include "model/model.h"
#include "source/diagnostic.h"
#include "stencil/lower/from_model.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::driver {

enum class Backend { jit, cpp, interpreter };

/// Stages: ast, model, stencil, tangent, adjoint, loop.
using StageObserver = std::function<void(std::string_view stage, const std::function<std::string()>& text)>;

inline constexpr double any_number_of_runs = std::numeric_limits<double>::infinity();

struct CompileOptions {
  model::Selection selection;      // the scene or task; without scenes, a program, or "" for all
  std::optional<Backend> backend;  // nullopt: stop at the loop level
  bool tangent = false, adjoint = false;
  bool second = false;            // second derivatives, with tangent and adjoint; programs without them are skipped
  std::optional<Precision> real;  // overrides the precision of a scene and its networks
  bool without_task = false;      // only the task's scene and scheme; "" is the only scene, if there is just one
  /// For a scene without a task: add one for certify(), with all states and parameters as unknowns and a generated
  /// loss.
  bool certify = false;
  bool seeded = false;         // for a task: seed_the_end()
  bool manufactured = false;   // for a scene: use a manufactured solution, model/boundary/manufactured.h
  bool by_everything = false;  // differentiate with respect to all coefficients and parameters, not only unknowns
  bool takes_jumps = false;    // ignore jumps of switches in derivatives
  bool trusts_signs = false;   // gradients do not check Compiled::watched
  bool verify = false;         // check the invariants of every level after each stage
  StageObserver after;         // may be empty
  double runs = 1;             // expected number of runs; any_number_of_runs for benchmarks and hosts
  std::shared_ptr<codegen::CodeCache> cache;  // null: no cache, always compile
};

/// Derivatives of a program, if it depends on an active value.
struct Derived {
  std::optional<adjoint::Derivative> tangent, adjoint;  // names; their kernels are in Compiled::stencil
  std::optional<adjoint::Derivative> second;            // adjoint of the tangent, with respect to inputs and directions
  std::optional<adjoint::Derivative> gauss_newton, gauss_newton_adjoint;  // for a loss that is a sum of squares
};

/// A divisor, or the side of a choice, stored in a field by the program names.watched: see dpde_watched.
struct Watched {
  std::string field, text, help;
  Origin origin;  // of the quotient or the choice
  bool is_switch = false, begins_with_one_sign = false;
  int loss = 0;                        // > 0: number of the only loss that contains it, counted from 1
  std::string below = {}, above = {};  // states of the program names.watched_step
};

struct CachedCode {
  std::string key;  // of the code in the cache; "" without a cache
  bool is_from_cache = false;
};

/// An adjoint of the step that the run may take in place of the plain one.
struct AdjointVariant {
  std::string adjoint;    // adds gradients with respect to coefficients to its inputs
  std::string step = "";  // "": the scene's. Else a step that also stores the fields that `adjoint` reads
};

struct Compiled {
  CompileOptions options;  // options it was compiled with
  ast::File ast;
  std::optional<model::Problem> problem;  // absent: the file has only kernels and programs
  stencil::Module stencil;                // all programs, with derivatives
  std::vector<std::string> primal_programs;
  std::map<std::string, Derived> derived;   // by primal program
  adjoint::Activity activity;               // variables of differentiation (states of the scene, params)
  std::vector<model::Jump> jumps_left_out;  // jumps ignored in derivatives, with options.takes_jumps
  std::vector<Watched> watched;             // checked by gradients; empty with options.trusts_signs
  std::vector<Origin> unwatched;            // quotients that depend on a sign which gradients do not check
  loop::Module loop;
  std::vector<AdjointVariant> variants;           // of the step's adjoint
  std::shared_ptr<codegen::CompiledModule> code;  // null without a backend
  CachedCode cached;
  double seconds = 0;

  /// Precision of fields.
  Precision real() const { return problem ? problem->scheme.real : Precision::f64; }
  /// Whether any part, fields or networks, is in single precision.
  bool is_single() const;
  stencil::ProgramNames names;                          // of the scene's programs
  std::string step_name() const { return names.step; }  // "" without a problem
  /// Programs that compute fields from parameters before the first step; each may be missing.
  std::vector<std::string> formula_programs() const;
  std::vector<std::string> derivative_programs(bool adjoint) const;
  /// nullptr if there is no such program.
  const dpde_program* program(const std::string& name) const { return code ? code->find(name) : nullptr; }
  const dpde_program* adjoint_of(const std::string& name) const;
};

/// Parses, lowers, differentiates and compiles. Returns nullopt if `sink` has errors afterwards.
std::optional<Compiled> compile(const SourceFile& source, const CompileOptions& options, DiagnosticSink& sink);

/// Variables of differentiation of program `name`: the part of `activity` that it reads.
adjoint::Activity active_inputs(const Compiled& compiled, const std::string& name);

/// The step of a scene with a task and its adjoint, for which variants are made; no names if there are none.
struct StepToReverse {
  std::string step, adjoint;
  std::vector<std::string> gradients;  // with respect to coefficients: results of the adjoint
};
StepToReverse step_to_reverse(const Compiled& compiled);

struct LoweredToLoop {
  loop::Module module;
  std::vector<AdjointVariant> variants;
};
/// Rows of the named programs after the optimising passes, as input of the back ends, and the variants of the adjoint
/// of `reversed`, whose programs are added.
LoweredToLoop lower_to_loop(stencil::Module module, std::vector<std::string> programs, Precision real,
                            const StepToReverse& reversed = {}, const loop::ParamValues& values = {});

/// Takes `loop` in place of the rows of the compiled programs; it has no variants of the adjoint.
void replace_loop(Compiled& compiled, loop::Module loop);

/// Part of `module`: the named programs, their kernels, and the loops that run only these programs.
stencil::Module extract(const stencil::Module& module, const std::vector<std::string>& programs);

}  // namespace dpde::driver
