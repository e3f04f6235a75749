// SPDX-License-Identifier: Apache-2.0
// Files that are either complete or absent: written under a temporary name in the same folder, synced, renamed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace dpde {

/// Writes the parts one after the other. On failure the temporary file is removed, and a file that existed under `path`
/// stays unchanged. The folder must exist. An existing special file (a device, a pipe) is written directly.
/// @throws Error(machine) naming the file and the operating system's reason.
void write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
/// The same for a file that only its owner may read or write, whatever the permissions were before.
void write_private_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// The same for a file that is written piece by piece. Without finish() no file appears. All members throw
/// Error(machine) with the file and the operating system's reason.
class AtomicFile {
 public:
  enum class Access { usual, of_owner };
  explicit AtomicFile(const std::filesystem::path& path, Access access = Access::usual);
  ~AtomicFile();
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;

  /// Appends to what was written before.
  void append(std::string_view part);
  /// A name by which a library can open the file to read and write; "" for a special file. If the process is killed
  /// from here on, the temporary file remains.
  std::string name();
  /// Reserves disk space for so many bytes after the end, if the file system supports it: some libraries crash when a
  /// write fails.
  void reserve(std::int64_t bytes) const;
  /// The bytes from `offset` on; fewer than asked for at the end of the file.
  std::string_view read(std::int64_t offset, std::span<char> buffer) const;
  /// Truncates the file to its first `bytes` bytes; later appends go after them.
  void cut(std::int64_t bytes);
  /// Moves the complete file to its final name.
  void finish();

 private:
  class Output;
  std::unique_ptr<Output> output_;
};

}  // namespace dpde
