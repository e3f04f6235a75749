// SPDX-License-Identifier: Apache-2.0
#include "syntax/words.h"

#include <algorithm>

#include "syntax/parse/parse_parts.h"

namespace dpde::ast {

namespace {

std::vector<BlockRule> all_rules() {
  return {model_rule(),   scene_rule(),  scheme_rule(),  task_rule(),     kernel_rule(),
          program_rule(), repeat_rule(), network_rule(), data_set_rule(), chart_rule()};
}

}  // namespace

std::vector<std::string> words_of_block(std::string_view block) {
  std::vector<std::string> words;
  for (const BlockRule& rule : all_rules()) {
    if (rule.name != block) continue;
    for (const ItemRule& item : rule.items) words.emplace_back(item.word);
  }
  return words;
}

std::vector<std::string> kinds_of_block() {
  std::vector<std::string> kinds;
  for (const BlockRule& rule : all_rules()) kinds.emplace_back(rule.name);
  return kinds;
}

}  // namespace dpde::ast
