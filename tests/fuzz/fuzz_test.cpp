// SPDX-License-Identifier: Apache-2.0
// The fuzz targets without a fuzzer: the files of the examples and tests, and thousands of texts a few tokens from
// them. DPDE_FUZZ_TEXTS: how many for each target (1500).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>

#include "fuzz/mutate.h"
#include "fuzz/targets.h"

namespace dpde::testing {
namespace {

namespace fs = std::filesystem;

constexpr double longest = 5;  // seconds for one text, on a machine that does other things too

std::vector<std::string> corpus() {
  std::vector<fs::path> paths;
  for (const char* folder : {"dsl-examples", "tests/golden", "tests/diagnostics", "tests/passes"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(DPDE_SOURCE_DIR) / folder)) {
      const fs::path name = entry.path().filename();
      const bool is_text = name == "stencil.txt" || name == "adjoint.txt" || name == "tangent.txt";
      if (name.extension() == ".dpde" || name.extension() == ".stencil" || is_text) paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> texts;
  for (const fs::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    const std::string all = text.str();
    for (std::size_t begin = 0; begin < all.size();) {  // texts of passes have parts
      const std::size_t mark = path.extension() == ".stencil" ? all.find("\n--- ", begin) : std::string::npos;
      if (mark != begin) texts.push_back(all.substr(begin, mark - begin));
      begin = mark == std::string::npos ? all.size() : all.find('\n', mark + 1) + 1;
    }
  }
  return texts;
}

using Target = std::function<std::string(std::string_view)>;

void expect_nothing(const Target& target, const std::string& text) {
  const std::clock_t start = std::clock();  // of the processor: others may work, too
  EXPECT_EQ(target(text), "") << text;
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, longest) << text;
}

void expect_robust(const Target& target, std::uint64_t seed) {
  const std::vector<std::string> texts = corpus();
  ASSERT_GT(texts.size(), 100u);
  for (const std::string& text : texts) expect_nothing(target, text);
  const char* wanted = std::getenv("DPDE_FUZZ_TEXTS");
  const int count = wanted ? std::atoi(wanted) : 1500;
  const Mutator mutate(texts);
  SplitMix random(seed);
  for (int i = 0; i < count && !::testing::Test::HasFailure(); ++i) expect_nothing(target, mutate(random));
}

TEST(Fuzz, Parser) { expect_robust(fuzz_parser, 1); }
TEST(Fuzz, StencilReader) { expect_robust(fuzz_stencil_reader, 2); }
TEST(Fuzz, Model) { expect_robust(fuzz_model, 3); }

/// Most of what is tried should get past the parser.
TEST(Fuzz, MutationsAreNearlyRight) {
  const Mutator mutate(corpus());
  SplitMix random(4);
  int right = 0;
  for (int i = 0; i < 500; ++i) right += is_understood(mutate(random)) ? 1 : 0;
  EXPECT_GT(right, 50);
  EXPECT_LT(right, 450);
}

/// No text of a few hundred kilobytes overflows the stack or takes for ever.
TEST(Fuzz, DeepAndLong) {
  const auto repeated = [](const std::string& piece, int times) {
    std::string text;
    for (int i = 0; i < times; ++i) text += piece;
    return text;
  };
  const std::vector<std::string> expressions = {repeated("(", 100000) + "u" + repeated(")", 100000),
                                                repeated("-", 100000) + "u",
                                                "u" + repeated("^u", 100000),
                                                "u" + repeated("+u", 20000),
                                                "u" + repeated("*u[+1]", 20000),
                                                repeated("sin(", 20000) + "u" + repeated(")", 20000),
                                                repeated("if(u < 1, ", 20000) + "u" + repeated(", u)", 20000),
                                                repeated("interp(u, ", 20000) + "u" + repeated(")", 20000)};
  for (const std::string& e : expressions) {
    const std::string kernel =
        "kernel k(u: field halo 1, out v: field) { v = " + e + " }\nprogram p { fill u periodic; run k; keep v }\n";
    const std::string scene =
        "model m { field u; dt(u) = " + e +
        " }\nscene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = x; time 0 .. 1, step 1 }\n";
    for (const auto& [target, text] :
         {std::pair<Target, std::string>{fuzz_parser, kernel}, {fuzz_stencil_reader, kernel}, {fuzz_model, scene}}) {
      EXPECT_EQ(target(text), "") << e.substr(0, 40);
    }
  }
}

}  // namespace
}  // namespace dpde::testing
