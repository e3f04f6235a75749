// SPDX-License-Identifier: Apache-2.0
#include "check_text.h"

#include <fmt/format.h>

#include <sstream>
#include <vector>

namespace dpde::tools {

namespace {

/// Each line that is not indented, with the indented ones after it.
std::vector<std::string> blocks_of(const std::string& text) {
  std::vector<std::string> blocks;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (blocks.empty() || !line.starts_with(' ')) blocks.emplace_back();
    blocks.back() += line + '\n';
  }
  return blocks;
}

/// What --all would add.
std::string left_out_text(const Json& result) {
  const std::size_t unused = result.contains("unused") ? result["unused"].size() : 0;
  const std::string parts = unused == 0 ? "" : fmt::format("{} unused part{}, ", unused, unused == 1 ? "" : "s");
  return fmt::format("more with --all: {}names, waves and walls, conserved sums, savings\n", parts);
}

}  // namespace

void CheckText::tell(Job& job, const std::string& scene, const report::Report& report) {
  std::string text;
  for (const auto& part : report.parts) {
    if (const std::string* words = std::get_if<std::string>(&part)) text += *words;
    const auto* detail = std::get_if<report::Detail>(&part);
    if (detail != nullptr && shows_all_) text += detail->text;
  }
  std::set<std::string>& told = told_[scene];
  const bool is_first = told.empty();
  std::string shown;
  const std::vector<std::string> blocks = blocks_of(text);
  for (const std::string& block : blocks) {
    if (!told.contains(block)) shown += block;
  }
  told.insert(blocks.begin(), blocks.end());
  if (!is_first) job.say(fmt::format("scene {}: as above{}\n", scene, shown.empty() ? "" : ", but for"));
  job.say(shown);
  if (is_first && !shows_all_) job.say(left_out_text(report.json));
}

}  // namespace dpde::tools
