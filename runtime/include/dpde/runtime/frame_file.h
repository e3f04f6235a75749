// SPDX-License-Identifier: Apache-2.0
// The states that a run has recorded, one after the other, in a file that only grows, so that none is held in memory.
// It has no name until a checkpoint means it and goes with the process; a checkpoint keeps its length. What stands
// behind that length belongs to a checkpoint that a kill cut off, and is written over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace dpde {

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
  /// Those numbers that begin at this one. @throws Error(machine)
  void read(std::int64_t first, std::span<double> numbers) const;
  /// Numbers that were appended.
  std::int64_t count() const { return mark_.bytes / std::int64_t{sizeof(double)}; }
  /// What was appended is on the disk, under its name.
  /// @throws Error(machine)
  FrameMark sync();
  /// Goes on behind the mark of another run's file.
  /// @throws Error(input) when the file is not the one that was marked.
  void reopen(const FrameMark& mark);
  /// Removes the files of other runs, once the checkpoint means this one.
  void remove_others();

 private:
  std::filesystem::path path() const { return checkpoint_.parent_path() / mark_.file; }
  std::filesystem::path path_of(int number) const;
  std::string descriptor_name() const;
  void open_file();

  std::filesystem::path checkpoint_;
  FrameMark mark_;
  bool is_alone_ = false;
  /// Closed in the end; a name that no checkpoint means goes too.
  class Descriptor {
   public:
    Descriptor() = default;
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number = -1;
    bool has_name = false;
    std::filesystem::path unmeant;  // its name, where the system gives one at once
  };
  Descriptor file_;
};

}  // namespace dpde
