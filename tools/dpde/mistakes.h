// SPDX-License-Identifier: Apache-2.0
// A text for each kind of mistake that one finds in a model, made from tests/diagnostics when dpde is configured; of
// those that show when it is run, from the folder `runs` there, with the commands in front.
#pragma once

#include <string_view>
#include <vector>

namespace dpde::tools {

struct Mistake {
  std::string_view kind;  // the name in error_codes.h
  std::string_view text;  // where the mistake is: #~ and the code
};
const std::vector<Mistake>& mistakes();

}  // namespace dpde::tools
