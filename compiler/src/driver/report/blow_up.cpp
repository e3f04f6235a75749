// SPDX-License-Identifier: Apache-2.0
#include "driver/report/blow_up.h"

#include <fmt/format.h>

#include <set>

#include "model/build.h"
#include "model/uses.h"
#include "support/maths/evaluate.h"

namespace dpde::driver {

namespace {

double first_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(), session.rollout().initial(state).base());
}
double last_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(),
                           session.rollout().final_states()[static_cast<std::size_t>(state)]);
}

}  // namespace

std::vector<Growth> instabilities_of(Session& session, double suspicious) {
  std::vector<double> before;
  for (int s = 0; s < session.rollout().state_count(); ++s) before.push_back(first_magnitude(session, s));
  return growths_of(session.engine(), before, session.rollout().final_states(), session.steps(), session.end_time(),
                    suspicious);
}

void report_instabilities(Session& session, DiagnosticSink& sink, const Advice& advice) {
  const std::vector<Growth> found = instabilities_of(session);
  const std::string more = found.empty() || advice == nullptr ? "" : advice(session);
  for (const Growth& growth : found) {
    const model::State* state = session.problem().find_state(growth.state);
    sink.report("grown", state == nullptr ? SourceRange{} : state->origin.range,
                {growth.state, fmt::format("{:.3g}", growth.before), fmt::format("{:.3g}", growth.after)},
                fmt::format("the step of scene {} is {}{}{}", session.problem().scene, session.problem().step,
                            more.empty() ? "" : "; ", more));
  }
}

namespace {

/// The states that a step reads to compute `state`, directly or through other states.
std::set<std::string> read_by(const model::Problem& problem, const std::string& state) {
  std::set<std::string> found;
  std::vector<std::string> open{state};
  while (!open.empty()) {
    const std::string reader = open.back();
    open.pop_back();
    model::for_each_formula(problem, [&](const model::Use& use) {
      if (!model::makes_state(use.kind) || use.owner != reader) return;
      for (const model::State& other : problem.states) {
        if (model::reads(use.formula, other.name) && found.insert(other.name).second) open.push_back(other.name);
      }
    });
  }
  return found;
}

/// A field that overflows first may only read the one that blows up. Text "c has grown from 1 to 1e+100, and u reads
/// it; " for a field c that does not read u.
std::string grown_before(Session& session, const std::string& name) {
  constexpr double suspicious = 1e3;
  const model::Problem& problem = session.problem();
  std::string found;
  double most = suspicious;
  for (const std::string& read : read_by(problem, name)) {
    const int s = session.rollout().state_index(read);
    if (s < 0 || read_by(problem, read).contains(name)) continue;
    const double before = first_magnitude(session, s), after = last_magnitude(session, s),
                 growth = after / (before > 0 ? before : 1);
    if (!(growth > most)) continue;
    most = growth;
    found = fmt::format("{} has grown from {:.3g} to {:.3g}, and {} reads it; ", read, before, after, name);
  }
  return found;
}

}  // namespace

void report_blow_up(Session& session, const BlowUp& blow_up, DiagnosticSink& sink, const std::string& advice) {
  const std::string& name = session.rollout().state_name(blow_up.state);
  const model::State* state = session.problem().find_state(name);
  const SourceRange where = state == nullptr ? SourceRange{} : state->origin.range;
  sink.report("blow-up", where,
              {name, fmt::format("{}", blow_up.step), fmt::format("{}", session.steps()),
               fmt::format("{:.6g}", blow_up.t), session.cell_text(blow_up.cell), session.place_text(blow_up.cell)},
              fmt::format("{}the value is {}; {}", grown_before(session, name), shown(blow_up.value),
                          advice.empty()
                              ? fmt::format("a smaller step than {} may help (--set step=...)", session.problem().step)
                              : advice));
}

void report_not_steady(const Session& session, const RunResult& run, DiagnosticSink& sink) {
  if (!run.steady || run.steady->is_reached || run.blow_up) return;
  const model::Problem& problem = session.problem();
  sink.report("not-steady", problem.time_origin.range,
              {fmt::format("{}", run.steady->step), fmt::format("{:.6g}", run.steady->t), "scene " + problem.scene,
               fmt::format("{:.3g}", run.steady->change), fmt::format("{:.3g}", problem.steady)},
              "let it run longer, or take a larger tolerance; some flows never become steady");
}

}  // namespace dpde::driver
