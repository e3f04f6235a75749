// SPDX-License-Identifier: Apache-2.0
// What a statement does to fields and numbers. Analyses ask here, or match() over all kinds of statement, so that a new
// kind does not compile before each of them knows it: tests/house refuses anything that looks for one kind alone.
#pragma once

#include <set>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "stencil/stencil.h"
#include "support/match.h"

namespace dpde::stencil {

/// Names in the order in which they first appear, each once.
struct Effects {
  std::vector<std::string> reads;    // fields whose values it uses
  std::vector<std::string> writes;   // fields that have other values afterwards, whatever they had before
  std::vector<std::string> updates;  // fields to whose values it adds
  std::vector<std::string> fills;    // fields whose halo it fills, and where they lie on walls the values there
  std::vector<std::string> params;   // of kernels and of boundary values
  std::vector<std::string> sums;
  std::vector<std::string> kernels, networks;  // that it runs and applies
  std::vector<std::string> inner;              // fields of a block, which nothing outside knows
  std::vector<std::string> invalidates_halo;   // fields whose halo is anything afterwards
};
Effects effects(const Module& module, const Statement& statement);

/// One pass of a repeat as a program of its own, with what it loads as inputs.
Program pass_of(const Repeat& repeat, const Program& program);
/// The block of a solve as a program of its own, which keeps the images; the unknowns are inputs of it.
Program operator_of(const Solve& solve, const Program& program);
/// What the operator reads beside the unknowns.
std::vector<std::string> coefficients_of(const Module& module, const Solve& solve);
/// What its preconditioner is given beside what an iteration leaves.
std::vector<std::string> fields_beside_residual(const Solve& solve);

/// The numbers of passes in the statements, those of repeats in repeats too, in the order in which they appear.
std::vector<std::string> counters_of(std::span<const Statement> statements);

/// That the run runs, which is in the module.
const Kernel& kernel_of(const Module& module, const Run& run);
/// The kernels that the program runs, each once, in order.
std::vector<const Kernel*> kernels_run(const Module& module, const Program& program);

/// The statements but for fills, those in repeats too.
std::vector<Statement> without_fills(const std::vector<Statement>& statements);

/// The names of the kernels and networks that the programs need, networks in the order in which they first appear.
struct Parts {
  std::set<std::string> kernels;
  std::vector<std::string> networks;
};
Parts parts_of(const std::vector<Program>& programs);

/// `f` on each fill, in blocks too.
template <class F>
void for_each_fill(std::span<const Statement> statements, const F& f) {
  for (const Statement& statement : statements) {
    match(
        statement, [&](const Fill& fill) { f(fill); }, [](const Fold&) {}, [](const Reduce&) {},
        [](const NetworkCall&) {}, [](const Transform&) {}, [](const Run&) {},
        [&](const Solve& solve) {
          for_each_fill(std::span(solve.body), f);
          for_each_fill(std::span(solve.step), f);
        },
        [&](const Repeat& repeat) { for_each_fill(std::span(repeat.body), f); });
  }
}
template <class F>
void for_each_fill(const Program& program, const F& f) {
  for_each_fill(std::span(program.body), f);
}

/// `f` on each run of a kernel, in blocks too, which it may change where the statements may be changed.
template <class AnyStatement, class F>
void for_each_run(std::span<AnyStatement> statements, const F& f) {
  constexpr bool is_const = std::is_const_v<AnyStatement>;
  using AnyRun = std::conditional_t<is_const, const Run, Run>;
  using AnySolve = std::conditional_t<is_const, const Solve, Solve>;
  using AnyRepeat = std::conditional_t<is_const, const Repeat, Repeat>;
  for (auto& statement : statements) {
    match(
        statement, [](const Fill&) {}, [](const Fold&) {}, [](const Reduce&) {}, [](const NetworkCall&) {},
        [](const Transform&) {}, [&](AnyRun& run) { f(run); },
        [&](AnySolve& solve) {
          for_each_run(std::span(solve.body), f);
          for_each_run(std::span(solve.step), f);
        },
        [&](AnyRepeat& repeat) { for_each_run(std::span(repeat.body), f); });
  }
}
template <class AnyProgram, class F>
void for_each_run(AnyProgram& program, const F& f) {
  for_each_run(std::span(program.body), f);
}

}  // namespace dpde::stencil
