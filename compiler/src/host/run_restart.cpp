// SPDX-License-Identifier: Apache-2.0
#include "host/run_restart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "driver/report/restart_file.h"

namespace dpde::host {

namespace {

namespace fs = std::filesystem;

driver::RunIdentity identity_of(Simulation& simulation, const RunDescription& run, const RunRecord& record) {
  driver::RunIdentity identity = run.identity();
  std::string params;
  for (const RunNumber& param : run.params)
    params += fmt::format("{}{} = {}", params.empty() ? "" : ", ", param.name, param.value);
  driver::add_params(identity, std::move(params));
  identity.emplace_back("start", fmt::format("hash {:016x}", simulation.start_hash()));
  identity.emplace_back("output", record.plan());
  return identity;
}

bool is_finite(const Reached& reached) {
  return std::ranges::all_of(reached.states, [](const std::vector<double>& state) {
    return std::ranges::all_of(state, [](double value) { return std::isfinite(value); });
  });
}

void require(const DiagnosticSink& sink, ErrorKind kind) {
  if (sink.has_errors()) throw Error(kind, sink.all().front().message);
}

}  // namespace

bool save_run(const fs::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record,
              FrameFile& frames) {
  Reached reached = simulation.reached();
  if (!is_finite(reached)) return false;
  const driver::Restart restart{identity_of(simulation, run, record), reached.step, std::move(reached.states),
                                reached.controller, record.save()};
  DiagnosticSink sink;
  if (driver::save_restart(path, restart, sink)) frames.remove_others();
  require(sink, ErrorKind::machine);
  return true;
}

bool resume_run(const fs::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record) {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  DiagnosticSink sink;
  std::optional<driver::Restart> restart = driver::load_restart(path, identity_of(simulation, run, record), sink);
  require(sink, ErrorKind::input);
  if (restart && restart->step > run.steps)
    throw Error(ErrorKind::input, fmt::format("{} has reached step {}, this run ends at step {}", path.string(),
                                              restart->step, run.steps));
  if (!restart || !record.restore(restart->record))
    throw Error(ErrorKind::input, fmt::format("{} is damaged", path.string()));
  simulation.go_on_from({restart->step, std::move(restart->states), restart->controller});
  return true;
}

}  // namespace dpde::host
