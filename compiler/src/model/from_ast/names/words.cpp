// SPDX-License-Identifier: Apache-2.0
#include "model/print/words.h"

#include <algorithm>

#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/network/layer_words.h"
#include "model/from_ast/parts.h"

namespace dpde::model {

std::vector<std::string> words_of_functions() { return formulas::function_names(); }

std::vector<std::string> words_of_schemes() {
  std::vector<std::string> keys = scheme_keys();
  keys.emplace_back(split_key);
  return keys;
}

std::vector<std::string> choices_of(const std::string& key) {
  if (key == split_key) return {"lie(advect, sources, diffusion)", "strang(advect, sources, diffusion)"};
  Scheme unused;
  const ast::Expr none(ast::Node{ast::Name{"no choice"}, {}});
  const std::optional<SchemeRefusal> refusal = set_scheme_key(unused, key, none);
  std::vector<std::string> choices = refusal ? refusal->choices : std::vector<std::string>();
  std::erase_if(choices, [](const std::string& choice) { return choice.starts_with("one of them"); });
  return choices;
}

std::vector<std::string> words_of_layers() {
  std::vector<std::string> words;
  for (const LayerWord& layer : layer_words) words.emplace_back(layer.name);
  return words;
}

}  // namespace dpde::model
