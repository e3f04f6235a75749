// SPDX-License-Identifier: Apache-2.0
#include "interrupt.h"

#include <csignal>

namespace dpde::tools {

namespace {

std::atomic<bool>& raised() {
  static std::atomic<bool> flag{false};
  return flag;
}

void on_signal(int signal) {
  raised().store(true);
  std::signal(signal, SIG_DFL);
}

}  // namespace

const std::atomic<bool>& interrupt_flag() {
  static const bool installed = [] {
    raised();  // made before a signal can come
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    return true;
  }();
  (void)installed;
  return raised();
}

}  // namespace dpde::tools
