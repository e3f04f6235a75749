// SPDX-License-Identifier: Apache-2.0
// The operations of a program, resolved for one layout. Inside the runtime only.
//
// On a subgrid, communication between ranks and the fills after sweeps are separate operations (seams.h).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "dpde/runtime/owned_memory.h"
#include "exec/inference.h"
#include "exec/passes.h"
#include "exec/program_solve.h"
#include "exec/reduce.h"
#include "exec/sweep.h"
#include "grid/fill.h"
#include "grid/seams.h"
#include "transform/transform.h"

namespace dpde {

struct Operation;

/// A solve, the operations that apply its operator and those of a step of Newton's method.
struct SolveOperation {
  ProgramSolve solve;
  std::optional<Inference> preconditioner;
  std::vector<Operation> block, step;
};

struct RepeatOperation {
  Passes passes;
  std::vector<Operation> block;
};

struct Operation {
  std::variant<Sweep, HaloFill, HaloFold, SeamWork, FieldReduction, Inference, FieldTransform, SolveOperation,
               RepeatOperation>
      kind;
};

/// Calls `f` on each operation; after an operation with blocks, on those of its blocks.
void for_each_operation(auto& operations, const auto& f) {
  for (auto& operation : operations) {
    f(operation);
    if (auto* solve = std::get_if<SolveOperation>(&operation.kind)) {
      for_each_operation(solve->block, f);
      for_each_operation(solve->step, f);
    } else if (auto* repeat = std::get_if<RepeatOperation>(&operation.kind)) {
      for_each_operation(repeat->block, f);
    }
  }
}
/// Calls `f` on each operation of a kind, in blocks too.
template <class Kind>
void for_each_of(auto& operations, const auto& f) {
  for_each_operation(operations, [&](auto& operation) {
    if (auto* one = std::get_if<Kind>(&operation.kind)) f(*one);
  });
}

/// Common arguments of the operations of a program.
struct OperationSetup {
  const dpde_program* program;
  const dpde_layout* layout;
  const Team* team;
  Seams* seams;  // null if the layout is the whole grid
  std::vector<Stack>* stacks;
  std::shared_ptr<SolverShelf> shelf;
};
/// @throws Error(run) for an operation of an unknown kind.
std::vector<Operation> make_operations(const OperationSetup& setup, const dpde_operation* source, int count);

}  // namespace dpde
