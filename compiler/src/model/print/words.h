// SPDX-License-Identifier: Apache-2.0
// Words with a meaning at the model level, for editors.
#pragma once

#include <string>
#include <vector>

namespace dpde::model {

/// Functions and operators of formulas: lap, sin, mean, ...
std::vector<std::string> words_of_functions();
/// Keys of a scheme, and the choices for each; for `split` an example.
std::vector<std::string> words_of_schemes();
std::vector<std::string> choices_of(const std::string& key);
/// Words after `using`: methods; options of training.
std::vector<std::string> words_of_optimisers();
std::vector<std::string> words_of_training();
/// Words after `on`: placements of fields.
std::vector<std::string> words_of_placements();
/// Layers of networks.
std::vector<std::string> words_of_layers();

}  // namespace dpde::model
