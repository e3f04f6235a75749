// SPDX-License-Identifier: Apache-2.0
#include "random/isolated.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstring>

namespace dpde::testing {

namespace {

using Clock = std::chrono::steady_clock;

void write_all(int to, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = write(to, text.data() + done, text.size() - done);
    if (count <= 0) return;
    done += static_cast<std::size_t>(count);
  }
}

/// False if the time is over before the other end is closed.
bool read_until(int from, Clock::time_point end, std::string& text) {
  char buffer[4096];
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd ready{from, POLLIN, 0};
    if (left <= 0 || poll(&ready, 1, static_cast<int>(left)) == 0) return false;
    const ssize_t count = read(from, buffer, sizeof buffer);
    if (count <= 0) return true;
    text.append(buffer, static_cast<std::size_t>(count));
  }
}

/// In the process that has `work` to do: the length of the answer, then the answer.
[[noreturn]] void answer(int to, const std::function<std::string()>& work) {
  setpgid(0, 0);  // so that compilers it has started end with it
  const std::string text = work();
  const std::uint64_t size = text.size();
  write_all(to, std::string(reinterpret_cast<const char*>(&size), sizeof size) + text);
  _exit(0);
}

}  // namespace

Answer isolated(const std::function<std::string()>& work, double seconds) {
  int ends[2];
  if (pipe(ends) != 0) return {Answer::Kind::crashed, "no pipe"};
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    answer(ends[1], work);
  }
  close(ends[1]);
  std::string text;
  const bool in_time =
      read_until(ends[0], Clock::now() + std::chrono::milliseconds(static_cast<std::int64_t>(1000 * seconds)), text);
  close(ends[0]);
  if (child < 0) return {Answer::Kind::crashed, "no process"};
  if (!in_time) kill(-child, SIGKILL);
  if (!in_time) kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  if (!in_time) return {Answer::Kind::late, ""};
  std::uint64_t size = 0;
  if (text.size() >= sizeof size) std::memcpy(&size, text.data(), sizeof size);
  if (text.size() == sizeof size + size && size > 0) return {Answer::Kind::given, text.substr(sizeof size)};
  return {Answer::Kind::crashed,
          WIFSIGNALED(status) ? fmt::format("signal {}", WTERMSIG(status)) : fmt::format("status {}", status)};
}

}  // namespace dpde::testing
