// SPDX-License-Identifier: Apache-2.0
// Aligned, zero-initialised memory for fields, trajectories and other large arrays.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace dpde {

/// Alignment: 64 bytes; 4 KiB from one page on; 2 MiB from 4 MiB on (in huge pages if available). From 4 MiB on the
/// pages come directly from the system and exist only once they are touched: a plan that touches nothing uses no
/// memory.
class Buffer {
 public:
  Buffer() = default;
  /// @throws Error(machine) naming the bytes.
  explicit Buffer(std::int64_t bytes);
  /// Memory mapped to a file of the folder. Its disk space is reserved immediately, so that a full disk is reported
  /// here. The file has no name and disappears with the buffer. @throws Error(machine) naming the folder.
  Buffer(const std::string& folder, std::int64_t bytes);

  char* data() const { return memory_.get(); }
  /// Makes the system provide all pages now.
  void touch() const;
  explicit operator bool() const { return memory_ != nullptr; }

 private:
  struct Release {
    Release() : mapped(0) {}
    explicit Release(std::int64_t bytes) : mapped(bytes) {}
    std::int64_t mapped;  // bytes of mapped pages; 0: heap memory, already touched
    void operator()(char* memory) const;
  };
  std::unique_ptr<char, Release> memory_;
};

}  // namespace dpde
