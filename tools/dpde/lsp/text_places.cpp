// SPDX-License-Identifier: Apache-2.0
#include "lsp/text_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>

#include "source/utf8.h"

namespace dpde::lsp {

namespace {

int units_of(const Utf8Character& character) { return character.valid && character.code > 0xFFFF ? 2 : 1; }

constexpr std::string_view file_scheme = "file://";

}  // namespace

TextPlaces::TextPlaces(std::string_view text, bool in_bytes) : text_(text), in_bytes_(in_bytes), starts_{0} {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\n') starts_.push_back(static_cast<int>(i) + 1);
  }
}

int TextPlaces::end_of_line(std::size_t line) const {
  int end = line + 1 < starts_.size() ? starts_[line + 1] - 1 : static_cast<int>(text_.size());
  if (end > starts_[line] && text_[static_cast<std::size_t>(end) - 1] == '\r') --end;
  return end;
}

Json TextPlaces::position(int offset) const {
  offset = std::clamp(offset, 0, static_cast<int>(text_.size()));
  const auto behind = std::upper_bound(starts_.begin(), starts_.end(), offset);
  const auto line = static_cast<std::size_t>(behind - starts_.begin()) - 1;
  int character = offset - starts_[line];
  if (!in_bytes_) {
    character = 0;
    for (int at = starts_[line]; at < offset;) {
      const Utf8Character next = first_character(text_.substr(static_cast<std::size_t>(at)));
      character += units_of(next);
      at += next.bytes;
    }
  }
  return {{"line", line}, {"character", character}};
}

Json TextPlaces::range(SourceRange range) const {
  const int size = static_cast<int>(text_.size());
  int begin = std::clamp(range.begin, 0, size), end = std::clamp(range.end, 0, size);
  if (end <= begin)
    end = begin < size ? begin + first_character(text_.substr(static_cast<std::size_t>(begin))).bytes : size;
  return {{"start", position(begin)}, {"end", position(end)}};
}

int TextPlaces::offset(const Json& position) const {
  const auto line = position.at("line").get<std::int64_t>();
  auto character = position.at("character").get<std::int64_t>();
  if (line < 0) return 0;
  if (line >= static_cast<std::int64_t>(starts_.size())) return static_cast<int>(text_.size());
  const auto number = static_cast<std::size_t>(line);
  const int end = end_of_line(number);
  int at = starts_[number];
  while (at < end && character > 0) {
    const Utf8Character next = first_character(text_.substr(static_cast<std::size_t>(at)));
    character -= in_bytes_ ? next.bytes : units_of(next);
    at += next.bytes;
  }
  return std::min(at, end);
}

std::string path_of_uri(const std::string& uri) {
  if (!uri.starts_with(file_scheme)) return uri;
  std::string path;
  for (std::size_t i = file_scheme.size(); i < uri.size(); ++i) {
    unsigned code = 0;
    const char* digits = uri.data() + i + 1;
    if (uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, code, 16).ptr == digits + 2) {
      path += static_cast<char>(code);
      i += 2;
    } else {
      path += uri[i];
    }
  }
  return path;
}

std::string uri_of_path(const std::string& path) {
  std::error_code ignored;
  const std::filesystem::path whole = std::filesystem::absolute(path, ignored);
  std::string uri(file_scheme);
  for (const char c : ignored ? path : whole.lexically_normal().string()) {
    const bool is_plain =
        std::isalnum(static_cast<unsigned char>(c)) != 0 || std::string_view("/-_.~").find(c) != std::string_view::npos;
    uri += is_plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

}  // namespace dpde::lsp
