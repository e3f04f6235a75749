// SPDX-License-Identifier: Apache-2.0
// Texts with all user-chosen names replaced by names that the compiler itself generates: t1, u_next, x_bar, m_step.
// Results must not change.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace dpde::testing {

struct Renaming {
  std::string text;
  std::map<std::string, std::string> names;  // old to new
  std::string operator()(const std::string& name) const;
};

/// Renames all names of a valid text. Words of the language and names of components stay.
Renaming rename_all(const std::string& text, std::uint64_t seed);

}  // namespace dpde::testing
