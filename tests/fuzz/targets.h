// SPDX-License-Identifier: Apache-2.0
// What has to hold for any bytes, as functions a fuzzer calls: "" or what is wrong. A crash, a hang or a sanitizer's
// report says so by itself.
#pragma once

#include <string>
#include <string_view>

namespace dpde::testing {

/// Text to ast: every report points into the text and can be shown; what is right prints as a fixed point.
std::string fuzz_parser(std::string_view text);

/// Text to kernels and programs: what is right is verified and prints as a fixed point.
std::string fuzz_stencil_reader(std::string_view text);

/// Text to the models, schemes, scenes and tasks, and those to kernels: what is right is verified, at every level.
std::string fuzz_model(std::string_view text);

/// Whether the parser has nothing to say.
bool is_understood(std::string_view text);

}  // namespace dpde::testing
