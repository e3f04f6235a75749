// SPDX-License-Identifier: Apache-2.0
// The sink composes messages and limits their number.
#include "source/diagnostic.h"

#include <algorithm>

namespace dpde {
namespace {

constexpr int max_of_a_severity = 20;

/// Replaces each {} of `message` by the next argument; {} inside an argument is not replaced.
std::string fill_in(std::string_view message, std::initializer_list<std::string> arguments) {
  std::string text;
  auto argument = arguments.begin();
  while (!message.empty()) {
    const std::size_t hole = message.find("{}");
    text += message.substr(0, hole);
    if (hole == std::string_view::npos) break;
    if (argument != arguments.end()) text += *argument++;
    message.remove_prefix(hole + 2);
  }
  return text;
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

/// Number of insertions, deletions, replacements and swaps of adjacent characters that turn `a` into `b`
/// (Damerau-Levenshtein, optimal string alignment).
int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> before_last, last, row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before_last = last;
    last = row;
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
  }
  return row[b.size()];
}

/// Maximum edit distance for a suggestion, by word length.
int allowed_edits(std::size_t length) {
  if (length < 2) return 0;
  if (length < 5) return 1;
  return length < 9 ? 2 : 3;
}

}  // namespace

Diagnostic& DiagnosticSink::report(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments,
                                   const Hint& hint) {
  Diagnostic diagnostic{kind.kind, fill_in(kind.kind->message, arguments), range, {}, {}};
  const auto same = std::find_if(diagnostics_.begin(), diagnostics_.end(), [&](const Diagnostic& other) {
    return other.kind == diagnostic.kind && other.message == diagnostic.message && other.range == range;
  });
  if (same != diagnostics_.end()) return *same;  // several derivatives may report the same problem
  const Severity severity = kind.kind->severity;
  if (severity == Severity::error) ++error_count_;
  const auto kept = std::count_if(diagnostics_.begin(), diagnostics_.end(),
                                  [&](const Diagnostic& other) { return other.kind->severity == severity; });
  if (kept >= max_of_a_severity) return overflow_ = std::move(diagnostic);
  diagnostic.hint = hint.text();
  return diagnostics_.emplace_back(std::move(diagnostic));
}

void DiagnosticSink::add(const Diagnostic& diagnostic) {
  diagnostics_.push_back(diagnostic);
  if (diagnostic.kind->severity == Severity::error) ++error_count_;
}

bool DiagnosticSink::is_full() const { return error_count_ >= max_of_a_severity; }

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string wanted = lower(name);
  const int allowed = allowed_edits(name.size());
  std::string nearest;
  int nearest_distance = allowed + 1;
  for (const std::string& candidate : candidates) {
    if (candidate == name) continue;
    const auto difference = static_cast<long>(candidate.size()) - static_cast<long>(name.size());
    if (difference > allowed || difference < -allowed) continue;
    const int distance = edit_distance(wanted, lower(candidate));
    if (distance >= nearest_distance) continue;
    nearest = candidate;
    nearest_distance = distance;
  }
  return nearest;
}

}  // namespace dpde
