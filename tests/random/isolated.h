// SPDX-License-Identifier: Apache-2.0
// Work in a process of its own: what crashes or never ends is an answer too.
#pragma once

#include <functional>
#include <string>

namespace dpde::testing {

struct Answer {
  enum class Kind { given, crashed, late } kind = Kind::given;
  std::string text;  // of a crash: what the process ended with
};

/// What `work` returns; it is stopped after so many seconds. The caller must not have run threads: they are not there
/// in the other process.
Answer isolated(const std::function<std::string()>& work, double seconds);

}  // namespace dpde::testing
