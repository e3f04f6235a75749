// SPDX-License-Identifier: Apache-2.0
#include "driver/report/restart_file.h"

#include <fmt/format.h>

#include <cstring>

#include "dpde/runtime/bytes.h"
#include "files/files.h"
#include "model/print/print_model.h"
#include "stencil/text/print_stencil.h"

namespace dpde::driver {

namespace {

constexpr std::string_view restart_magic = "dpderst3";

std::uint64_t hash_of(std::string_view bytes) { return hash_bytes(bytes.data(), bytes.size()); }

std::uint64_t hash_of(const std::vector<double>& values, std::uint64_t hash) {
  return hash_bytes(values.data(), sizeof(double) * values.size(), hash);
}

std::string grid_text(const model::Problem& problem) {
  std::string text;
  for (const model::Axis& axis : problem.axes) {
    text += fmt::format("{}{} = {} .. {}, {} cells{}{}", text.empty() ? "" : "; ", axis.name, axis.low, axis.high,
                        axis.cells, axis.topology == Topology::periodic ? ", periodic" : "",
                        axis.stretch       ? ", stretched " + model::print(axis.stretch->map)
                        : axis.runs_down() ? ", downwards"
                                           : "");
  }
  for (std::size_t a = 0; problem.metric && a < problem.axes.size(); ++a)
    text += fmt::format("; a unit of {} is {} long", problem.axes[a].name, model::print(problem.metric->scales[a]));
  return text;
}

/// For controls, the formula: a run that continues beyond its end needs more values of it.
std::string params_text(const model::Problem& problem) {
  std::string text;
  for (const model::Parameter& param : problem.params) {
    if (const model::Control* control = problem.find_control(param.name)) {
      text += fmt::format("{}{}", text.empty() ? "" : ", ", print(*control, problem.step));
      continue;
    }
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", param.name, param.value);
  }
  for (const model::Coefficient& c : problem.coefficients) {
    if (c.is_control()) text += fmt::format("{}{}", text.empty() ? "" : ", ", print(c, problem.step));
  }
  return text;
}

/// Hash of initial states, coefficients from files, and weights of networks.
std::uint64_t hash_of_fields(Session& session) {
  std::uint64_t hash = hash_of(std::string_view());
  for (int s = 0; s < session.rollout().state_count(); ++s) hash = hash_of(session.initial(s), hash);
  for (const model::Coefficient& c : session.problem().coefficients) {
    if (!c.is_control() || !c.value.formula) hash = hash_of(session.workspace().dense(c.name), hash);
  }
  for (const auto& [network, weights] : session.workspace().weights()) hash = hash_of(weights.values, hash);
  return hash;
}

const char* name_of(Backend backend) {
  switch (backend) {
    case Backend::jit: return "jit";
    case Backend::cpp: return "cpp";
    case Backend::interpreter: return "interpreter";
  }
  return "";
}

std::string step_text(const model::Problem& problem) {
  std::string text = fmt::format("{} from t = {}", problem.step, problem.t_begin);
  if (problem.substeps.rate) text += fmt::format(", courant {}", problem.substeps.courant);
  if (const auto& control = problem.substeps.control)
    text += fmt::format(", tolerance {}, absolute {}, first {}", control->relative, control->absolute, control->first);
  return text;
}

}  // namespace

void add_params(RunIdentity& identity, std::string params) {
  // Before the entry of the back end, since fixed parameters affect programs.
  const auto programs = std::ranges::find(identity, "back end", &RunIdentity::value_type::first);
  identity.insert(programs, {"set of parameters", std::move(params)});
}

RunIdentity identity_of(Session& session) {
  RunIdentity identity = identity_of(session.compiled());
  add_params(identity, params_text(session.problem()));
  identity.emplace_back("start", fmt::format("hash {:016x}", hash_of_fields(session)));
  return identity;
}

RunIdentity identity_of(const Compiled& compiled) {
  const model::Problem& problem = *compiled.problem;
  std::string scheme = model::print(problem.scheme);
  while (scheme.ends_with('\n')) scheme.pop_back();
  const auto& backend = compiled.options.backend;
  stencil::Module programs = compiled.stencil;
  programs.loops.clear();  // they contain the number of steps, which may grow
  return {{"scene", problem.scene},
          {"grid", grid_text(problem)},
          {"step", step_text(problem)},
          {"scheme", scheme},
          {"back end", backend ? name_of(*backend) : ""},
          {"model", fmt::format("hash {:016x}", hash_of(print(programs)))}};
}

std::string sealed(std::string content) {
  const std::uint64_t checksum = hash_of(content);
  return std::move(content.append(reinterpret_cast<const char*>(&checksum), sizeof checksum));
}

std::optional<std::string_view> unsealed(std::string_view bytes) {
  std::uint64_t checksum = 0;
  if (bytes.size() < sizeof checksum) return std::nullopt;
  std::memcpy(&checksum, bytes.data() + bytes.size() - sizeof checksum, sizeof checksum);
  bytes.remove_suffix(sizeof checksum);
  return hash_of(bytes) == checksum ? std::optional(bytes) : std::nullopt;
}

bool save_restart(const std::filesystem::path& path, const Restart& restart, DiagnosticSink& sink) {
  ByteWriter out;
  out.number(static_cast<std::int64_t>(restart.identity.size()));
  for (const auto& [name, value] : restart.identity) {
    out.text(name);
    out.text(value);
  }
  out.number(restart.step);
  out.number(static_cast<std::int64_t>(restart.states.size()));
  for (const std::vector<double>& state : restart.states) out.values(state);
  const StepController& controller = restart.controller;
  out.values({controller.length, controller.error, controller.has_refused ? 1.0 : 0.0});
  out.text(restart.record);
  return files::write_file(path, sealed(std::string(restart_magic) + out.bytes()), sink);
}

std::optional<Restart> load_restart(const std::filesystem::path& path, const RunIdentity& identity,
                                    DiagnosticSink& sink) {
  const std::optional<std::string> bytes = files::read_file(path, {}, sink);
  if (!bytes) return std::nullopt;
  const auto damaged = [&] {
    sink.report("bad-array-file", {}, {path.string(), "it is no checkpoint of a run, or damaged"});
    return std::nullopt;
  };
  const std::optional<std::string_view> content = unsealed(*bytes);
  if (!content || !content->starts_with(restart_magic)) return damaged();
  ByteReader in(content->substr(restart_magic.size()));
  Restart restart;
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
    const std::string name = in.text();
    restart.identity.emplace_back(name, in.text());
  }
  restart.step = static_cast<int>(in.number());
  for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) restart.states.push_back(in.values());
  const std::vector<double> controller = in.values();
  restart.record = in.text();
  if (controller.size() != 3) return damaged();
  restart.controller = {controller[0], controller[1], controller[2] != 0};
  if (!in.is_done() || restart.identity.size() != identity.size()) return damaged();
  for (std::size_t i = 0; i < identity.size(); ++i) {
    const auto& [name, here] = identity[i];
    if (restart.identity[i] == identity[i]) continue;
    sink.report("restart-differs", {}, {path.string(), name},
                fmt::format("it has {}; here it is {}. Without --resume the run starts anew",
                            restart.identity[i].second, here));
    return std::nullopt;
  }
  return restart;
}

}  // namespace dpde::driver
