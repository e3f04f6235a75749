// SPDX-License-Identifier: Apache-2.0
// The text of an input file and its imports, and positions in it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace dpde {

/// Half-open range of byte offsets in a SourceFile; {-1, -1} means unknown (generated code).
struct SourceRange {
  int begin = -1;
  int end = -1;
  bool is_known() const { return begin >= 0; }
  bool operator==(const SourceRange&) const = default;
};

/// Source range of a node. Always equal, so that structural equality of programs ignores it.
struct Origin {
  SourceRange range;
  friend bool operator==(const Origin&, const Origin&) { return true; }
};

/// Line and column, both counted from 1; columns count bytes.
struct LineColumn {
  int line = 0;
  int column = 0;
};

/// Several files concatenated to one text, so that a range need not name its file.
class SourceFile {
 public:
  SourceFile(std::string path, std::string text);
  /// Appends an imported file.
  void append(std::string path, std::string_view text);

  /// Path of the main file.
  const std::string& path() const { return parts_.front().path; }
  std::string_view text() const { return text_; }
  /// Number of files.
  int count() const { return static_cast<int>(parts_.size()); }
  const std::string& path_of(int offset) const { return part_of(offset).path; }
  bool is_imported(int offset) const { return &part_of(offset) != &parts_.front(); }
  /// Line and column within the file of the offset.
  LineColumn locate(int offset) const;
  /// The text of a line (counted from 1 over all files) without its line break.
  std::string_view line(int number) const;
  /// The text of the line that contains the offset.
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
