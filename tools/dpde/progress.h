// SPDX-License-Identifier: Apache-2.0
// A progress line that is overwritten repeatedly: only on a terminal, or on request.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace dpde::tools {

class Progress {
 public:
  /// Writes to `stream`. `wanted`: also if that is not a terminal. `silent`: never.
  Progress(std::FILE* stream, bool wanted, bool silent);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  bool active() const { return active_; }
  /// Shows `text` with the remaining time, at most ten times a second; `done` of `total` parts of the work are done.
  void show(const std::string& text, int done, int total);

 private:
  using Clock = std::chrono::steady_clock;
  std::FILE* stream_;
  bool active_, terminal_, shown_ = false;
  Clock::time_point start_ = Clock::now(), last_{};
};

/// Returns a function that shows its text, and for how long it has been shown, in such a line. The last copy removes
/// the line.
std::function<void(const std::string&)> shown_in_line(std::FILE* stream, bool wanted, bool silent);

}  // namespace dpde::tools
