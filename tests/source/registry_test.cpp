// SPDX-License-Identifier: Apache-2.0
// Every kind of diagnostic is triggered by something in the tests: a file of its name in tests/diagnostics, or a test
// that names its code or its kind.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "source/error_codes.h"

namespace dpde {
namespace {

namespace fs = std::filesystem;

/// All test sources in one text, this one aside.
std::string test_sources() {
  std::stringstream text;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(DPDE_SOURCE_DIR) / "tests")) {
    if (entry.path().extension() != ".cpp" || entry.path().filename() == "registry_test.cpp") continue;
    text << std::ifstream(entry.path()).rdbuf();
  }
  return text.str();
}

/// Invariants that only a bug of dpde breaks: nothing a test can do brings them about.
const std::set<std::string_view> only_by_bugs{"broken-invariant", "broken-program"};

TEST(Registry, EveryKindIsTriggeredByATest) {
  const std::string sources = test_sources();
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    if (only_by_bugs.contains(kind.name)) continue;
    const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "tests/diagnostics";
    const std::string file = std::string(kind.name) + ".dpde";
    const bool has_file = fs::exists(folder / file) || fs::exists(folder / "runs" / file);
    const bool is_named = sources.find(kind.code) != std::string::npos ||
                          sources.find("\"" + std::string(kind.name) + "\"") != std::string::npos;
    EXPECT_TRUE(has_file || is_named) << kind.code << " " << kind.name;
  }
}

TEST(Registry, CodesAndNamesAreUnique) {
  std::set<std::string_view> codes, names;
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    EXPECT_TRUE(codes.insert(kind.code).second) << kind.code;
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_EQ(kind.code[0], kind.severity == Severity::warning ? 'W' : 'E') << kind.code;
  }
}

}  // namespace
}  // namespace dpde
