// SPDX-License-Identifier: Apache-2.0
#include "standard_output.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

namespace dpde::tools {

namespace {

/// For fopencookie(): 0 means an error.
ssize_t write_while_read(void* /*nothing*/, const char* text, size_t size) {
  size_t done = 0;
  while (done < size) {
    const ssize_t written = write(STDOUT_FILENO, text + done, size - done);
    if (written >= 0) {
      done += static_cast<size_t>(written);
    } else if (errno == EPIPE) {
      return static_cast<ssize_t>(size);
    } else if (errno != EINTR) {
      return static_cast<ssize_t>(done);
    }
  }
  return static_cast<ssize_t>(done);
}

}  // namespace

std::FILE* standard_output() {
  std::signal(SIGPIPE, SIG_IGN);
  struct stat output {};
  const bool has_reader = fstat(STDOUT_FILENO, &output) == 0 && (S_ISFIFO(output.st_mode) || S_ISSOCK(output.st_mode));
  if (!has_reader) return stdout;
  FILE* const pipe =
      fopencookie(nullptr, "w", {.read = nullptr, .write = write_while_read, .seek = nullptr, .close = nullptr});
  return pipe != nullptr ? pipe : stdout;
}

}  // namespace dpde::tools
