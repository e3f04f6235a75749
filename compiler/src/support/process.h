// SPDX-License-Identifier: Apache-2.0
// Temporary folders that are removed at the end of their scope, and running programs without a shell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace dpde {

/// Readable by this user only. Not removed if a signal kills the process.
class TemporaryFolder {
 public:
  TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder();
  /// Empty if the folder could not be created; errno has the reason.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

struct ProcessResult {
  int error = 0;    // errno if it did not start, else 0
  int status = -1;  // exit status; -1 if a signal killed it
  bool succeeded() const { return error == 0 && status == 0; }
};

/// Runs words[0] (found in PATH) with the other words as arguments, without input. stdout and stderr go to the file
/// `log`.
ProcessResult run_process(std::vector<std::string> words, const std::filesystem::path& log = "/dev/null");

}  // namespace dpde
