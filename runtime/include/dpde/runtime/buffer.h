// SPDX-License-Identifier: Apache-2.0
// Memory for fields, trajectories and what else is as large: aligned, and all zero.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace dpde {

/// 64-byte aligned, 4 KiB from one page on. From 4 MiB on (2 MiB aligned, in huge pages where there are some) it is
/// pages of the system's own, which are there when they are first touched: a plan that touches nothing takes none.
class Buffer {
 public:
  Buffer() = default;
  /// @throws Error(machine) naming the bytes.
  explicit Buffer(std::int64_t bytes);
  /// In a file of the folder, whose room is taken at once so that a full disk is told here; it has no name and goes
  /// with the buffer. @throws Error(machine) naming the folder.
  Buffer(const std::string& folder, std::int64_t bytes);

  char* data() const { return memory_.get(); }
  /// Takes all of its pages from the system now.
  void touch() const;
  explicit operator bool() const { return memory_ != nullptr; }

 private:
  struct Release {
    Release() : mapped(0) {}
    explicit Release(std::int64_t bytes) : mapped(bytes) {}
    std::int64_t mapped;  // bytes of pages; 0: of the heap, which is touched
    void operator()(char* memory) const;
  };
  std::unique_ptr<char, Release> memory_;
};

}  // namespace dpde
