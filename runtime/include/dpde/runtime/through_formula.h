// SPDX-License-Identifier: Apache-2.0
// What unknown parameters and weights do through the formulas of fields (initial states, coefficients): the last gradient of a rollout,
// taken back by the adjoint of the program that computes them. Simulations of hosts and the commands share it, for gradients
// and for products of second derivatives.
#pragma once

#include <string>
#include <string_view>

#include "dpde/runtime/rollout.h"

namespace dpde {

/// `store` has the fields and runs programs on them: store.field(name) -> Field&, store.execute(program) -> const Executor&.
/// counts(field): whether the rollout's field of this name came from the formula. add(param, value) gets each sum <param>_bar,
/// add_network(name) is called for each network, whose gradient is then where store.execute has it added.
template <class Store, class Counts, class Add, class AddNetwork>
void add_through_formula(Store& store, const dpde_program& adjoint, const Rollout& rollout, const Counts& counts, const Add& add,
                         const AddNetwork& add_network) {
  constexpr std::string_view bar = "_bar";
  const auto without_bar = [&](const char* name) { return std::string_view(name).substr(0, std::string_view(name).size() - bar.size()); };
  for (int32_t f = 0; f < adjoint.input_count; ++f) {
    if (!std::string_view(adjoint.fields[f]).ends_with(bar)) continue;
    const std::string_view name = without_bar(adjoint.fields[f]);
    Field& seed = store.field(adjoint.fields[f]);
    seed.fill(0);
    const FieldView found = rollout.bar_of(name);
    if (found.base != nullptr && counts(name)) copy_interior(seed.layout(), seed.base(), found);
  }
  const Executor& done = store.execute(adjoint);
  for (int32_t n = 0; n < adjoint.network_count; ++n) add_network(adjoint.networks[n]->name);
  for (int32_t s = 0; s < adjoint.sum_count; ++s) {
    if (std::string_view(adjoint.sums[s]).ends_with(bar)) add(without_bar(adjoint.sums[s]), done.sums()[static_cast<std::size_t>(s)]);
  }
}

}  // namespace dpde
