// SPDX-License-Identifier: Apache-2.0
// Random .dpde texts through the whole compiler. DPDE_RANDOM_MODELS: how many (15); DPDE_RANDOM_SEED: the first of
// their seeds (1).
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <map>

#include "random/check_model.h"
#include "random/random_model.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Fails in the same way; what is refused, with the same code.
std::string smallest(const Part& model, const ModelVerdict& verdict, const ModelChecks& checks) {
  const auto fails = [&](const std::string& text) {
    const ModelVerdict other = check_model(text, {checks.second, checks.cpp, checks.symmetries, 20});
    return other.kind == verdict.kind && other.check == verdict.check;
  };
  return print(shrink(model, fails, verdict.check == "cpp" ? 60 : 400));
}

TEST(RandomModels, AgreeEverywhere) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1), count = setting("DPDE_RANDOM_MODELS", 15);
  std::map<ModelVerdict::Kind, int> total;
  std::map<std::string, int> codes;
  for (std::uint64_t seed = first; seed < first + count && total[ModelVerdict::Kind::failed] < 5; ++seed) {
    const Part model = random_model(seed);
    const ModelChecks checks{seed % 8 == 3, seed % 50 == 7, seed % 4 == 1};
    const ModelVerdict verdict = check_model(print(model), checks);
    ++total[verdict.kind];
    if (verdict.kind == ModelVerdict::Kind::refused) ++codes[verdict.check];
    if (verdict.kind != ModelVerdict::Kind::failed) continue;
    const std::string small = smallest(model, verdict, checks);
    ADD_FAILURE() << "seed " << seed << ": " << verdict.check << "\n"
                  << verdict.detail << "\nthe smallest text that fails so:\n"
                  << small << check_model(small, checks).detail;
  }
  const int refused = total[ModelVerdict::Kind::refused], unstable = total[ModelVerdict::Kind::unstable];
  std::cout << total[ModelVerdict::Kind::passed] << " passed, " << refused << " refused, " << unstable << " unstable";
  for (const auto& [code, times] : codes) std::cout << ", " << code << " " << times << " times";
  std::cout << "\n";
  EXPECT_LE(refused, static_cast<int>(count) / 10);
  EXPECT_LE(unstable, static_cast<int>(count) / 10);
}

TEST(RandomModels, AreTheSameEverywhere) {
  std::uint64_t hash = 14695981039346656037u;  // FNV-1a
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    for (const char c : print(random_model(seed))) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  }
  EXPECT_EQ(hash, 2468965363169430568u) << "the generator has changed: seeds of old failures mean other models now";
}

TEST(RandomModels, WhatIsWrongIsRefusedWithItsCode) {
  Part model = random_model(5);
  const ModelVerdict verdict =
      check_model(print(model) + "model other { field q; dt(q) = nosuch }\nscene n : other { }\n", {});
  EXPECT_EQ(verdict.kind, ModelVerdict::Kind::passed) << verdict.detail;  // task t does not need them
  const ModelVerdict cut = check_model(print(model).substr(0, 40), {});
  EXPECT_EQ(cut.kind, ModelVerdict::Kind::refused);
  EXPECT_EQ(cut.check.substr(0, 2), "E0") << cut.check;
}

/// With an artificial fault, "a Laplacian and something that waits for the time", only its parts remain.
TEST(ShrinkText, LeavesTheFaultAlone) {
  const auto has_fault = [](const std::string& text) {
    return text.find("lap(") != std::string::npos && text.find(" over time") != std::string::npos;
  };
  int shrunk = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Part model = random_model(seed);
    if (!has_fault(print(model))) continue;
    const std::string small = print(shrink(model, has_fault, 3000));
    ++shrunk;
    EXPECT_TRUE(has_fault(small));
    EXPECT_LT(small.size(), 250u) << small;
    EXPECT_EQ(small.find("grid y"), std::string::npos) << small;
  }
  EXPECT_GE(shrunk, 5);
}

}  // namespace
}  // namespace dpde::testing
