// SPDX-License-Identifier: Apache-2.0
// Compiling and the making of fields hear no flag. Nothing is written meanwhile that another call could take for whole:
// the first Ctrl-C or SIGTERM may end the process.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "command.h"
#include "support/process.h"

namespace dpde::tools {

/// While it lives, a thread looks at interrupt_flag(), says `stopped` as an error of the job's and ends the process.
class Preparing {
 public:
  explicit Preparing(const Job& job, std::string stopped = "stopped before anything was run");
  Preparing(const Preparing&) = delete;
  Preparing& operator=(const Preparing&) = delete;
  ~Preparing();

 private:
  void watch(const std::stop_token& done) const;
  void end() const;

  CommonOptions options_;
  std::string stopped_;
  std::unique_ptr<TemporaryFolder> folder_;  // holds those of C++ compilers, so that they can be removed
  std::string temporary_;                    // $TMPDIR as it was; "" when it was not set
  std::jthread watcher_;
};

}  // namespace dpde::tools
