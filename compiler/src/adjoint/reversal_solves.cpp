// SPDX-License-Identifier: Apache-2.0
// Transposes of linear solves: see adjoint/solves.h.
#include "adjoint/reversal.h"
#include "adjoint/solves.h"
#include "stencil/build.h"
#include "stencil/effects.h"

namespace dpde::adjoint {

using namespace stencil;

void Reversal::reverse_solve(const Solve& solve, int index) {
  if (bars_.erase(solve.unknown) == 0) return;
  const std::string seed = names_.of(solve.unknown);
  const bool right_varies = varied_.fields.contains(solve.right);
  const bool operator_varies = has_varied_operator(module_, solve, varied_);
  if (!right_varies && !operator_varies) return;
  const std::string multiplier = add_transposed_solve(solve, seed, index);
  if (operator_varies) reverse_coefficients(solve, multiplier, index);
  if (right_varies) add_inside(solve.right, access(multiplier));
}

/// Returns the field that holds A^+T*seed.
std::string Reversal::add_transposed_solve(const Solve& solve, const std::string& seed, int index) {
  Module source;
  const Solve copy = copy_of(module_, solve, names_.fresh(solve.unknown), names_, source);
  const Program program = operator_of(copy, program_);
  const Varied varied = find_varied(source, program, {{copy.unknown}, {}});
  Reversal block(source, program, varied, names_, kernels_, sink_);
  block.reverse_all();
  block.finish({copy.unknown});
  block.restore_seed_names();
  Solve transposed{names_.of(copy.unknown),    seed,     names_.of(copy.image),
                   block.statements(kernels_), solve.by, solve.written};
  for (const std::string& field : coefficients_of(kernels_, transposed)) {
    if (field != copy.unknown) {
      needed[field] = index;
    } else {  // a kernel that makes a coefficient makes something of the unknown too, which nobody reads
      add_store(field, 0.0, "unused", {program_, "_adjoint", names_, kernels_, body});
    }
  }
  for (const std::string& field : spoiled_.add(effects(kernels_, transposed))) filled_.erase(field);
  const std::string multiplier = transposed.unknown;
  body.push_back(std::move(transposed));
  refused.merge(block.refused);
  has_failed = has_failed || block.has_failed || !check_overwritten(source, program, block.needed, sink_);
  return multiplier;
}

/// -multiplier is the seed of the image of a copy of the operator.
void Reversal::reverse_coefficients(const Solve& solve, const std::string& multiplier, int index) {
  const OperatorCopy copy = copy_with_inputs(module_, solve, program_, names_);
  for (const auto& [input, copied] : copy.inputs) {
    needed[input] = index;
    restore(input);
  }
  const Writing into{program_, "_adjoint", names_, kernels_, body};
  add_copies(copy, into);
  add_store(names_.of(copy.image), -access(multiplier), "seed", into);
  const Activity active = copy.activity(varied_);
  const Varied varied = find_varied(copy.module, copy.program, active);
  Reversal block(copy.module, copy.program, varied, names_, kernels_, sink_);
  block.reverse_all();
  block.finish(active.fields);
  block.restore_seed_names();
  for (Statement& statement : block.statements(kernels_)) body.push_back(std::move(statement));
  for (const auto& [input, copied] : copy.inputs) {
    if (active.fields.contains(copied)) add_inside(input, access(names_.of(copied)));
  }
  refused.merge(block.refused);
  has_failed = has_failed || block.has_failed || !check_overwritten(copy.module, copy.program, block.needed, sink_);
}

}  // namespace dpde::adjoint
