// SPDX-License-Identifier: Apache-2.0
// Compilation and the setup of fields do not check the interrupt flag. They write nothing that another call could
// mistake for a complete file, so the first Ctrl-C or SIGTERM may end the process.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "command.h"
#include "support/process.h"

namespace dpde::tools {

/// During its lifetime a thread watches interrupt_flag(), reports `stopped` as an error of the job and ends the
/// process.
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
  std::unique_ptr<TemporaryFolder> folder_;  // for temporary files of C++ compilers, so that they can be removed
  std::string temporary_;                    // original $TMPDIR; "": not set
  std::jthread watcher_;
};

}  // namespace dpde::tools
