// SPDX-License-Identifier: Apache-2.0
// Serialisation of numbers and texts to bytes, and a hash of bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dpde {

/// FNV-1a hash; pass an earlier hash to chain.
std::uint64_t hash_bytes(const void* bytes, std::size_t count, std::uint64_t hash = 14695981039346656037ull);

/// Serialises values one after the other, and reads them back. A read beyond the end returns an empty value and marks
/// the reader as failed.
class ByteWriter {
 public:
  void number(std::int64_t value);
  void text(std::string_view value);
  void values(const std::vector<double>& values);
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}
  std::int64_t number();
  std::string text();
  std::vector<double> values();
  /// True if all reads succeeded and no bytes remain.
  bool is_done() const { return fine_ && rest_.empty(); }
  bool is_fine() const { return fine_; }

 private:
  std::string_view take(std::size_t count);

  std::string_view rest_;
  bool fine_ = true;
};

}  // namespace dpde
