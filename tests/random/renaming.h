// SPDX-License-Identifier: Apache-2.0
// Texts in which all that a person named is called otherwise, by names that the compiler makes up itself: t1, u_next,
// x_bar, m_step. Nothing but the names may change.
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

/// Of a text without mistakes. Words that the language gives a meaning to stay, and so do names of components.
Renaming rename_all(const std::string& text, std::uint64_t seed);

}  // namespace dpde::testing
