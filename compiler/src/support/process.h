// SPDX-License-Identifier: Apache-2.0
// Other programs and their files: a folder that does not outlive its scope, and a program that no shell sees.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dpde {

/// Only this user can read it. A signal that ends the process at once leaves it behind.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  /// Empty when the folder could not be made; errno says why.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct ProcessResult {
  int error = 0;    // why it did not start, as errno; else 0
  int status = -1;  // its exit status; -1 when a signal ended it
  bool succeeded() const { return error == 0 && status == 0; }
};

/// Runs words[0] (looked up in PATH) with the others as its arguments. No input; both outputs go to the file `log`.
ProcessResult run_process(std::vector<std::string> words, const std::filesystem::path& log = "/dev/null");

}  // namespace dpde
