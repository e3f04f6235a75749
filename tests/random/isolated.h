// SPDX-License-Identifier: Apache-2.0
// Work in a separate process, so that crashes and hangs are results, too.
#pragma once

#include <functional>
#include <string>

namespace dpde::testing {

struct Answer {
  enum class Kind { given, crashed, late } kind = Kind::given;
  std::string text;  // after a crash: how the process ended
};

/// The result of `work`, with a time limit in seconds. The caller must not have started threads: they do not exist in
/// the other process.
Answer isolated(const std::function<std::string()>& work, double seconds);

}  // namespace dpde::testing
