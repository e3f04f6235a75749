// SPDX-License-Identifier: Apache-2.0
// The words that the parser goes by, for editors: what may stand where.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dpde::ast {

/// model, scene, ...: what a block begins with.
std::vector<std::string> words_of_declarations();

/// The first words of lines in a block of that kind (model, scene, ..., repeat); none for other words.
std::vector<std::string> words_of_block(std::string_view block);
/// All kinds of block that have such words.
std::vector<std::string> kinds_of_block();

/// What may stand behind a comma of these lines of scenes.
inline constexpr std::string_view grid_options[] = {"cells", "periodic", "stretched"};
inline constexpr std::string_view time_options[] = {"step",     "courant", "speed",       "tolerance",
                                                    "absolute", "first",   "until steady"};

}  // namespace dpde::ast
