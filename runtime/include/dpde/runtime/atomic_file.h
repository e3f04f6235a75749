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

/// Writes the parts one after the other. When anything fails the temporary file is removed and a file that was there
/// before under `path` is untouched. The folder must exist. An existing special file (a device, a pipe) is written
/// directly.
/// @throws Error(machine) naming the file and the operating system's reason.
void write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
/// The same of a file that nobody but its owner may read or write, whoever could before.
void write_private_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts);
void write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// The same of a file that is written bit by bit. Unless it is finished there is none. All throw Error(machine) naming
/// the file and the operating system's reason.
class AtomicFile {
 public:
  enum class Access { usual, of_owner };
  explicit AtomicFile(const std::filesystem::path& path, Access access = Access::usual);
  ~AtomicFile();
  AtomicFile(AtomicFile&&) noexcept;
  AtomicFile& operator=(AtomicFile&&) noexcept;

  /// Behind what was written before.
  void append(std::string_view part);
  /// A name by which a library can open it, reading and writing; "" of a special file. A kill from here on leaves it.
  std::string name();
  /// Room for so many bytes behind its end, where the file system tells: a library that cannot write may break down.
  void reserve(std::int64_t bytes) const;
  /// The bytes from `offset`, as many as there are.
  std::string_view read(std::int64_t offset, std::span<char> buffer) const;
  /// Its first bytes only; what is appended comes behind them.
  void cut(std::int64_t bytes);
  /// The file is there, whole.
  void finish();

 private:
  class Output;
  std::unique_ptr<Output> output_;
};

}  // namespace dpde
