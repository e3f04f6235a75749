// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/bytes.h"

#include <cstring>

namespace dpde {

std::uint64_t hash_bytes(const void* bytes, std::size_t count, std::uint64_t hash) {
  const unsigned char* data = static_cast<const unsigned char*>(bytes);
  for (std::size_t i = 0; i < count; ++i) hash = (hash ^ data[i]) * 1099511628211ull;
  return hash;
}

void ByteWriter::number(std::int64_t value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }

void ByteWriter::text(std::string_view value) {
  number(static_cast<std::int64_t>(value.size()));
  bytes_ += value;
}

void ByteWriter::values(const std::vector<double>& values) {
  text({reinterpret_cast<const char*>(values.data()), sizeof(double) * values.size()});
}

std::string_view ByteReader::take(std::size_t count) {
  fine_ = fine_ && count <= rest_.size();
  if (!fine_) return {};
  const std::string_view taken = rest_.substr(0, count);
  rest_.remove_prefix(count);
  return taken;
}

std::int64_t ByteReader::number() {
  std::int64_t value = 0;
  const std::string_view bytes = take(sizeof value);
  if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

std::string ByteReader::text() {
  const std::int64_t size = number();
  return std::string(take(static_cast<std::size_t>(size)));
}

std::vector<double> ByteReader::values() {
  const std::string bytes = text();
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), sizeof(double) * values.size());
  return values;
}

}  // namespace dpde
