// SPDX-License-Identifier: Apache-2.0
// Line table of a source file: any offset, also one outside of the text, has a line and a column.
#include "source/source_file.h"

#include <algorithm>

namespace dpde {

SourceFile::SourceFile(std::string path, std::string text) : path_(std::move(path)), text_(std::move(text)) {
  line_starts_.push_back(0);
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (text_[i] == '\n') line_starts_.push_back(static_cast<int>(i) + 1);
  }
}

LineColumn SourceFile::locate(int offset) const {
  const int inside = std::clamp(offset, 0, static_cast<int>(text_.size()));
  const auto after = std::upper_bound(line_starts_.begin(), line_starts_.end(), inside);
  const int line = static_cast<int>(after - line_starts_.begin());
  return {line, inside - line_starts_[line - 1] + 1};
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
