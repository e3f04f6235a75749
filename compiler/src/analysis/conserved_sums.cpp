// SPDX-License-Identifier: Apache-2.0
#include "analysis/conserved_sums.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "analysis/conservation.h"
#include "dpde/runtime/error.h"

namespace dpde::analysis {

namespace {

constexpr int steps = 3;
constexpr double tolerance = 1e-12, single_tolerance = 1e-5;  // relative drift that rounding may make
constexpr std::uint64_t seed = 20261124;

std::vector<int> few_cells(const driver::Compiled& compiled) {
  constexpr int cells[3][3] = {{9}, {7, 6}, {6, 5, 4}};
  const std::size_t rank = compiled.problem->axes.size();
  return {cells[rank - 1], cells[rank - 1] + rank};
}

std::vector<double> squares_of(std::vector<double> values) {
  for (double& v : values) v *= v;
  return values;
}

/// With the scene's own step: its Courant numbers would be so small on few cells that what the scheme loses could not
/// be told from rounding.
double step_of(const model::Problem& problem, const std::vector<int>& cells) {
  double factor = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < cells.size(); ++a)
    factor = std::min(factor, static_cast<double>(problem.axes[a].cells) / cells[a]);
  return problem.step * std::max(1.0, factor);
}

/// All sums that there are, one value a state of the run.
class Candidates {
 public:
  explicit Candidates(driver::Session& session) : session_(session) {}

  void look(double t, const std::vector<std::vector<double>>& states, const std::vector<void*>& fields) {
    ConservedSum all{"", {}, true};
    std::vector<std::string> squares;
    double total = 0;
    for (std::size_t s = 0; s < states.size(); ++s) {
      const model::State* state = session_.problem().find_state(session_.rollout().state_name(static_cast<int>(s)));
      if (state == nullptr || !state->history_of.empty()) continue;
      of({fmt::format("integral({})", state->name), {state->name}, false})
          .add(states[s], session_.axes(), state->placement);
      Integrals& square = of({fmt::format("integral({}^2)", state->name), {state->name}, true});
      square.add(squares_of(states[s]), session_.axes(), state->placement);
      squares.push_back(state->name + "^2");
      all.fields.push_back(state->name);
      total += square.values.back();
    }
    all.name = fmt::format("integral({})", fmt::join(squares, " + "));
    if (squares.size() > 1) add_number(of(all), total);
    for (const auto& [name, value] : session_.observe(t, fields)) add_number(of({name, {}, false}), value);
  }

  std::vector<ConservedSum> conserved(double largest_drift) const {
    std::vector<ConservedSum> found;
    for (const auto& [name, candidate] : candidates_) {
      const auto& [sum, values] = candidate;
      if (values.magnitude > 0 && std::isfinite(values.magnitude) && values.relative_drift() <= largest_drift)
        found.push_back(sum);
    }
    return found;
  }

 private:
  Integrals& of(const ConservedSum& sum) {
    return candidates_.try_emplace(sum.name, sum, Integrals{}).first->second.second;
  }

  static void add_number(Integrals& values, double value) {
    values.values.push_back(value);
    values.magnitude = std::max(values.magnitude, std::abs(value));
  }

  driver::Session& session_;
  std::map<std::string, std::pair<ConservedSum, Integrals>> candidates_;  // by name
};

}  // namespace

std::optional<std::vector<ConservedSum>> conserved_sums(const SourceFile& source,
                                                        const std::shared_ptr<const driver::Compiled>& compiled) {
  if (!compiled->problem || !compiled->problem->networks.empty()) return std::nullopt;
  driver::SessionOptions options;
  options.cells = few_cells(*compiled);
  options.steps = steps;
  options.made_up = true;
  DiagnosticSink sink;
  const std::unique_ptr<driver::Session> session = driver::Session::open(source, compiled, options, sink);
  if (session == nullptr) return std::nullopt;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(0.7, 1.3);
  RolloutSetup setup = session->engine().setup();
  setup.steps = steps;
  setup.trial = nullptr;
  setup.dt = step_of(*compiled->problem, options.cells);
  const double step = setup.dt;
  Rollout rollout(std::move(setup));
  session->engine().begin_other(rollout);
  std::vector<std::vector<double>> states;
  std::vector<void*> fields;
  for (int s = 0; s < rollout.state_count(); ++s) {
    std::vector<double> values(session->workspace().cell_count());
    for (double& v : values) v = noise(random);
    rollout.initial(s).copy_in(values);
    states.push_back(std::move(values));
    fields.push_back(rollout.initial(s).base());
  }
  Candidates sums(*session);
  sums.look(session->problem().t_begin, states, fields);
  const auto has_run = [&] {
    try {
      const RunResult done = rollout.run();
      return !done.blow_up && !done.stopped;
    } catch (const NoSolution&) {  // for values that are made up
      return false;
    }
  };
  if (!has_run()) return std::nullopt;
  for (std::size_t s = 0; s < states.size(); ++s)
    copy_out(session->workspace().layout(), rollout.final_states()[s], states[s]);
  sums.look(session->problem().t_begin + steps * step, states, rollout.final_states());
  return sums.conserved(compiled->real() == Precision::f64 ? tolerance : single_tolerance);
}

}  // namespace dpde::analysis
