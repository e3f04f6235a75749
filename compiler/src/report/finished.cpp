// SPDX-License-Identifier: Apache-2.0
#include "report/finished.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "dpde/runtime/error.h"
#include "files/files.h"

namespace dpde::report {

void add_report(NetcdfContent& content, std::uint64_t key, const Report& report) {
  content.attributes.insert(
      content.attributes.end(),
      {{"dpde_key", fmt::format("{:016x}", key)}, {"dpde_told", report.text()}, {"dpde_result", report.json.dump()}});
}

std::optional<Report> report_of_finished(const std::filesystem::path& file, std::uint64_t key) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return std::nullopt;
  DiagnosticSink silent;
  std::optional<std::string> bytes = files::read_file(file, {}, silent);
  if (!bytes) return std::nullopt;
  try {
    const NetcdfReader reader(std::move(*bytes), file.string());
    if (reader.text("", "dpde_key") != fmt::format("{:016x}", key)) return std::nullopt;
    const std::optional<Json> json = parse_json(reader.text("", "dpde_result").value_or(""));
    if (!json || !json->is_object()) return std::nullopt;
    Report found;
    found.say(reader.text("", "dpde_told").value_or(""));
    found.json = *json;
    return found;
  } catch (const Error&) {
    return std::nullopt;  // damaged or missing: the job is done again
  }
}

}  // namespace dpde::report
