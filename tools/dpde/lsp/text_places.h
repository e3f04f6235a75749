// SPDX-License-Identifier: Apache-2.0
// Places as the protocol has them: line and character from 0, characters in units of UTF-16 unless both sides agree on
// bytes.
#pragma once

#include <string_view>
#include <vector>

#include "source/source_file.h"
#include "support/json.h"

namespace dpde::lsp {

class TextPlaces {
 public:
  TextPlaces(std::string_view text, bool in_bytes);

  Json position(int offset) const;
  /// An empty range holds the character behind it, so that it can be seen.
  Json range(SourceRange range) const;
  /// Of a place outside of the text the nearest one in it.
  int offset(const Json& position) const;

 private:
  int end_of_line(std::size_t line) const;

  std::string_view text_;
  bool in_bytes_;
  std::vector<int> starts_;  // of lines
};

/// file:///home/a%20b.dpde -> /home/a b.dpde; another scheme stays as it is.
std::string path_of_uri(const std::string& uri);
std::string uri_of_path(const std::string& path);

}  // namespace dpde::lsp
