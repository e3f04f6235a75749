// SPDX-License-Identifier: Apache-2.0
// Positions in the protocol's form: line and character from 0; characters in UTF-16 units, or in bytes if both sides
// agree.
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
  /// An empty range is extended by the next character, so that it is visible.
  Json range(SourceRange range) const;
  /// A position outside of the text becomes the nearest one inside.
  int offset(const Json& position) const;

 private:
  int end_of_line(std::size_t line) const;

  std::string_view text_;
  bool in_bytes_;
  std::vector<int> starts_;  // of lines
};

/// file:///home/a%20b.dpde -> /home/a b.dpde; another scheme is not changed.
std::string path_of_uri(const std::string& uri);
std::string uri_of_path(const std::string& path);

}  // namespace dpde::lsp
