// SPDX-License-Identifier: Apache-2.0
// What unknown parameters and weights do through the formulas of fields (initial states, coefficients): the last
// gradient of a rollout, taken back by the adjoint of the program that computes them. Simulations of hosts and the
// commands share it, for gradients and for products of second derivatives.
#pragma once

#include <string>
#include <string_view>

#include "dpde/runtime/links.h"
#include "dpde/runtime/rollout.h"

namespace dpde {

/// `store` has the fields and runs programs on them: store.field(name) -> Field&, store.execute(program) -> const
/// Executor&. counts(field): whether the rollout's field of this name came from the formula. add(param, value) gets the
/// sum of each parameter, add_network(name) is called for each network, whose gradient is then where store.execute has
/// it added.
template <class Store, class Counts, class Add, class AddNetwork>
void add_through_formula(Store& store, const dpde_program& adjoint, const Rollout& rollout, const Counts& counts,
                         const Add& add, const AddNetwork& add_network) {
  for (const dpde_link& link : links_of(adjoint)) {
    if (!is_seed_of_field(adjoint, link)) continue;
    Field& seed = store.field(adjoint.fields[link.derived]);
    seed.fill(0);
    const FieldView found = rollout.bar_of(link.primal);
    if (found.base != nullptr && counts(link.primal)) copy_interior(seed.layout(), seed.base(), found);
  }
  const Executor& done = store.execute(adjoint);
  for (int32_t n = 0; n < adjoint.network_count; ++n) add_network(adjoint.networks[n]->name);
  for (const dpde_link& link : links_of(adjoint)) {
    if (link.kind == DPDE_LINK_PARAM && link.derived >= 0)
      add(link.primal, done.sums()[static_cast<std::size_t>(link.derived)]);
  }
}

}  // namespace dpde
