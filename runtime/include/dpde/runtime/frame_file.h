// SPDX-License-Identifier: Apache-2.0
// The recorded states of a run, one after the other, in a file that only grows, so that none is held in memory. The
// file has no name, and goes with the process, until a checkpoint refers to it. A checkpoint stores its length; bytes
// after that length were written for a checkpoint that did not complete, and are overwritten.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace dpde {

/// The file of a checkpoint and how much of it counts.
struct FrameMark {
  std::string file;  // name, in the folder of the checkpoint
  std::int64_t bytes = 0;
  std::uint64_t checksum = 0;
};

class FrameFile {
 public:
  /// For a new run: takes a name that no checkpoint has yet, so that the checkpoint of the previous run stays valid
  /// until this run has its own. The first append creates the file.
  explicit FrameFile(const std::filesystem::path& checkpoint);

  /// @throws Error(machine). A part that failed is overwritten by the next one.
  void append(std::span<const double> frame);
  /// Reads numbers from number `first` on. @throws Error(machine)
  void read(std::int64_t first, std::span<double> numbers) const;
  /// Count of numbers that were appended.
  std::int64_t count() const { return mark_.bytes / std::int64_t{sizeof(double)}; }
  /// Writes everything to the disk, under the file's name.
  /// @throws Error(machine)
  FrameMark sync();
  /// Continues after the mark of another run's file.
  /// @throws Error(input) if the file is not the one that was marked.
  void reopen(const FrameMark& mark);
  /// Removes the files of other runs, once the checkpoint refers to this one.
  void remove_others();

 private:
  std::filesystem::path path() const { return checkpoint_.parent_path() / mark_.file; }
  std::filesystem::path path_of(int number) const;
  std::string descriptor_name() const;
  void open_file();

  std::filesystem::path checkpoint_;
  FrameMark mark_;
  bool is_alone_ = false;
  /// Closes the file in the end and removes a name that no checkpoint refers to.
  class Descriptor {
   public:
    Descriptor() = default;
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number = -1;
    bool has_name = false;
    std::filesystem::path unmeant;  // its name, if the file has one from the start
  };
  Descriptor file_;
};

}  // namespace dpde
