// SPDX-License-Identifier: Apache-2.0
// The words that the model level gives a meaning to, for editors.
#pragma once

#include <string>
#include <vector>

namespace dpde::model {

/// Functions and operators of formulas: lap, sin, mean, ...
std::vector<std::string> words_of_functions();
/// Keys of a scheme, and what each may be; of `split` an example.
std::vector<std::string> words_of_schemes();
std::vector<std::string> choices_of(const std::string& key);
/// Behind `using`: methods; options of what is trained.
std::vector<std::string> words_of_optimisers();
std::vector<std::string> words_of_training();
/// Behind `on`: where fields lie.
std::vector<std::string> words_of_placements();
/// Layers of networks.
std::vector<std::string> words_of_layers();

}  // namespace dpde::model
