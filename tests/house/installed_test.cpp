// SPDX-License-Identifier: Apache-2.0
// Only public headers are installed: those that hosts and emitted code include, and what these include.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <string>

namespace {

namespace fs = std::filesystem;

const fs::path source = DPDE_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

void add_with_includes(const std::string& header, std::set<std::string>& found) {
  if (!found.insert(header).second) return;
  const std::regex include(R"re(#include "(dpde/[^"]+)")re");
  for (const char* folder : {"compiler/include", "runtime/include", "runtime/abi"}) {
    const std::string text = text_of(source / folder / header);
    for (auto at = std::sregex_iterator(text.begin(), text.end(), include); at != std::sregex_iterator(); ++at)
      add_with_includes((*at)[1], found);
  }
}

TEST(House, OnlyPublicHeadersAreInstalled) {
  std::set<std::string> wanted, installed;
  for (const char* header :
       {"dpde/dpde.h", "dpde/dpde_c.h", "dpde/recorder.h", "dpde/runtime/simulation.h", "dpde/elementary_cells.h"})
    add_with_includes(header, wanted);
  for (const auto& entry : fs::directory_iterator(source / "compiler/include/dpde"))
    installed.insert("dpde/" + entry.path().filename().string());
  const std::string rules = text_of(source / "runtime/CMakeLists.txt");
  const std::regex abi(R"(abi/(dpde/[a-z_]+\.h))"), runtime(R"(foreach\(header ([a-z_ ]+)\))");
  for (auto at = std::sregex_iterator(rules.begin(), rules.end(), abi); at != std::sregex_iterator(); ++at)
    installed.insert((*at)[1]);
  std::smatch names;
  ASSERT_TRUE(std::regex_search(rules, names, runtime));
  std::stringstream list(names[1]);
  for (std::string name; list >> name;) installed.insert("dpde/runtime/" + name + ".h");
  EXPECT_EQ(installed, wanted);
}

}  // namespace
