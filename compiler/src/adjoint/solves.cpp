// SPDX-License-Identifier: Apache-2.0
#include "adjoint/solves.h"

#include <algorithm>
#include <map>

#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/rename.h"

namespace dpde::adjoint {

using namespace stencil;

bool has_varied_operator(const Module& module, const Solve& solve, const Varied& varied) {
  const auto varies = [&](const std::string& field) { return varied.fields.contains(field); };
  const auto param_varies = [&](const std::string& param) { return varied.params.contains(param); };
  return std::ranges::any_of(coefficients_of(module, solve), varies) ||
         std::ranges::any_of(effects(module, solve).params, param_varies);
}

void add_kernels(Module& to, const Module& from, const Program& program) {
  for (const Kernel* kernel : kernels_run(from, program)) {
    if (!to.find_kernel(kernel->name)) to.kernels.push_back(*kernel);
  }
}

namespace {

/// New names for `fields` and for all kernels.
Renaming fresh_names(const std::vector<std::string>& fields, DerivedNames& names) {
  Renaming renaming{{}, [&names](const std::string& kernel) { return names.fresh_kernel(kernel); }};
  for (const std::string& field : fields) renaming.fields[field] = names.fresh(field);
  return renaming;
}

}  // namespace

Solve copy_of(const Module& module, const Solve& solve, const std::vector<std::string>& unknowns, DerivedNames& names,
              Module& kernels) {
  Renaming renaming = fresh_names(effects(module, solve).block_locals, names);
  for (std::size_t i = 0; i < unknowns.size(); ++i) renaming.fields[solve.unknowns[i]] = unknowns[i];
  Solve copy = solve;
  copy.unknowns = unknowns;
  copy.guesses.clear();  // they approximate the solution, not its tangent
  for (std::string& image : copy.images) image = renaming.field(image);
  if (copy.preconditioner) {
    for (auto* fields : {&copy.preconditioner->inputs, &copy.preconditioner->results}) {
      for (std::string& field : *fields) field = renaming.field(field);
    }
  }
  copy.body = renamed(module, solve.body, renaming, kernels);
  return copy;
}

OperatorCopy copy_with_inputs(const Module& module, const Solve& solve, const Program& program, DerivedNames& names) {
  std::vector<std::string> inputs = coefficients_of(module, solve), fields = effects(module, solve).block_locals;
  std::erase_if(inputs, is_coordinate);
  inputs.insert(inputs.end(), solve.unknowns.begin(), solve.unknowns.end());
  fields.insert(fields.end(), inputs.begin(), inputs.end());
  const Renaming renaming = fresh_names(fields, names);
  OperatorCopy copy{{}, operator_of(solve, program), solve.images, {}, solve.unknowns};
  copy.program.body = renamed(module, solve.body, renaming, copy.module);
  for (std::string& image : copy.images) image = renaming.field(image);
  copy.program.keeps = copy.images;
  for (const std::string& input : inputs) copy.inputs.emplace_back(input, renaming.field(input));
  return copy;
}

Activity OperatorCopy::activity(const Varied& varied) const {
  Activity active{{}, varied.params};
  for (const auto& [input, copied] : inputs) {
    if (is_active(input, varied)) active.fields.insert(copied);
  }
  return active;
}

void add_copies(const OperatorCopy& copy, const Writing& into) {
  for (const auto& [input, copied] : copy.inputs) add_store(copied, access(input), "copy", into);
}

}  // namespace dpde::adjoint
