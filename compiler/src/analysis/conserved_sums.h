// SPDX-License-Identifier: Apache-2.0
// Which sums a step leaves as they are: integrals of fields and of their squares, and a person's observables, as runs
// of the compiled step from random states on a few cells have them.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "driver/session.h"

namespace dpde::analysis {

/// "integral(u)", "integral(u^2)", "integral(u^2 + v^2)" and names of observables. nullopt where no run could be made.
std::optional<std::vector<std::string>> conserved_sums(const SourceFile& source,
                                                       const std::shared_ptr<const driver::Compiled>& compiled);

}  // namespace dpde::analysis
