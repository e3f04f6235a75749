// SPDX-License-Identifier: Apache-2.0
#include "lsp/wire.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>

namespace dpde::lsp {

namespace {

constexpr std::size_t longest_message = std::size_t{1} << 26;
constexpr std::size_t longest_line = std::size_t{1} << 12;

/// N of "Content-Length: N"; nullopt for other lines.
std::optional<std::size_t> length_in(std::string_view line) {
  constexpr std::string_view key = "content-length:";
  if (line.size() < key.size()) return std::nullopt;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const char c = line[i];
    if ((c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c) != key[i]) return std::nullopt;
  }
  line.remove_prefix(key.size());
  while (line.starts_with(' ')) line.remove_prefix(1);
  std::size_t length = 0;
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), length);
  if (error != std::errc() || end != line.data() + line.size() || length > longest_message) return std::nullopt;
  return length;
}

}  // namespace

bool Wire::read_more() {
  std::array<char, 1 << 16> bytes;
  ssize_t count = 0;
  do {
    count = ::read(in_, bytes.data(), bytes.size());
  } while (count < 0 && errno == EINTR);
  if (count <= 0) return false;
  buffer_.append(bytes.data(), static_cast<std::size_t>(count));
  return true;
}

/// Without the line end; empty if it is too long to be valid.
std::optional<std::string> Wire::read_line() {
  while (true) {
    const std::size_t end = buffer_.find('\n');
    if (end != std::string::npos) {
      std::string line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      if (line.ends_with('\r')) line.pop_back();
      return line;
    }
    if (buffer_.size() > longest_line) buffer_.clear();
    if (!read_more()) return std::nullopt;
  }
}

std::optional<std::string> Wire::read_bytes(std::size_t count) {
  while (buffer_.size() < count) {
    if (!read_more()) return std::nullopt;
  }
  std::string bytes = buffer_.substr(0, count);
  buffer_.erase(0, count);
  return bytes;
}

std::optional<std::string> Wire::read() {
  std::optional<std::size_t> length;
  while (const std::optional<std::string> line = read_line()) {
    if (const std::optional<std::size_t> found = length_in(*line)) length = found;
    if (line->empty() && length) return read_bytes(*length);
  }
  return std::nullopt;
}

bool Wire::is_idle() const {
  if (!buffer_.empty()) return false;
  pollfd waiting{in_, POLLIN, 0};
  return poll(&waiting, 1, 0) == 0;
}

bool Wire::write(const Json& message) const {
  const std::string body = message.dump();
  const std::string text = fmt::format("Content-Length: {}\r\n\r\n{}", body.size(), body);
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(out_, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    done += static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace dpde::lsp
