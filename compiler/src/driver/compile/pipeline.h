// SPDX-License-Identifier: Apache-2.0
// The way of a .dpde file through the levels; the only place that knows the order:
//
//   text -> ast -> model::Problem -> stencil::Module -> + tangent, adjoint -> loop::Module -> compiled programs
//
// After each stage an observer sees its name and can ask for its text.
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
  model::Selection selection;      // the scene or task; in a file without scenes a program, or "" for all
  std::optional<Backend> backend;  // nullopt: stop at the loop level
  bool tangent = false, adjoint = false;
  bool second = false;            // second derivatives, with tangent and adjoint; what has none is left without
  std::optional<Precision> real;  // of a scene and its networks, in place of what the file says
  bool without_task = false;      // of a task only its scene and scheme; "" is the only scene, if there is just one
  /// Of a scene without a task: add one for certify(): all states and parameters unknown, the loss a made-up
  /// functional.
  bool certify = false;
  bool seeded = false;         // of a task: seed_the_end()
  bool manufactured = false;   // of a scene: with a solution that is made up, model/boundary/manufactured.h
  bool by_everything = false;  // derivatives by all coefficients and parameters, sought or not
  bool takes_jumps = false;    // what jumps where it switches is differentiated without the jump
  bool trusts_signs = false;   // no gradient looks at Compiled::watched
  bool verify = false;         // check every level's invariants after each stage
  StageObserver after;         // may be empty
  double runs = 1;  // of the scene, that the code is for; any_number_of_runs of what is measured, and of hosts
  std::shared_ptr<codegen::CodeCache> cache;  // null: everything is compiled anew
};

/// A program and the programs of its derivatives, when it depends on something active.
struct Derived {
  std::optional<adjoint::Derivative> tangent, adjoint;  // names; their kernels are in Compiled::stencil
  std::optional<adjoint::Derivative> second;            // the adjoint of the tangent, by inputs and directions alike
  std::optional<adjoint::Derivative> squares, squares_adjoint;  // of a loss that is a sum of squares, by the directions
};

/// What is divided by, or where a choice is, kept in a field by the program names.watched: see dpde_watched.
struct Watched {
  std::string field, text, help;
  Origin origin;  // of the quotient or the choice
  bool is_switch = false, begins_with_one_sign = false;
  int loss = 0;                        // > 0: the number of that loss, counted from 1, in which alone it stands
  std::string below = {}, above = {};  // states of the program names.watched_step
};

struct Compiled {
  CompileOptions options;  // what it was made with
  ast::File ast;
  std::optional<model::Problem> problem;  // absent: a file of kernels and programs only
  stencil::Module stencil;                // all programs, derivatives too
  std::vector<std::string> primal_programs;
  std::map<std::string, Derived> derived;   // by primal program
  adjoint::Activity activity;               // what derivatives are taken with respect to (states of the scene, params)
  std::vector<model::Jump> jumps_left_out;  // of derivatives, as options.takes_jumps has it
  std::vector<Watched> watched;             // what gradients look at; nothing with options.trusts_signs
  std::vector<Origin> unwatched;            // quotients whose sign no gradient looks at, though it hangs on it
  loop::Module loop;
  std::shared_ptr<codegen::CompiledModule> code;  // null without a backend
  bool code_from_cache = false;
  std::string code_key;  // of the code in the cache; "" without one
  double seconds = 0;

  /// Of fields.
  Precision real() const { return problem ? problem->scheme.real : Precision::f64; }
  /// Whether it computes anything in single precision: fields, or networks.
  bool is_single() const;
  stencil::ProgramNames names;                          // of the scene's programs
  std::string step_name() const { return names.step; }  // "" without a problem
  /// Those that turn parameters into fields before the first step; each may be missing.
  std::vector<std::string> formula_programs() const;
  std::vector<std::string> derivative_programs(bool adjoint) const;
  /// nullptr when there is no such program.
  const dpde_program* program(const std::string& name) const { return code ? code->find(name) : nullptr; }
  const dpde_program* adjoint_of(const std::string& name) const;
};

/// Parses, lowers, differentiates and compiles. nullopt when `sink` has errors afterwards.
std::optional<Compiled> compile(const SourceFile& source, const CompileOptions& options, DiagnosticSink& sink);

/// What the derivatives of program `name` are taken with respect to: the part of `activity` that it reads.
adjoint::Activity active_inputs(const Compiled& compiled, const std::string& name);

/// The gradients by coefficients that the adjoint of the step keeps.
adjoint::AccumulatingAdjoint totals_of(const Compiled& compiled);
/// The step and its adjoint, where one may keep values for the other.
adjoint::Kept kept_of(const Compiled& compiled);

/// The rows of the named programs, after the passes for speed: what the back ends get. With those of the
/// totals and of what is kept.
loop::Module lower_to_loop(stencil::Module module, std::vector<std::string> programs, Precision real,
                           const adjoint::AccumulatingAdjoint& totals = {}, const adjoint::Kept& kept = {},
                           const loop::ParamValues& values = {});

/// The named programs of `module` with the kernels they run and, of the loops, those that run only these programs.
stencil::Module extract(const stencil::Module& module, const std::vector<std::string>& programs);

}  // namespace dpde::driver
