// SPDX-License-Identifier: Apache-2.0
// Line table of a source file: every offset, also outside the text, has a line and a column.
#include "source/source_file.h"

#include <algorithm>

namespace dpde {

SourceFile::SourceFile(std::string path, std::string text) : text_(std::move(text)) {
  parts_.push_back({std::move(path), 0, 1});
  line_starts_.push_back(0);
  add_lines(0);
}

void SourceFile::append(std::string path, std::string_view text) {
  const int end = static_cast<int>(text_.size());
  text_ += '\n';
  text_ += text;
  add_lines(end);
  parts_.push_back({std::move(path), end + 1, line_of(end + 1)});
}

void SourceFile::add_lines(int from) {
  for (std::size_t i = static_cast<std::size_t>(from); i < text_.size(); ++i) {
    if (text_[i] == '\n') line_starts_.push_back(static_cast<int>(i) + 1);
  }
}

const SourceFile::Part& SourceFile::part_of(int offset) const {
  const auto behind =
      std::find_if(parts_.begin() + 1, parts_.end(), [&](const Part& part) { return part.begin > offset; });
  return *(behind - 1);
}

int SourceFile::line_of(int offset) const {
  const int inside = std::clamp(offset, 0, static_cast<int>(text_.size()));
  const auto after = std::upper_bound(line_starts_.begin(), line_starts_.end(), inside);
  return static_cast<int>(after - line_starts_.begin());
}

LineColumn SourceFile::locate(int offset) const {
  const int inside = std::clamp(offset, 0, static_cast<int>(text_.size()));
  const int line = line_of(inside);
  return {line - part_of(inside).first_line + 1, inside - line_starts_[static_cast<std::size_t>(line) - 1] + 1};
}

std::string_view SourceFile::line(int number) const {
  if (number < 1 || number > line_count()) return {};
  const int begin = line_starts_[number - 1];
  const int end = number == line_count() ? static_cast<int>(text_.size()) : line_starts_[number] - 1;
  std::string_view line = text().substr(begin, end - begin);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

}  // namespace dpde
