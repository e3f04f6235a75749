// SPDX-License-Identifier: Apache-2.0
// Golden files: `dpde emit` of each case must print the stored text. tools/bless rewrites them.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) return "popen failed";
  std::array<char, 4096> buffer;
  while (const size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) text.append(buffer.data(), n);
  const int status = pclose(pipe);
  return status == 0 ? text : text + "\nexit status " + std::to_string(status);
}

TEST(Golden, EveryStageIsAsStored) {
  int compared = 0;
  for (const auto& folder : fs::directory_iterator(fs::path(DPDE_SOURCE_DIR) / "tests/golden")) {
    for (const auto& file : fs::directory_iterator(folder)) {
      if (file.path().extension() != ".txt") continue;
      const std::string command = "cd " + folder.path().string() + " && " + DPDE_BINARY_DIR +
                                  "/bin/dpde emit in.dpde --quiet --stage " + file.path().stem().string() + " 2>&1";
      const std::string stored = read(file.path());
      EXPECT_FALSE(stored.empty()) << file.path();
      EXPECT_EQ(output_of(command), stored)
          << file.path() << "\nif the change is wanted: tools/bless " << folder.path().filename().string();
      ++compared;
    }
  }
  EXPECT_GT(compared, 20);
}

}  // namespace
