// SPDX-License-Identifier: Apache-2.0
// A line is split into cells (displayed text and width of each character). The underline is made from the same cells,
// so both stay aligned with tabs, wide characters and invalid bytes.
#include "source/render.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "source/utf8.h"

namespace dpde {
namespace {

constexpr int tab_width = 4;
constexpr int max_columns = 160;
constexpr int columns_before_caret = 60;
constexpr std::string_view cut_mark = "...";

struct Cell {
  std::string shown;
  int width = 1;
  int offset = 0;  // bytes from the start of the line
};

std::vector<Cell> cells_of(std::string_view line) {
  std::vector<Cell> cells;
  int column = 0;
  for (int i = 0; i < static_cast<int>(line.size());) {
    const Utf8Character character = first_character(line.substr(i));
    Cell cell{"?", 1, i};
    if (line[i] == '\t') {
      cell.width = tab_width - column % tab_width;
      cell.shown = std::string(cell.width, ' ');
    } else if (character.valid && is_printable(character.code)) {
      cell.width = display_width(character.code);
      cell.shown = line.substr(i, character.bytes);
    }
    column += cell.width;
    i += character.bytes;
    cells.push_back(std::move(cell));
  }
  return cells;
}

/// Index range of the displayed cells: all of a short line, or a part around `caret` of a long one.
struct Window {
  std::size_t begin, end;
};

Window window_around(const std::vector<Cell>& cells, std::size_t caret) {
  int total = 0;
  for (const Cell& cell : cells) total += cell.width;
  if (total <= max_columns) return {0, cells.size()};
  std::size_t begin = std::min(caret, cells.size());
  for (int room = columns_before_caret; begin > 0 && room >= cells[begin - 1].width; --begin) {
    room -= cells[begin - 1].width;
  }
  std::size_t end = begin;
  for (int room = max_columns; end < cells.size() && room >= cells[end].width; ++end) room -= cells[end].width;
  return {begin, end};
}

struct Style {
  std::string_view error = "", note = "", caret = "", bold = "", reset = "";
};

Style style_of(bool colour, Severity severity) {
  if (!colour) return {};
  return {severity == Severity::error ? "\033[1;31m" : "\033[1;35m", "\033[1;36m", "\033[1;32m", "\033[1m", "\033[0m"};
}

/// The first line of `range`, and ^~~~ below it, both indented by two.
std::string excerpt(const SourceFile& file, SourceRange range, const Style& style) {
  const LineColumn place = file.locate(range.begin);
  const std::string_view line = file.line_at(range.begin);
  const int begin = place.column - 1;
  const int end = std::max(begin + 1, begin + std::max(0, range.end - range.begin));
  const std::vector<Cell> cells = cells_of(line);
  const auto is_before_caret = [&](const Cell& cell) { return cell.offset < begin; };
  std::size_t caret = std::find_if_not(cells.begin(), cells.end(), is_before_caret) - cells.begin();
  // An offset inside a multi-byte character refers to that character.
  const int caret_offset = caret < cells.size() ? cells[caret].offset : static_cast<int>(line.size());
  if (caret_offset > begin) --caret;
  const Window window = window_around(cells, caret);

  std::string shown(window.begin > 0 ? cut_mark : "");
  std::string below(shown.size(), ' ');
  std::string marks;
  for (std::size_t i = window.begin; i < window.end; ++i) {
    shown += cells[i].shown;
    if (i < caret) below.append(cells[i].width, ' ');
    if (i == caret) marks.append(1, '^').append(std::max(0, cells[i].width - 1), '~');
    if (i > caret && cells[i].offset < end) marks.append(cells[i].width, '~');
  }
  if (window.end < cells.size()) shown += cut_mark;
  if (marks.empty()) marks += '^';
  while (shown.ends_with(' ')) shown.pop_back();
  return fmt::format("  {}\n  {}{}{}{}\n", shown, below, style.caret, marks, style.reset);
}

std::string place_of(const SourceFile& file, SourceRange range) {
  const std::string path = printable(file.path_of(range.begin));
  if (!range.is_known()) return path.empty() ? "" : path + ": ";
  const LineColumn place = file.locate(range.begin);
  return fmt::format("{}:{}:{}: ", path, place.line, place.column);
}

std::string_view name_of(Severity severity) { return severity == Severity::error ? "error" : "warning"; }

}  // namespace

std::string render_text(const SourceFile& file, const Diagnostic& diagnostic, bool colour) {
  const Severity severity = diagnostic.kind->severity;
  const Style style = style_of(colour, severity);
  std::string text =
      fmt::format("{0}{1}{2}{3}{4}[{5}]:{2} {0}{6}{2}\n", style.bold, place_of(file, diagnostic.range), style.reset,
                  style.error, name_of(severity), diagnostic.kind->code, printable(diagnostic.message));
  if (diagnostic.range.is_known()) text += excerpt(file, diagnostic.range, style);
  for (const Note& note : diagnostic.notes) {
    const std::string place = note.range.is_known() ? place_of(file, note.range) : "";
    text += fmt::format("{}{}note:{} {}\n", place, style.note, style.reset, printable(note.text));
    if (note.range.is_known()) text += excerpt(file, note.range, style);
  }
  if (!diagnostic.hint.empty()) {
    text += fmt::format("{}help:{} {}\n", style.note, style.reset, printable(diagnostic.hint));
  }
  return text;
}

namespace {

/// Where the diagnostics are, each line once: " (lines 3, 7)"; "" if none has a place.
std::string lines_text(const SourceFile& file, const std::vector<const Diagnostic*>& diagnostics) {
  std::vector<std::string> lines;
  for (const Diagnostic* one : diagnostics) {
    if (!one->range.is_known()) continue;
    const std::string line = fmt::format("{}", file.locate(one->range.begin).line);
    const std::string path = file.path_of(one->range.begin);
    lines.push_back(path == file.path() ? line : path + ':' + line);
    if (std::find(lines.begin(), lines.end() - 1, lines.back()) != lines.end() - 1) lines.pop_back();
  }
  return lines.empty() ? "" : fmt::format(" (line{} {})", lines.size() == 1 ? "" : "s", fmt::join(lines, ", "));
}

}  // namespace

std::string render_kinds_once(const SourceFile& file, const std::vector<Diagnostic>& diagnostics,
                              const std::string& option, bool colour) {
  std::string text;
  std::map<std::string_view, std::vector<const Diagnostic*>> warnings;  // by code
  std::vector<std::string_view> codes;                                  // in the order of their first warning
  for (const Diagnostic& one : diagnostics) {
    if (one.kind->severity == Severity::error) {
      text += render_text(file, one, colour);
      continue;
    }
    std::vector<const Diagnostic*>& alike = warnings[one.kind->code];
    if (alike.empty()) codes.push_back(one.kind->code);
    const auto is_same = [&](const Diagnostic* other) {
      return other->message == one.message && other->range.begin == one.range.begin;
    };
    if (std::ranges::none_of(alike, is_same)) alike.push_back(&one);
  }
  for (const std::string_view code : codes) {
    const std::vector<const Diagnostic*>& alike = warnings[code];
    text += render_text(file, *alike.front(), colour);
    if (alike.size() == 1) continue;
    const Style style = style_of(colour, Severity::warning);
    const std::vector<const Diagnostic*> others(alike.begin() + 1, alike.end());
    text += fmt::format("{}note:{} {} more of {}{}: {} shows {}\n", style.note, style.reset, others.size(), code,
                        lines_text(file, others), option, others.size() == 1 ? "it" : "them");
  }
  return text;
}

Json diagnostics_json(const SourceFile& file, const std::vector<Diagnostic>& diagnostics) {
  Json rows = Json::array();
  for (const Diagnostic& diagnostic : diagnostics) {
    const LineColumn place = diagnostic.range.is_known() ? file.locate(diagnostic.range.begin) : LineColumn{};
    Json row;
    row["code"] = diagnostic.kind->code;
    row["severity"] = name_of(diagnostic.kind->severity);
    row["message"] = diagnostic.message;
    row["file"] = file.path_of(diagnostic.range.begin);
    row["line"] = place.line;
    row["column"] = place.column;
    row["hint"] = diagnostic.hint;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace dpde
