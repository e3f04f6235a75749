// SPDX-License-Identifier: Apache-2.0
// The text of an input file, of those that it imports, and positions in them.
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

/// Files one behind the other in one text, so that a range needs no word about its file.
class SourceFile {
 public:
  SourceFile(std::string path, std::string text);
  /// Puts an imported file behind the others.
  void append(std::string path, std::string_view text);

  /// Of the file that all began with.
  const std::string& path() const { return parts_.front().path; }
  std::string_view text() const { return text_; }
  /// How many files there are.
  int count() const { return static_cast<int>(parts_.size()); }
  const std::string& path_of(int offset) const { return part_of(offset).path; }
  bool is_imported(int offset) const { return &part_of(offset) != &parts_.front(); }
  /// Line and column in the file of the offset.
  LineColumn locate(int offset) const;
  /// The text of the line (counted from 1 over all files) without its line break.
  std::string_view line(int number) const;
  /// The text of the line of the offset.
  std::string_view line_at(int offset) const { return line(line_of(offset)); }
  int line_count() const { return static_cast<int>(line_starts_.size()); }

 private:
  struct Part {
    std::string path;
    int begin;       // offset
    int first_line;  // from 1 over all files
  };
  const Part& part_of(int offset) const;
  int line_of(int offset) const;
  void add_lines(int from);

  std::vector<Part> parts_;
  std::string text_;
  std::vector<int> line_starts_;
};

}  // namespace dpde
