// SPDX-License-Identifier: Apache-2.0
// What the tests of hosts share: random vectors, and the command and the libraries it builds.
#pragma once

#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "dpde/dpde.h"
#include "support/json.h"

namespace dpde::testing {

using Settings = std::map<std::string, std::string>;

inline std::string example(const std::string& file) { return DPDE_SOURCE_DIR "/dsl-examples/" + file; }

inline std::string text_of(const Settings& set) {
  std::string text;
  for (const auto& [key, value] : set) text += " --set " + key + "=" + value;
  return text;
}

inline std::vector<double> random_values(std::size_t size, unsigned seed, double scale = 1) {
  std::mt19937 random(seed);
  std::vector<double> values(size);
  for (double& value : values) value = std::uniform_real_distribution<double>(-scale, scale)(random);
  return values;
}

inline double dot(std::span<const double> a, std::span<const double> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// A folder of its own for each test.
class InFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    for (char& c : name) c = c == '/' ? '_' : c;
    folder_ = std::filesystem::path(::testing::TempDir()) / ("dpde_hosts_" + name);
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  /// dpde VERB ... --json
  Json dpde(const std::string& arguments) {
    const std::string out = (folder_ / "stdout").string(),
                      command = DPDE_BINARY_DIR "/bin/dpde " + arguments + " --json >" + out;
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    std::ifstream file(out);
    return parse_json(std::string(std::istreambuf_iterator<char>(file), {})).value();
  }
  /// The scene of the library that `dpde build` makes.
  const dpde_scene* build(const std::string& file, const std::string& name, const std::string& options = "") {
    dpde("build " + file + " " + name + " -o " + folder_.string() + options);
    void* library = dlopen((folder_ / ("lib" + name + ".so")).c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(library, nullptr) << dlerror();
    return library ? static_cast<const dpde_scene*>(dlsym(library, (name + "_scene").c_str())) : nullptr;
  }

  std::filesystem::path folder_;
};

}  // namespace dpde::testing
