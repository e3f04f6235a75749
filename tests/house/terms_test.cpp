// SPDX-License-Identifier: Apache-2.0
// The manual and the messages speak in the field's terms: private words that they once had do not come back.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <utility>
#include <vector>

namespace dpde {
namespace {

namespace fs = std::filesystem;

/// A private word, and what the field says.
const std::vector<std::pair<std::string, std::string>> private_words{
    {"sought", "unknown, estimated"},
    {"falling ax[ie]s", "decreasing coordinate"},
    {"closed under itself", "differentiable again"},
    {"folds?", "aliasing; adjoint of the halo fill"},
    {"grown regions?", "extended domain"},
    {"own uniforms", "kernel constants"},
    {"seams?", "periodic boundary, interface"},
    {"tapes?", "stored forward values"},
    {"beside", "next to, compared with, in addition to"},
    {"told", "reported"},
    {"nobody|somebody", "the subject"},
    {"by right", "physical growth"},
    {"parts? of (a )?steps?", "substep"},
    {"comes? nearer?", "converge"},
    {"courses?", "time series"},
};

/// Without code and the addresses of links.
std::string prose_of(const std::string& line) {
  static const std::regex other("`[^`]*`|\\]\\([^)]*\\)");
  return std::regex_replace(line, other, " ");
}

/// Any of the private words.
std::regex any_of_them() {
  std::string text;
  for (const auto& [word, term] : private_words) text += (text.empty() ? "" : "|") + word;
  return std::regex("\\b(" + text + ")\\b", std::regex::icase | std::regex::optimize);
}

std::string term_for(const std::string& found) {
  for (const auto& [word, term] : private_words) {
    if (std::regex_match(found, std::regex(word, std::regex::icase))) return term;
  }
  return "";
}

void expect_terms(const fs::path& page, const std::regex& words) {
  std::ifstream file(page);
  bool is_code = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.starts_with("```")) is_code = !is_code;
    if (is_code || line.starts_with("<!--")) continue;
    const std::string prose = prose_of(line);
    std::smatch found;
    EXPECT_FALSE(std::regex_search(prose, found, words))
        << page << ":" << number << ": \"" << found.str() << "\" is no term; write: " << term_for(found.str());
  }
}

TEST(HouseTerms, OfTheManualAreTheFields) {
  const std::regex words = any_of_them();
  int pages = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(DPDE_SOURCE_DIR) / "dsl-examples/manual")) {
    if (entry.path().extension() != ".md") continue;
    expect_terms(entry.path(), words);
    ++pages;
  }
  EXPECT_GT(pages, 15);
}

/// The texts that users see, as they stand beside the files of tests/diagnostics. Hints may list keywords, as fold.
TEST(HouseTerms, OfMessagesAreTheFields) {
  const std::regex words = any_of_them(), message(R"((?:.*(?:error|warning|note)[^:]*|help): (.*))");
  int messages = 0;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(DPDE_SOURCE_DIR) / "tests/diagnostics")) {
    if (entry.path().extension() != ".out") continue;
    std::ifstream file(entry.path());
    for (std::string line; std::getline(file, line);) {
      std::smatch text, found;
      if (!std::regex_match(line, text, message)) continue;
      ++messages;
      const std::string said = text[1];
      if (!std::regex_search(said, found, words) || found.str() == "fold") continue;
      ADD_FAILURE() << entry.path() << ": \"" << found.str() << "\" is no term; write: " << term_for(found.str());
    }
  }
  EXPECT_GT(messages, 1000);
}

}  // namespace
}  // namespace dpde
