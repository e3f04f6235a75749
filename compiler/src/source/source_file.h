// SPDX-License-Identifier: Apache-2.0
// The text of one input file and positions in it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dpde {

/// Half-open range of byte offsets in a SourceFile; {-1, -1} means "no place" (generated code).
struct SourceRange {
  int begin = -1;
  int end = -1;
  bool is_known() const { return begin >= 0; }
  bool operator==(const SourceRange&) const = default;
};

/// Where a node came from. Always equal, so that structural equality of programs ignores it.
struct Origin {
  SourceRange range;
  friend bool operator==(const Origin&, const Origin&) { return true; }
};

/// Line and column, both counted from 1; columns count bytes.
struct LineColumn {
  int line = 0;
  int column = 0;
};

class SourceFile {
 public:
  SourceFile(std::string path, std::string text);

  const std::string& path() const { return path_; }
  std::string_view text() const { return text_; }
  LineColumn locate(int offset) const;
  /// The text of a line (from 1), without its line break.
  std::string_view line(int number) const;
  int line_count() const { return static_cast<int>(line_starts_.size()); }

 private:
  std::string path_;
  std::string text_;
  std::vector<int> line_starts_;
};

}  // namespace dpde
