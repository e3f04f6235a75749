// SPDX-License-Identifier: Apache-2.0
// The states that a run with checkpoints has recorded, one after the other, in a file that only grows: a checkpoint
// appends what is new and keeps the length. What stands behind that length belongs to a checkpoint that a kill cut off,
// and is written over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace dpde::tools {

/// How much of which file a checkpoint means.
struct FrameMark {
  std::string file;  // its name, in the folder of the checkpoint
  std::int64_t bytes = 0;
  std::uint64_t checksum = 0;
};

class FrameFile {
 public:
  /// For a run that begins: a name no checkpoint has yet, so that the one of the run before stays whole until this run
  /// has its own. The file itself is made by the first append.
  explicit FrameFile(const std::filesystem::path& checkpoint);

  /// @throws Error(machine). A part that failed is written over by the next one.
  void append(std::span<const double> frame);
  /// What was appended is on the disk.
  /// @throws Error(machine)
  FrameMark sync();
  /// The numbers up to the mark; further ones are appended there.
  /// @throws Error(input) when the file is not the one that was marked.
  std::vector<double> reopen(const FrameMark& mark);
  /// Removes the files of other runs, once the checkpoint means this one.
  void remove_others();

 private:
  std::filesystem::path path_of(int number) const;
  void open_file();

  std::filesystem::path checkpoint_;
  FrameMark mark_;
  bool is_alone_ = false;
  class Descriptor {
   public:
    Descriptor() = default;
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number = -1;
  };
  Descriptor file_;
};

}  // namespace dpde::tools
