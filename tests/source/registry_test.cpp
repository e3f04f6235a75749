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

/// The stems of all texts of tests/diagnostics.
std::set<std::string> names_of_texts() {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(DPDE_SOURCE_DIR) / "tests/diagnostics"))
    if (entry.path().extension() == ".dpde") names.insert(entry.path().stem());
  return names;
}

/// Invariants that only a bug of dpde breaks: nothing a test can do brings them about.
const std::set<std::string_view> only_by_bugs{"broken-invariant", "broken-program"};

TEST(Registry, EveryKindIsTriggeredByATest) {
  const std::string sources = test_sources();
  const std::set<std::string> texts = names_of_texts();
  for (const DiagnosticKind& kind : diagnostic_kinds) {
    if (only_by_bugs.contains(kind.name)) continue;
    const bool has_file = texts.contains(std::string(kind.name));
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
