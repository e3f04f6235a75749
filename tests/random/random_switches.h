// SPDX-License-Identifier: Apache-2.0
// Random models with switches: conditions of states, unknowns, time and places, sign, fraction, nested, with and, or
// and not; with branches that meet where they switch, and with such that jump.
#pragma once

#include <cstdint>
#include <string>

namespace dpde::testing {

struct SwitchModel {
  std::string text;              // with task `t`
  bool may_jump = false;         // somewhere branches do not meet, by something that moves
  bool may_only_switch = false;  // an unknown may stand in conditions alone
};

/// The same for the same seed, everywhere.
SwitchModel random_switches(std::uint64_t seed);

}  // namespace dpde::testing
