// SPDX-License-Identifier: Apache-2.0
#include "support/json.h"

template class nlohmann::basic_json<>;

namespace dpde::testing {

Json parse_json(const std::string& text) { return Json::parse(text, nullptr, false); }

}  // namespace dpde::testing
