// SPDX-License-Identifier: Apache-2.0
#include "analysis/run/conserved_sums.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>

#include "analysis/run/conservation.h"
#include "analysis/run/driven_steps.h"
#include "dpde/runtime/error.h"
#include "model/boundary/metric.h"
#include "model/scheme.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"

namespace dpde::analysis {

namespace {

constexpr int steps = 3;
constexpr int shorter = 8;              // factor of shorter steps, with as many more of them
constexpr double first_order = 0.75;    // losses by time steps must fall with their number to at least this power
constexpr double most_of_steps = 0.05;  // largest relative drift of such short steps
constexpr int most_tries = 5;           // to find steps that do not blow up
constexpr double most_growth = 4;       // of squares in such steps
constexpr double most_of_squares = 1;   // drift of squares in runs that do not blow up
constexpr double tolerance = 1e-12, single_tolerance = 1e-5;  // relative drift due to rounding
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

/// Step with the scene's Courant numbers. With the scene's own step these would be so small on few cells that losses of
/// the scheme would be below rounding.
double step_of(const model::Problem& problem, const std::vector<int>& cells) {
  double factor = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < cells.size(); ++a)
    factor = std::min(factor, static_cast<double>(problem.axes[a].cells) / cells[a]);
  return problem.step * std::max(1.0, factor);
}

/// All candidate sums, with one value for each state of the run.
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
      const std::vector<double> volumes =
          model::cell_volumes(session_.axes(), session_.problem().metric, state->placement);
      of({fmt::format("integral({})", state->name), {state->name}, false}).add(states[s], volumes);
      Integrals& square = of({fmt::format("integral({}^2)", state->name), {state->name}, true});
      square.add(squares_of(states[s]), volumes);
      squares.push_back(state->name + "^2");
      all.fields.push_back(state->name);
      total += square.values.back();
    }
    all.name = fmt::format("integral({})", fmt::join(squares, " + "));
    if (squares.size() > 1) add_number(of(all), total);
    for (const auto& [name, value] : session_.observe(t, fields)) add_number(of({name, {}, false}), value);
  }

  /// Relative drifts by name, for sums with a magnitude.
  std::map<std::string, double> drifts() const {
    std::map<std::string, double> drifts;
    for (const auto& [name, candidate] : candidates_) {
      const Integrals& values = candidate.second;
      if (values.magnitude > 0 && std::isfinite(values.magnitude)) drifts[name] = values.relative_drift();
    }
    return drifts;
  }
  /// Factor by which the fastest growing square has grown since the first state.
  double growth() const {
    double largest = 0;
    for (const auto& [name, candidate] : candidates_) {
      const std::vector<double>& values = candidate.second.values;
      if (candidate.first.of_squares) largest = std::max(largest, values.back() / values.front());
    }
    return largest;
  }
  const ConservedSum& sum(const std::string& name) const { return candidates_.at(name).first; }

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

using States = std::vector<std::vector<double>>;

/// Start of a run, with constant values of its controls.
struct Start {
  States states;
  double t = 0;
  std::map<std::string, double> controls = {};
};

/// States with values from 0.7 to 1.3.
Start random_start(driver::Session& session) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(0.7, 1.3);
  Start start{States(static_cast<std::size_t>(session.rollout().state_count())), session.problem().t_begin};
  for (std::vector<double>& values : start.states) {
    values.resize(session.workspace().cell_count());
    for (double& v : values) v = noise(random);
  }
  return start;
}

/// Sums before and after `count` steps; nullopt if the run is not possible.
std::optional<Candidates> sums_of_run(driver::Session& session, const Start& start, double step, int count) {
  RolloutSetup setup = session.engine().setup();
  setup.steps = count;
  setup.trial = nullptr;
  setup.dt = step;
  setup.t0 = start.t;
  Rollout rollout(std::move(setup));
  session.engine().begin_other(rollout);
  for (const auto& [name, value] : start.controls) rollout.set_control(name, 1, std::span(&value, 1));
  States states = start.states;
  std::vector<void*> fields;
  for (int s = 0; s < rollout.state_count(); ++s) {
    rollout.initial(s).copy_in(states[static_cast<std::size_t>(s)]);
    fields.push_back(rollout.initial(s).base());
  }
  Candidates sums(session);
  try {
    sums.look(start.t, states, fields);
    const RunResult done = rollout.run();
    if (done.blow_up || done.stopped) return std::nullopt;
    for (std::size_t s = 0; s < states.size(); ++s)
      copy_out(session.workspace().layout(), rollout.final_states()[s], states[s]);
    sums.look(start.t + count * step, states, rollout.final_states());
  } catch (const Error& error) {  // a solve fails for made-up values or so few cells
    if (error.kind() != ErrorKind::run) throw;
    return std::nullopt;
  }
  return sums;
}

using Drifts = std::map<std::string, double>;

/// Empty if the run is not possible.
Drifts drifts_of(const std::optional<Candidates>& sums) { return sums ? sums->drifts() : Drifts{}; }
Drifts drifts_of_run(driver::Session& session, const Start& start, double step, int count) {
  return drifts_of(sums_of_run(session, start, step, count));
}

/// Random states on few cells may blow up with a step that suits the scene's own state; then any drift would count as
/// rounding. If necessary, shortens `step` until the run is bounded; returns the sums of that run.
std::optional<Candidates> sums_of_bounded_run(driver::Session& session, const Start& start, double& step) {
  for (int tries = 0;; ++tries) {
    std::optional<Candidates> sums = sums_of_run(session, start, step, steps);
    if ((sums && sums->growth() <= most_growth) || tries == most_tries) return sums;
    step /= shorter;
  }
}

/// For squares with longer steps: the drift exceeds rounding, but not the largest loss of time steps.
bool is_lost(double drift, double rounding) { return drift > 100 * rounding && drift <= most_of_steps; }

/// Whether a drift comes only from the time steps: eight times as many steps must leave an eighth or less. Required
/// twice.
bool is_less_by_steps(double by_shorter, double drift) {
  return by_shorter <= most_of_steps && by_shorter <= std::pow(shorter, -first_order) * drift;
}

/// Drifts that are computed on first use.
class LazyDrifts {
 public:
  explicit LazyDrifts(std::function<Drifts()> make) : make_(std::move(make)) {}
  const Drifts& operator()() {
    if (!made_) made_ = make_();
    return *made_;
  }

 private:
  std::function<Drifts()> make_;
  std::optional<Drifts> made_;
};

/// The scene's cells, limited to some thousands.
std::vector<int> own_cells(const model::Problem& problem) {
  constexpr int most_along[] = {4096, 96, 20};
  std::vector<int> cells;
  for (const model::Axis& axis : problem.axes)
    cells.push_back(std::min(axis.cells, most_along[problem.axes.size() - 1]));
  return cells;
}

/// Sets the history of a multistep scheme, which is unknown: time derivatives of 0, which do not change a sum, and past
/// states equal to the present one.
void forget(driver::Session& session, Start& start) {
  const model::Problem& problem = session.problem();
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const model::State* state = problem.find_state(session.rollout().state_name(s));
    if (state == nullptr || state->history_of.empty()) continue;
    std::vector<double>& values = start.states[static_cast<std::size_t>(s)];
    const int of = session.rollout().state_index(state->history_of);
    if (model::is_adams_bashforth(problem.scheme.time) || of < 0) {
      std::ranges::fill(values, 0.0);
    } else {
      values = start.states[static_cast<std::size_t>(of)];
    }
  }
}

/// Starts: the scene's state with ten per cent noise, at some times of the run with the controls there; at times where
/// conditions on t change or values of t are largest; and with the smallest and largest values of controls.
std::vector<Start> starts_of(driver::Session& session) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> noise(-0.1, 0.1);
  Start first;
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    std::vector<double> values = session.initial(s);
    double scale = 0;
    for (const double v : values) scale = std::max(scale, std::abs(v));
    for (double& v : values) v += (scale > 0 ? scale : 1) * noise(random);
    first.states.push_back(std::move(values));
  }
  const model::Problem& problem = session.problem();
  // Later steps of multistep schemes need past states, which are unknown.
  const bool has_memory = !std::ranges::all_of(problem.states, &std::string::empty, &model::State::history_of);
  std::vector<Start> starts;
  const auto add = [&](int step) {
    starts.push_back(first);
    starts.back().t = problem.t_begin + step * problem.step;
    for (const auto& [name, control] : session.workspace().controls())
      starts.back().controls[name] = control.values[control_interval(step, control.every, control.values.size())];
    if (has_memory && step > 0) forget(session, starts.back());
  };
  for (const double part : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    if (has_memory && part > 0) break;
    add(static_cast<int>(part * std::max(0, problem.steps - steps)));
  }
  for (const int step : driven_steps(problem)) add(std::min(step, std::max(0, problem.steps - 1)));
  for (const bool is_low : {true, false}) {
    if (session.workspace().controls().empty()) break;
    starts.push_back(starts.front());
    for (const auto& [name, control] : session.workspace().controls())
      starts.back().controls[name] = is_low ? std::ranges::min(control.values) : std::ranges::max(control.values);
  }
  return starts;
}

/// Removes sums that the scene's own steps change: random states on few cells may miss a mask, a threshold or a late
/// source. Sums for which shorter steps lose less are marked but_for_steps.
void take_out_changed(driver::Session& session, double rounding, std::vector<ConservedSum>& found) {
  for (const Start& start : starts_of(session)) {
    double step = session.problem().step;
    const Drifts now = drifts_of(sums_of_bounded_run(session, start, step));
    const auto is_beyond = [&](const ConservedSum& sum, const Drifts& by_steps) {
      return by_steps.contains(sum.name) && by_steps.at(sum.name) > 10 * rounding;
    };
    if (std::ranges::none_of(found, [&](const ConservedSum& sum) { return is_beyond(sum, now); })) continue;
    const Drifts by_shorter = drifts_of_run(session, start, step / shorter, steps * shorter);
    const double less = std::pow(shorter, -first_order);
    std::erase_if(found, [&](ConservedSum& sum) {
      if (!is_beyond(sum, now)) return false;
      sum.but_for_steps = true;
      return is_beyond(sum, by_shorter) && by_shorter.at(sum.name) > less * now.at(sum.name);
    });
  }
}

/// Numbers in the step's formulas, and parameters. States that switch a source (by a condition, max, tanh or exp) are
/// near one of them, its square or its root.
std::vector<double> numbers_of_steps(const driver::Compiled& compiled) {
  const stencil::Program* step = compiled.stencil.find_program(compiled.step_name());
  std::set<double> numbers;
  const auto add = [&](double value) {
    if (value != 0 && std::isfinite(value))
      numbers.insert({std::abs(value), value * value, std::sqrt(std::abs(value))});
  };
  const auto look = [&](const stencil::Expr& e) {
    if (const auto* literal = as<Literal>(e)) add(literal->value);
    const auto* param = as<stencil::Param>(e);
    const model::Parameter* known = param == nullptr ? nullptr : compiled.problem->find_param(param->name);
    if (known != nullptr) add(known->value);
  };
  for (const std::string& name : stencil::parts_of({*step}).kernels) visit(*compiled.stencil.find_kernel(name), look);
  return {numbers.begin(), numbers.end()};
}

/// Random states near the numbers, at relative distances from 1e-4 to a third; some are negative if `of_both_signs`.
States states_near(const driver::Session& session, std::size_t count, const std::vector<double>& numbers,
                   bool of_both_signs, std::mt19937_64& random) {
  std::uniform_real_distribution<double> exponent(-4, -0.5), part_of_one;
  std::uniform_int_distribution<std::size_t> which(0, numbers.size() - 1);
  States states(count, std::vector<double>(session.workspace().cell_count()));
  for (std::vector<double>& values : states) {
    for (double& v : values) {
      const double away = std::pow(10.0, exponent(random)) * (part_of_one(random) < 0.5 ? -1 : 1);
      v = numbers[which(random)] * (1 + away) * (of_both_signs && part_of_one(random) < 0.25 ? -1 : 1);
    }
  }
  return states;
}

/// Marks sums that steps from states other than the run's change. Not for sums that time steps lose.
void mark_switched(driver::Session& session, double rounding, std::vector<ConservedSum>& found) {
  constexpr int tries = 8;
  const std::vector<double> numbers = numbers_of_steps(session.compiled());
  const auto is_asked = [](const ConservedSum& sum) { return !sum.but_for_steps && !sum.until_switched; };
  const Start first = starts_of(session).front();
  std::mt19937_64 random(seed);
  for (int i = 0; i < tries && !numbers.empty() && std::ranges::any_of(found, is_asked); ++i) {
    Start start = first;
    start.states = states_near(session, start.states.size(), numbers, i % 2 == 1, random);
    forget(session, start);
    double step = session.problem().step;
    const std::optional<Candidates> sums = sums_of_bounded_run(session, start, step);
    if (!sums || !(sums->growth() <= most_growth)) continue;
    const Drifts now = sums->drifts();
    for (ConservedSum& sum : found) {
      if (is_asked(sum) && now.contains(sum.name) && now.at(sum.name) > 100 * rounding) sum.until_switched = true;
    }
  }
}

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
  const Start start = random_start(*session);
  double step = step_of(*compiled->problem, options.cells);
  const std::optional<Candidates> sums = sums_of_bounded_run(*session, start, step);
  if (!sums) return std::nullopt;
  const double rounding = compiled->real() == Precision::f64 ? tolerance : single_tolerance;
  const auto drifts = [&](double length, int count) { return drifts_of_run(*session, start, length * step, count); };
  constexpr int shortest = shorter * shorter;
  // Computed on first use: long interpreted runs take seconds.
  LazyDrifts by_shorter([&] { return drifts(1.0 / shorter, steps * shorter); }),
      by_shortest([&] { return drifts(1.0 / shortest, steps * shortest); }),
      by_longer([&] { return drifts(shorter, steps); }), by_longest([&] { return drifts(shortest, steps); });
  // Sums other than squares may drift by rounding if longer steps blow up.
  const auto is_bounded = [&](const Drifts& longer) {
    return std::ranges::all_of(longer, [&](const auto& entry) {
      return !sums->sum(entry.first).of_squares || entry.second <= most_of_squares;
    });
  };
  const auto is_lost_by = [&](const Drifts& longer, const std::string& name) {
    return (sums->sum(name).of_squares || is_bounded(longer)) && longer.contains(name) &&
           is_lost(longer.at(name), rounding);
  };
  const auto falls = [&](const std::string& name, double drift) {
    const Drifts& shorter_steps = by_shorter();
    return shorter_steps.contains(name) && is_less_by_steps(shorter_steps.at(name), drift) &&
           by_shortest().contains(name) &&
           is_less_by_steps(std::max(0.0, by_shortest().at(name) - rounding), shorter_steps.at(name));
  };
  std::vector<ConservedSum> found;
  for (const auto& [name, drift] : sums->drifts()) {
    const bool is_kept = drift <= rounding;
    if (!is_kept && !falls(name, drift)) continue;
    found.push_back(sums->sum(name));
    found.back().but_for_steps = !is_kept || is_lost_by(by_longer(), name) || is_lost_by(by_longest(), name);
  }
  if (found.empty()) return found;
  options.cells = own_cells(*compiled->problem);
  if (const auto own = driver::Session::open(source, compiled, options, sink)) {
    take_out_changed(*own, rounding, found);
    mark_switched(*own, rounding, found);
  }
  return found;
}

}  // namespace dpde::analysis
