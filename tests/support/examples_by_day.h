// SPDX-License-Identifier: Apache-2.0
// The files of dsl-examples, and which of their tasks and scenes are tested.
#pragma once

#include <algorithm>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "support/setting.h"

namespace dpde::testing {

inline const std::filesystem::path examples = std::filesystem::path(DPDE_SOURCE_DIR) / "dsl-examples";

inline std::vector<std::filesystem::path> example_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(examples)) {
    if (entry.path().extension() == ".dpde") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// Names of the tasks and scenes of a file.
inline std::vector<std::string> targets_of(const std::string& text) {
  std::vector<std::string> names;
  const std::regex block(R"((^|\n)(scene|task) +(\w+))");
  for (std::sregex_iterator found(text.begin(), text.end(), block), end; found != end; ++found)
    names.push_back((*found)[3]);
  return names;
}

/// By day the first three, tasks before scenes. Scenes run by a task are left out, as the task runs their steps.
inline std::vector<std::string> targets_by_day(const std::string& text) {
  std::vector<std::string> names = targets_of(text);
  if (is_thorough()) return names;
  const std::regex task(R"((^|\n)task +(\w+) *: *(\w+))");
  std::vector<std::string> tasks;
  for (std::sregex_iterator found(text.begin(), text.end(), task), end; found != end; ++found) {
    tasks.push_back((*found)[2]);
    std::erase(names, (*found)[2].str()), std::erase(names, (*found)[3].str());
  }
  names.insert(names.begin(), tasks.begin(), tasks.end());
  names.resize(std::min<std::size_t>(names.size(), 3));
  return names;
}

}  // namespace dpde::testing
