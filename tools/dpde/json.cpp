// SPDX-License-Identifier: Apache-2.0
#include "json.h"

template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace dpde::tools {

Json parse_json(const std::string& text) { return Json::parse(text, nullptr, false); }

std::string json_text(const Json& value) { return value.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace dpde::tools
