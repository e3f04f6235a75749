// SPDX-License-Identifier: Apache-2.0
#include "files/data_set_cost.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

#include "files/files.h"

namespace dpde::files {

namespace {

constexpr double most_seconds = 1e12;  // 30 000 years of one processor

/// Returns the rest of the line after `word`, and removes the line from the text.
std::optional<std::string_view> line_behind(std::string_view word, std::string_view& text) {
  const std::size_t end = text.find('\n');
  if (!text.starts_with(word) || end == std::string_view::npos) return std::nullopt;
  const std::string_view line = text.substr(word.size(), end - word.size());
  text.remove_prefix(end + 1);
  return line;
}

std::optional<double> number_in(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace

std::string cost_file_of(const std::string& data_set) { return data_set + ".cost"; }

std::string cost_text(std::uint64_t hash, double seconds) {
  return fmt::format("data {:016x}\ncpu_s {}\n", hash, seconds);
}

double stored_cost(const std::string& data_set, std::uint64_t hash, SourceRange where, DiagnosticSink& sink) {
  const std::string path = cost_file_of(data_set);
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return std::nan("");
  const std::optional<std::string> bytes = read_file(path, where, sink);
  if (!bytes) return std::nan("");
  std::string_view text = *bytes;
  const auto its_hash = line_behind("data ", text), line = line_behind("cpu_s ", text);
  const std::optional<double> seconds = line ? number_in(*line) : std::nullopt;
  const bool is_one = its_hash && seconds && text.empty() && *seconds >= 0 && *seconds <= most_seconds;  // not NaN
  if (!is_one) {
    const std::string found = line && text.empty()
                                  ? fmt::format("cpu_s is {}, no number of seconds that a data set takes", *line)
                                  : "it is not the two lines that dpde run writes";
    sink.report("bad-array-file", where, {path, found},
                "remove it (the cost of the data is then not known), or make the data set again");
    return std::nan("");
  }
  return *its_hash == fmt::format("{:016x}", hash) ? *seconds : std::nan("");
}

}  // namespace dpde::files
