// SPDX-License-Identifier: Apache-2.0
// One line that is written over and over: only on a terminal, or when asked for.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace dpde::tools {

class Progress {
 public:
  /// On `stream`. `wanted`: also without a terminal. `silent`: never.
  Progress(std::FILE* stream, bool wanted, bool silent);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  bool active() const { return active_; }
  /// Shows `text` with the time left, at most ten times a second; `done` of `total` parts of the work are done.
  void show(const std::string& text, int done, int total);

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* stream_;
  bool active_, terminal_, shown_ = false;
  Clock::time_point start_ = Clock::now(), last_{};
};

/// Shows what it is told, and for how long that is so, in such a line, which goes with the last copy of it.
std::function<void(const std::string&)> shown_in_line(std::FILE* stream, bool wanted, bool silent);

}  // namespace dpde::tools
