// SPDX-License-Identifier: Apache-2.0
#include "netcdf_output.h"

#include <filesystem>

#include "driver/report/centres.h"
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

RunDescription description_of(const Job& job, driver::Session& session, bool with_centres) {
  std::vector<std::string> states;
  for (int s = 0; s < session.rollout().state_count(); ++s) states.push_back(session.rollout().state_name(s));
  RunDescription run = driver::describe_run(session.problem(), session.axes(), states, job.source(), origin_of(job));
  if (with_centres) driver::add_centres(run, session.problem(), session.axes());
  return run;
}

void save_netcdf(Job& job, const RunDescription& run, const RunRecord& record) {
  const std::string file = run.scene + ".nc";
  save_file(job, file, [&](const std::filesystem::path& path) { write_run(path, run, record); });
  if (run.axes.size() == 3) save_text(job, run.scene + ".xdmf", xdmf_of(file, run, record));
}

}  // namespace dpde::tools
