// SPDX-License-Identifier: Apache-2.0
// A text for each kind of mistake, generated from tests/diagnostics at configuration. For mistakes that show when the
// model runs, the commands precede it.
#pragma once

#include <string_view>
#include <vector>

namespace dpde::tools {

struct Mistake {
  std::string_view kind;  // the name in error_codes.h
  std::string_view text;  // with a marker at the mistake: #~ and the code
};
const std::vector<Mistake>& mistakes();

}  // namespace dpde::tools
