// SPDX-License-Identifier: Apache-2.0
// Runs the command as a user would and captures its output: as a function of this process, or as a separate process.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "support/json.h"

namespace dpde::testing {

namespace fs = std::filesystem;

#ifdef __SANITIZE_ADDRESS__
constexpr bool is_sanitized = true;
#else
constexpr bool is_sanitized = false;
#endif

inline std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Outcome {
  int status = -1;
  std::string out, err;
  Json json() const {
    const std::optional<Json> parsed = parse_json(out);
    EXPECT_TRUE(parsed.has_value()) << "not JSON: " << out << err;
    return parsed.value_or(Json::object());
  }
  /// The codes of the JSON's diagnostics.
  std::vector<std::string> codes() const {
    std::vector<std::string> codes;
    const Json parsed = json();
    if (!parsed.contains("diagnostics")) return codes;
    for (const Json& d : parsed["diagnostics"]) codes.push_back(d["code"]);
    return codes;
  }
};

/// `text` with each of these replaced everywhere, to make an example smaller; each must occur.
inline std::string rewritten(std::string text, const std::vector<std::pair<std::string, std::string>>& changes) {
  for (const auto& [from, to] : changes) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  }
  return text;
}

/// A separate folder for each test.
class Command : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("dpde_") + info->test_suite_name() + "_" + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name) const { return folder_ / name; }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return name;
  }
  /// Runs a shell command in the test's folder; $DPDE is the command.
  Outcome shell(const std::string& command) const {
    const std::string line = "cd '" + folder_.string() +
                             "' && DPDE='" DPDE_BINARY_DIR "/bin/dpde' && export DPDE_CACHE=.cache && { " + command +
                             "; } >.out 2>.err </dev/null";
    const int status = std::system(("/bin/sh -c \"" + escaped(line) + "\"").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content(path(".out")),
            content(path(".err"))};
  }
  /// If `arguments` are plain or quoted words, calls run_command() in the test's folder without a new process. Code
  /// compiled by a test of this process comes from its cache.
  Outcome dpde(const std::string& arguments) const;
  /// In a new process, with an empty cache at the beginning of the test.
  Outcome process(const std::string& arguments) const { return shell("$DPDE " + arguments); }
  /// Sends Ctrl-C `seconds` after the command has installed its handler, however long that takes. SigCgt: bit 1 is
  /// SIGINT; before exec the process is the shell, with its own handlers. With `file`, also waits until that file is
  /// not empty. A shell's background jobs ignore SIGINT, and dpde would inherit this: env restores it.
  Outcome interrupted(const std::string& arguments, const std::string& seconds, const std::string& file = ".") const {
    return shell("env --default-signal=INT $DPDE " + arguments +
                 " & run=$!; for i in $(seq 6000); do "
                 "[ $(grep -c -e '^Name:.dpde$' -e '^SigCgt:.*[2367abef]$' /proc/$run/status) = 2 ] && [ -s " +
                 file +
                 " ] && break; sleep 0.01; done; "
                 "sleep " +
                 seconds + "; kill -INT $run; wait $run");
  }

 private:
  static std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
      if (c == '"' || c == '\\' || c == '$' || c == '`') result += '\\';
      result += c;
    }
    return result;
  }
  fs::path folder_;
};

/// Exit status after Ctrl-C, as shells report it.
constexpr int by_ctrl_c = 130;

/// A periodic rod with a closed form of the explicit Euler solution: each step scales sin(x) by 1 - 4 k dt/h^2
/// sin(h/2)^2.
inline const char* rod_text = R"(model heat {
  field u
  param k
  dt(u) = k*lap(u)
}
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  initial u = sin(x)
  observe size = mean(u^2)
  exact u = exp(-k*t)*sin(x)
  time 0 .. 1, step 1/8
}
task find : rod {
  unknown k from 0.25
  minimise mean(u^2) at t = 1
  using lbfgs(), iterations 5
  test level = mean(u^2)
}
)";

}  // namespace dpde::testing
