// SPDX-License-Identifier: Apache-2.0
// JSON whose keys keep their order. The library's templates are compiled once, in json.cpp: in each file that uses them
// they take seconds.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

extern template class nlohmann::basic_json<nlohmann::ordered_map>;

namespace dpde::tools {

using Json = nlohmann::ordered_json;

/// What a text says; a discarded value where it is no JSON.
Json parse_json(const std::string& text);
/// One line; bytes that are no UTF-8 are replaced.
std::string json_text(const Json& value);

}  // namespace dpde::tools
