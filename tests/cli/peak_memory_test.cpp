// SPDX-License-Identifier: Apache-2.0
// The memory predicted by `dpde check` against the peak of the process measured by the system. All examples:
// tools/check_memory.
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <regex>
#include <vector>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class PeakMemory : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    if (is_sanitized) GTEST_SKIP() << "the sanitizers hold memory of their own";
  }

  /// Largest resident set of `dpde <arguments>` in bytes.
  double peak(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words{"dpde"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
      const bool there = chdir(folder().c_str()) == 0;
      setenv("DPDE_CACHE", ".cache", 1);
      if (there) execv(DPDE_BINARY_DIR "/bin/dpde", argv.data());
      _exit(127);
    }
    int status = -1;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << arguments[0] << " ended with " << status;
    return 1024.0 * static_cast<double>(usage.ru_maxrss);
  }
  fs::path folder() const { return path("."); }

  /// Memory without fields is estimated from the same command on a few cells.
  void expect_within_a_tenth(const std::string& verb, const std::string& name, const std::string& key) {
    const double predicted = dpde("check heat.dpde " + name + " --json --set cells=2048").json()[key];
    EXPECT_GT(predicted, 2.0 * 8 * 2048 * 2048) << "two time levels at least";
    expect_within_a_tenth(predicted, {verb, "heat.dpde", name, "--quiet"}, 2048);
  }
  /// `least`: smallest fraction of the prediction; compression may need less.
  void expect_within_a_tenth(double predicted, const std::vector<std::string>& words, int cells, double least = 0.9) {
    const auto command = [&](int count) {
      std::vector<std::string> all = words;
      all.insert(all.end(), {"--set", fmt::format("cells={}", count)});
      return all;
    };
    const double base = peak(command(8)), measured = peak(command(cells)) - base;
    EXPECT_TRUE(measured >= least * predicted && measured <= 1.1 * predicted)
        << fmt::format("{}: {:.0f} of {:.0f} MiB", words[0], measured / 0x1p20, predicted / 0x1p20);
  }
  /// With the files of --out, whose predicted size is that without compression.
  void expect_of_outputs(int cells) {
    const auto said = dpde(fmt::format("check heat.dpde s --json --set cells={}", cells)).json();
    const double predicted = said["memory_bytes"].get<double>() + said["output_memory_bytes"].get<double>();
    expect_within_a_tenth(predicted, {"run", "heat.dpde", "s", "--quiet", "--out", "files"}, cells, 0.6);
  }
};

std::string text_of(const std::string& model, const std::string& value, const std::string& task) {
  return fmt::format(
      "model heat {{ field u; param k; {} }}\nscene s : heat {{\n  grid x = 0 .. 1, cells 64, periodic\n"
      "  grid y = 0 .. 1, cells 64, periodic\n  initial u = sin(2*pi*x)*cos(2*pi*y)\n  k = 1e-9\n{}"
      "  time 0 .. 4/1024, step 1/1024\n}}\ntask t : s {{ {} }}\n",
      model, value, task);
}

TEST_F(PeakMemory, OfRunsAndGradientsIsPredicted) {
  write("heat.dpde", text_of("dt(u) = k*lap(u)", "", "unknown initial u; minimise mean(u^2)"));
  expect_within_a_tenth("run", "s", "memory_bytes");
  expect_within_a_tenth("gradient", "t", "gradient_peak_bytes");
}

TEST_F(PeakMemory, OfStoredStatesAndDataOfOtherScenesIsPredicted) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  write("heat.dpde", text_of("coefficient c; dt(u) = k*lap(u) - c*u^2", "  c = 1 + x/10\n",
                             "data seen = u from scene s at t = 2/1024, 4/1024\n  unknown c from 1\n"
                             "  minimise mean((u - seen)^2) at t = 2/1024, 4/1024"));
  expect_within_a_tenth("gradient", "t", "gradient_peak_bytes");
}

/// A gradient first checks for switches: in states, and in a separate step if stages read them.
TEST_F(PeakMemory, OfRunsThatWatchSwitchesIsPredicted) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  for (const std::string time : {"euler", "rk4"}) {
    const std::string text =
        text_of("dt(u) = k*lap(u) + if(u > 5, 1, 0.2)*u", "", "unknown initial u; minimise mean(u^2)");
    write("heat.dpde", fmt::format("scheme in_time {{ time = {} }}\n", time) +
                           std::regex_replace(text, std::regex(": heat"), ": heat with in_time"));
    const double predicted = dpde("check heat.dpde t --json --set cells=1024").json()["gradient_peak_bytes"];
    expect_within_a_tenth(predicted, {"gradient", "heat.dpde", "t", "--quiet"}, 1024);
  }
}

/// Curves and maps need memory only for the pixels of pictures; on one axis positions are as many numbers as the
/// states.
TEST_F(PeakMemory, OfOutputsIsPredicted) {
  if (!is_thorough()) GTEST_SKIP() << "at night: eleven seconds";
  write("heat.dpde", text_of("dt(u) = k*lap(u)", "", "unknown initial u; minimise mean(u^2)"));
  expect_of_outputs(1536);
  write("heat.dpde",
        "model heat { field u; param k; dt(u) = k*lap(u) }\nscene s : heat {\n"
        "  grid x = 0 .. 1, cells 64, periodic\n  initial u = sin(2*pi*x)\n  k = 1e-15\n"
        "  time 0 .. 4/1024, step 1/1024\n}\n");
  expect_of_outputs(3000000);
}

TEST_F(PeakMemory, OfOutputsIsSaidToBeTheSameHoweverManyStatesThereAre) {
  const auto said = [&](const std::string& every) {
    write("heat.dpde",
          text_of("dt(u) = k*lap(u)", "  output u every " + every + "\n", "unknown k; minimise mean(u^2)"));
    return dpde("check heat.dpde s --json --set end=64/1024").json()["output_memory_bytes"].get<double>();
  };
  EXPECT_EQ(said("1"), said("64"));
}

/// States are written to a file one by one and read back one by one: each needs memory for compressing one block.
TEST_F(PeakMemory, OfARunThatWritesManyStatesIsThatOfOneThatWritesTwo) {
  write("heat.dpde", text_of("dt(u) = k*lap(u)", "", "unknown initial u; minimise mean(u^2)"));
  const auto of = [&](const std::string& every) {
    return peak({"run", "heat.dpde", "s", "--quiet", "--set", "cells=512", "--set", "end=16/1024", "--every", every,
                 "--out", "o"});
  };
  const double of_two = of("16"), of_many = of("1"), state = 8 * 512 * 512;
  EXPECT_LT(of_many, of_two + 5 * state) << (of_many - of_two) / state << " of 15 states more";
  EXPECT_EQ(fs::file_size(path("o/u_over_time.npy")), 128 + 17 * static_cast<std::size_t>(state));
}

}  // namespace
}  // namespace dpde::testing
