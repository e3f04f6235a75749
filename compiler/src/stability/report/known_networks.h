// SPDX-License-Identifier: Apache-2.0
// Networks that read no perturbed field: their outputs are known at the start of the run, as coefficients are.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stencil/stencil.h"

namespace dpde::stability {

/// The module without such networks; calls of their derivatives stay. Their outputs become inputs of the program and
/// are added to `results`. Networks of the host stay, too: their outputs are not known before the run.
stencil::Module without_known_networks(stencil::Module module, std::set<std::string>& results);

/// These outputs of networks in all cells, from a step of length 0 at time t. Empty if there is none, or if a value is
/// not finite.
std::map<std::string, std::vector<double>> values_of_networks(driver::Session& session,
                                                              const std::set<std::string>& results, double t);

}  // namespace dpde::stability
