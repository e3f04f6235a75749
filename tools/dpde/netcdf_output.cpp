// SPDX-License-Identifier: Apache-2.0
#include "netcdf_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "at_centres.h"
#include "dpde/runtime/error.h"
#include "files/files.h"
#include "scene_output.h"

namespace dpde::tools {

driver::RunOrigin origin_of(const Job& job, const std::string& verb, const std::string& name) {
  const CommonOptions& options = job.options();
  return {verb, options.file, name, options.set, options.scheme, options.backend, options.seed};
}

NetcdfAttributes attributes_of(const Job& job, const driver::Session& session, const std::string& verb,
                               const std::string& name) {
  return driver::attributes_of(session.problem(), job.source(), origin_of(job, verb, name));
}

NetcdfNames free_names(const driver::Session& session) { return NetcdfNames(driver::taken_names(session.problem())); }

void add_report(NetcdfContent& content, std::uint64_t key, const report::Report& report) {
  content.attributes.insert(
      content.attributes.end(),
      {{"dpde_key", fmt::format("{:016x}", key)}, {"dpde_told", report.text()}, {"dpde_result", report.json.dump()}});
}

std::optional<report::Report> report_of_finished(const Job& job, const std::string& file, std::uint64_t key) {
  const std::filesystem::path path = std::filesystem::path(job.options().out) / file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  DiagnosticSink silent;
  std::optional<std::string> bytes = files::read_file(path, {}, silent);
  if (!bytes) return std::nullopt;
  try {
    const NetcdfReader reader(std::move(*bytes), path.string());
    if (reader.text("", "dpde_key") != fmt::format("{:016x}", key)) return std::nullopt;
    const std::optional<Json> json = parse_json(reader.text("", "dpde_result").value_or(""));
    if (!json || !json->is_object()) return std::nullopt;
    report::Report found;
    found.say(reader.text("", "dpde_told").value_or(""));
    found.json = *json;
    return found;
  } catch (const Error&) {
    return std::nullopt;  // damaged, or no such file: it is made again
  }
}

RunDescription description_of(const Job& job, driver::Session& session, bool with_centres) {
  std::vector<std::string> states;
  for (int s = 0; s < session.rollout().state_count(); ++s) states.push_back(session.rollout().state_name(s));
  RunDescription run = driver::describe_run(session.problem(), session.axes(), states, job.source(), origin_of(job));
  for (RunField& field : run.fields) {
    if (!with_centres || std::ranges::find(field.on_faces, true) == field.on_faces.end()) continue;
    field.at_centres = [&session, name = field.name](std::vector<double> values) {
      return at_centres(session, name, std::move(values));
    };
  }
  return run;
}

void save_netcdf(Job& job, const RunDescription& run, const RunRecord& record) {
  const std::string file = run.scene + ".nc";
  save_file(job, file, [&](const std::filesystem::path& path) { write_run(path, run, record); });
  if (run.axes.size() == 3) save_text(job, run.scene + ".xdmf", xdmf_of(file, run, record));
}

}  // namespace dpde::tools
