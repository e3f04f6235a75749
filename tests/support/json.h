// SPDX-License-Identifier: Apache-2.0
// JSON in tests. The library's templates are compiled once, in json.cpp: in each file that reads JSON they take
// seconds.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

extern template class nlohmann::basic_json<>;

namespace dpde::testing {

using Json = nlohmann::json;

/// What a text says; a discarded value where it is no JSON.
Json parse_json(const std::string& text);

}  // namespace dpde::testing
