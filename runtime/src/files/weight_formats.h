// SPDX-License-Identifier: Apache-2.0
// The two formats of weights files as bytes in memory. Inside the runtime only.
#pragma once

#include <string>
#include <string_view>

#include "dpde/runtime/weights_file.h"

namespace dpde {

std::vector<NamedArray> parse_safetensors(std::string_view bytes, const std::string& name);
std::string compose_safetensors(std::span<const NamedArray> arrays, bool is_single);

std::vector<NamedArray> parse_npz(std::string_view bytes, const std::string& name);
std::string compose_npz(std::span<const NamedArray> arrays, bool is_single);

}  // namespace dpde
