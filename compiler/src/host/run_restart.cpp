// SPDX-License-Identifier: Apache-2.0
#include "host/run_restart.h"

#include <fmt/format.h>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "driver/restart_file.h"

namespace dpde::host {

namespace {

namespace fs = std::filesystem;

/// What set_field() and set_control() gave is not in it: the host gives it again.
driver::RunIdentity identity_of(Simulation& simulation, const RunDescription& run, const RunRecord& record) {
  driver::RunIdentity identity = run.identity();
  std::string params;
  for (const RunNumber& param : run.params)
    params += fmt::format("{}{} = {}", params.empty() ? "" : ", ", param.name, param.value);
  driver::add_params(identity, std::move(params));
  const double begin = simulation.time() - simulation.steps_done() * simulation.time_step();
  std::uint64_t start = hash_bytes(&begin, sizeof begin);
  for (const std::string& state : simulation.states()) {
    const std::vector<double> values = simulation.initial(state);
    start = hash_bytes(values.data(), values.size() * sizeof(double), start);
  }
  identity.emplace_back("start", fmt::format("hash {:016x}", start));
  identity.emplace_back("output", record.plan());
  return identity;
}

void require(const DiagnosticSink& sink, ErrorKind kind) {
  if (sink.has_errors()) throw Error(kind, sink.all().front().message);
}

}  // namespace

void save_run(const fs::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record,
              FrameFile& frames) {
  Reached reached = simulation.reached();
  const driver::Restart restart{identity_of(simulation, run, record), reached.step, std::move(reached.states),
                                reached.controller, record.save()};
  DiagnosticSink sink;
  if (driver::save_restart(path, restart, sink)) frames.remove_others();
  require(sink, ErrorKind::machine);
}

bool resume_run(const fs::path& path, Simulation& simulation, const RunDescription& run, RunRecord& record) {
  std::error_code error;
  if (!fs::exists(path, error)) return false;
  DiagnosticSink sink;
  std::optional<driver::Restart> restart = driver::load_restart(path, identity_of(simulation, run, record), sink);
  require(sink, ErrorKind::input);
  if (!restart || !record.restore(restart->record))
    throw Error(ErrorKind::input, fmt::format("{} is damaged", path.string()));
  simulation.go_on_from({restart->step, std::move(restart->states), restart->controller});
  return true;
}

}  // namespace dpde::host
