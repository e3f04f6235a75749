// SPDX-License-Identifier: Apache-2.0
// Networks that read nothing that is perturbed: what they give is known where the run begins, as coefficients are.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stencil/stencil.h"

namespace dpde::stability {

/// Networks by value, with what their derivatives give left in: results are inputs of the program then, and are added
/// to `results`. What a network of the host's gives is not known before it runs.
stencil::Module without_known_networks(stencil::Module module, std::set<std::string>& results);

/// These results of networks in all cells: of a step of no length at this time. Empty where there is none, or where a
/// value is not finite.
std::map<std::string, std::vector<double>> values_of_networks(driver::Session& session,
                                                              const std::set<std::string>& results, double t);

}  // namespace dpde::stability
