// SPDX-License-Identifier: Apache-2.0
// Parser for the header of an array file. Inside the runtime only.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "dpde/runtime/error.h"

namespace dpde {

constexpr std::size_t most_axes = 32;  // of an array, as in NumPy

class HeaderText {
 public:
  /// `format`: ".npy", for messages; `file` must outlive the object.
  HeaderText(std::string_view text, const std::string& file, std::string_view format)
      : text_(text), file_(file), format_(format) {}

  /// @throws Error(input) with the file's name.
  [[noreturn]] void fail(std::string_view what) const {
    throw Error(ErrorKind::input, fmt::format("{} is not a usable {} file: {}", file_, format_, what));
  }

 protected:
  void skip_space() {
    while (!text_.empty() && std::string_view(" \n\r\t").find(text_.front()) != std::string_view::npos)
      text_.remove_prefix(1);
  }
  bool accept(char c) {
    skip_space();
    if (text_.empty() || text_.front() != c) return false;
    text_.remove_prefix(1);
    return true;
  }
  void expect(char c) {
    if (!accept(c)) fail(fmt::format("its header lacks a '{}'", c));
  }
  /// Parses an integer >= 0; empty if there is none.
  std::optional<int64_t> size() {
    skip_space();
    int64_t value = 0;
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc() || value < 0) return std::nullopt;
    text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
    return value;
  }

  std::string_view text_;

 private:
  const std::string& file_;
  std::string_view format_;
};

}  // namespace dpde
