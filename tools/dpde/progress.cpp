// SPDX-License-Identifier: Apache-2.0
#include "progress.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "command.h"
#include "support/names/number_text.h"

namespace dpde::tools {

Progress::Progress(std::FILE* stream, bool wanted, bool silent)
    : stream_(stream), active_(false), terminal_(is_terminal(stream)) {
  active_ = !silent && (wanted || terminal_);
}

Progress::~Progress() {
  if (shown_ && terminal_) std::fputs("\r\033[K", stream_);
}

void Progress::show(const std::string& text, int done, int total) {
  const Clock::time_point now = Clock::now();
  const bool is_last = done >= total;
  if (!active_ || (!is_last && std::chrono::duration<double>(now - last_).count() < 0.1)) return;
  last_ = now;
  shown_ = true;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  std::string line = fmt::format("{}  {} elapsed", text, human_seconds(elapsed));
  if (done > 0 && !is_last) line += fmt::format(", {} left", human_seconds(elapsed * (total - done) / done));
  std::fputs(fmt::format("{}{}{}", terminal_ ? "\r" : "", line, terminal_ ? "\033[K" : "\n").c_str(), stream_);
  std::fflush(stream_);
}

std::function<void(const std::string&)> shown_in_line(std::FILE* stream, bool wanted, bool silent) {
  const auto line = std::make_shared<Progress>(stream, wanted, silent);
  return [line](const std::string& text) { line->show(text, 0, 1); };
}

}  // namespace dpde::tools
