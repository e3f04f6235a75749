// SPDX-License-Identifier: Apache-2.0
// Transposes of linear solves: see adjoint/solves.h.
#include <algorithm>

#include "adjoint/reverse/reversal.h"
#include "adjoint/solves.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/operator_traits.h"
#include "stencil/build.h"

namespace dpde::adjoint {

using namespace stencil;

void Reversal::reverse_solve(const Solve& solve, int index) {
  std::vector<std::string> seeds;
  bool has_seed = false;
  for (const std::string& unknown : solve.unknowns) has_seed = has_seed || bars_.contains(unknown);
  if (!has_seed) return;
  for (const std::string& unknown : solve.unknowns) {
    seeds.push_back(names_.of(unknown));
    if (bars_.erase(unknown) == 0) add_store(seeds.back(), 0.0, "seed", {program_, "_adjoint", names_, kernels_, body});
  }
  const auto varies = [&](const std::string& field) { return varied_.fields.contains(field); };
  const bool operator_varies = has_varied_operator(module_, solve, varied_);
  if (!operator_varies && std::ranges::none_of(solve.rights, varies)) return;
  const std::vector<std::string> multipliers = add_transposed_solve(solve, seeds, index);
  if (operator_varies) reverse_coefficients(solve, multipliers, index);
  for (std::size_t i = 0; i < multipliers.size(); ++i) {
    if (varies(solve.rights[i])) add_inside(solve.rights[i], access(multipliers[i]));
  }
}

/// Solves with the same block, as a symmetric operator is its own transpose. The block takes differences before it
/// multiplies, but the transpose of its statements adds products of single values: in f32 their rounding errors would
/// swamp a term without derivatives.
std::vector<std::string> Reversal::add_same_solve(const Solve& solve, const std::vector<std::string>& seeds,
                                                  int index) {
  std::vector<std::string> multipliers{names_.fresh(solve.unknowns.front() + "_multiplier")};
  Solve same = copy_of(module_, solve, multipliers, names_, kernels_);
  same.rights = seeds;
  for (const std::string& field : coefficients_of(kernels_, same)) needed[field] = index;
  for (const std::string& field : fields_beside_residual(same)) needed[field] = index;
  if (solve.by.method != SolveMethod::cg) same.preconditioner.reset();
  body.push_back(std::move(same));
  return multipliers;
}

/// Returns the fields with A^+T*seeds. For a nonlinear solve A is the derivative of its block at the solution, which is
/// stored in the copy of the unknown.
std::vector<std::string> Reversal::add_transposed_solve(const Solve& solve, const std::vector<std::string>& seeds,
                                                        int index) {
  if (certain_traits_of(module_, program_, solve).is_symmetric) return add_same_solve(solve, seeds, index);
  Module source;
  std::vector<std::string> unknowns;
  for (const std::string& unknown : solve.unknowns) unknowns.push_back(names_.fresh(unknown));
  const Solve copy = copy_of(module_, solve, unknowns, names_, source);
  const Program program = operator_of(copy, program_);
  const Varied varied = find_varied(source, program, {{unknowns.begin(), unknowns.end()}, {}});
  Reversal block(source, program, varied, names_, kernels_, sink_);
  block.reverse_all();
  block.finish({unknowns.begin(), unknowns.end()});
  block.restore_seed_names();
  Solve transposed{{}, seeds, {}, block.statements(kernels_), solve.by, solve.written};
  if (solve.by.method == SolveMethod::cg)  // for symmetric operators only: A^-1 does not approximate A^-T
    transposed.preconditioner = copy.preconditioner;
  for (const std::string& field : fields_beside_residual(transposed)) needed[field] = index;
  for (const std::string& unknown : unknowns) transposed.images.push_back(names_.of(unknown));
  for (const std::string& image : copy.images) transposed.unknowns.push_back(names_.of(image));
  for (const std::string& field : coefficients_of(kernels_, transposed)) {
    const auto unknown = std::ranges::find(unknowns, field);
    if (unknown == unknowns.end()) {
      needed[field] = index;
      continue;
    }
    // A kernel that computes a coefficient of a linear operator may also read the unknown, for unused results.
    const std::string& solution = solve.unknowns[static_cast<std::size_t>(unknown - unknowns.begin())];
    if (!solve.is_linear) needed[solution] = index;
    add_store(field, solve.is_linear ? Expr(0.0) : access(solution), solve.is_linear ? "unused" : "solution",
              {program_, "_adjoint", names_, kernels_, body});
  }
  std::vector<std::string> multipliers = transposed.unknowns;
  body.push_back(std::move(transposed));
  refused.merge(block.refused);
  has_failed = has_failed || block.has_failed || !check_overwritten(source, program, block.needed, sink_);
  return multipliers;
}

/// -multipliers are the seeds of the images of a copy of the operator.
void Reversal::reverse_coefficients(const Solve& solve, const std::vector<std::string>& multipliers, int index) {
  const OperatorCopy copy = copy_with_inputs(module_, solve, program_, names_);
  for (const auto& [input, copied] : copy.inputs) needed[input] = index;
  const Writing into{program_, "_adjoint", names_, kernels_, body};
  add_copies(copy, into);
  for (std::size_t i = 0; i < multipliers.size(); ++i)
    add_store(names_.of(copy.images[i]), -access(multipliers[i]), "seed", into);
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
