// SPDX-License-Identifier: Apache-2.0
// Words that the parser accepts, for editors.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dpde::ast {

/// First words of blocks: model, scene, ...
std::vector<std::string> words_of_declarations();

/// First words of lines in a block of this kind (model, scene, ..., repeat); empty for other words.
std::vector<std::string> words_of_block(std::string_view block);
/// All kinds of block with such words.
std::vector<std::string> kinds_of_block();

/// Words allowed after a comma in these lines of scenes.
inline constexpr std::string_view grid_options[] = {"cells", "periodic", "stretched"};
inline constexpr std::string_view time_options[] = {"step",     "courant", "speed",       "tolerance",
                                                    "absolute", "first",   "until steady"};

}  // namespace dpde::ast
