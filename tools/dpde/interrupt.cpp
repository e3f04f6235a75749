// SPDX-License-Identifier: Apache-2.0
#include "interrupt.h"

#include <csignal>
#include <cstdint>
#include <ctime>

namespace dpde::tools {

namespace {

std::atomic<bool>& raised() {
  static std::atomic<bool> flag{false};
  return flag;
}

/// The first signal received; 0: none.
std::atomic<int>& first_signal() {
  static std::atomic<int> signal{0};
  return signal;
}

std::int64_t now_ms() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{1000} * time.tv_sec + time.tv_nsec / 1000000;
}

/// Some senders signal a process and its group, so one request arrives twice; it does not count as a second one.
constexpr std::int64_t one_request_ms = 300;

std::atomic<std::int64_t>& first_signal_ms() {
  static std::atomic<std::int64_t> time{0};
  return time;
}

void on_signal(int signal) {
  if (!raised().exchange(true)) {
    first_signal().store(signal);
    first_signal_ms().store(now_ms());
  } else if (now_ms() - first_signal_ms().load() > one_request_ms) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

void listen_for(int signal) {
  struct sigaction inherited {};
  if (sigaction(signal, nullptr, &inherited) == 0 && inherited.sa_handler == SIG_IGN) return;
  std::signal(signal, on_signal);
}

}  // namespace

const std::atomic<bool>& interrupt_flag() {
  static const bool installed = [] {
    raised();  // constructed before a signal can arrive
    first_signal();
    first_signal_ms();
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) listen_for(signal);
    return true;
  }();
  (void)installed;
  return raised();
}

int status_or_signal(int status) {
  const int signal = first_signal().load();
  if (signal == 0) return status;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
  return status;
}

}  // namespace dpde::tools
