// SPDX-License-Identifier: Apache-2.0
#include "stability/substeps.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace dpde::stability {

int parts_of(driver::Session& session) {
  const dpde_program* rate = session.compiled().program(session.compiled().names.rate);
  if (rate == nullptr || session.problem().substeps.courant <= 0) return 1;
  Workspace::Bound bound;
  for (int s = 0; s < session.rollout().state_count(); ++s)
    bound[session.rollout().state_name(s)] = session.rollout().initial(s).base();
  session.workspace().run(*rate, session.problem().t_begin, bound);
  const std::vector<double> rates = session.workspace().dense(session.compiled().names.rate_field);
  session.workspace().release(*rate);
  const double largest = *std::ranges::max_element(rates);
  const double parts = std::ceil(session.problem().step * largest / session.problem().substeps.courant);
  return std::isfinite(parts) && parts >= 1 && parts < 1e9 ? static_cast<int>(parts) : 1;
}

}  // namespace dpde::stability
