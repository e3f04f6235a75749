// SPDX-License-Identifier: Apache-2.0
#include "driver/blow_up.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "model/build.h"
#include "model/uses.h"
#include "support/evaluate.h"

namespace dpde::driver {

namespace {

constexpr double never_right = 1e50;  // times what a field began with: nothing of the world grows by so much

/// Of the interior; nothing of the size of the field is made.
double largest_magnitude(const dpde_layout& layout, const void* base) {
  double largest = 0;
  const auto look = [&](const auto* values) {
    for (std::int64_t z = 0; z < layout.cells[2]; ++z) {
      for (std::int64_t y = 0; y < layout.cells[1]; ++y) {
        const auto* row = values + index_of(layout, 0, y, z);
        for (std::int64_t x = 0; x < layout.cells[0]; ++x)
          largest = std::max(largest, std::abs(static_cast<double>(row[x])));
      }
    }
  };
  layout.real == DPDE_F32 ? look(static_cast<const float*>(base)) : look(static_cast<const double*>(base));
  return largest;
}

double first_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(), session.rollout().initial(state).base());
}
double last_magnitude(Session& session, int state) {
  return largest_magnitude(session.workspace().layout(),
                           session.rollout().final_states()[static_cast<std::size_t>(state)]);
}

/// The largest magnitudes of the states one step behind the end of the run; infinite where they are no longer finite.
std::vector<double> one_step_further(Session& session) {
  RolloutSetup setup = session.engine().setup();
  setup.steps = 1;
  setup.t0 = session.end_time();
  Rollout further(std::move(setup));
  session.engine().begin_other(further);
  for (int s = 0; s < further.state_count(); ++s) further.initial(s).copy_in(session.final_state(s));
  const bool ends = further.run().blow_up.has_value();
  std::vector<double> result;
  for (int s = 0; s < further.state_count(); ++s) {
    const void* const last = further.final_states()[static_cast<std::size_t>(s)];
    result.push_back(ends ? std::numeric_limits<double>::infinity()
                          : largest_magnitude(session.workspace().layout(), last));
  }
  return result;
}

}  // namespace

std::vector<Instability> instabilities_of(Session& session, double suspicious) {
  std::vector<Instability> result;
  std::vector<double> further;
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const Instability growth{session.rollout().state_name(s), first_magnitude(session, s), last_magnitude(session, s)};
    if (growth.before == 0 || growth.after <= suspicious * growth.before) continue;
    if (growth.after > never_right * growth.before) {
      result.push_back(growth);
      continue;
    }
    if (further.empty()) further = one_step_further(session);
    // What is unstable grows by the same factor in each step; what began with next to nothing, and other fields drive,
    // does not.
    const double again = std::log(further[static_cast<std::size_t>(s)] / growth.after) * session.steps();
    if (again >= 0.5 * std::log(growth.after / growth.before)) result.push_back(growth);
  }
  return result;
}

void report_instabilities(Session& session, DiagnosticSink& sink, const Advice& advice) {
  const std::vector<Instability> found = instabilities_of(session);
  const std::string more = found.empty() || advice == nullptr ? "" : advice(session);
  for (const Instability& growth : found) {
    const model::State* state = session.problem().find_state(growth.state);
    sink.report("grown", state == nullptr ? SourceRange{} : state->origin.range,
                {growth.state, fmt::format("{:.3g}", growth.before), fmt::format("{:.3g}", growth.after)},
                fmt::format("the step of scene {} is {}{}{}", session.problem().scene, session.problem().step,
                            more.empty() ? "" : "; ", more));
  }
}

namespace {

/// The states that a step makes `state` of, and those that these are made of.
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

/// What overflows first may only read what blows up: "c has grown from 1 to 1e+100, and u reads it; ", of a field that
/// does not read u.
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
