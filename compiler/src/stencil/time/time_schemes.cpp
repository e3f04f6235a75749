// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/time_schemes.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <span>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/time/implicit_schemes.h"
#include "stencil/time/projections.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

using model::StageRow;
using Tableau = std::span<const StageRow>;

/// Computes the value that a kernel stores for a state, from its rate at the stage.
using Update = std::function<Expr(const std::string& state, const Expr& rate)>;

class Stages {
 public:
  Stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix, const StepPart& part)
      : lowering_(lowering), advances_(advances), prefix_(prefix), part_(part) {}

  /// Whether neither a rate nor a constraint changes the state.
  bool is_at_rest(const Advance& advance) const {
    return is_literal(advance.rate, 0) && !(part_.is_projected && lowering_.problem().is_projected(advance.state));
  }

  /// The fields of stage `number` that replace the states.
  std::map<std::string, std::string> fields(int number) const {
    std::map<std::string, std::string> fields;
    for (const Advance& advance : advances_) {
      if (!is_at_rest(advance)) {
        fields[advance.state] = lowering_.field_beside(advance.state, std::to_string(number));
      }
    }
    return fields;
  }

  /// The stage with the rates of the states `from` after this fraction of the substep; stores its results in `into`.
  Stage stage(const std::string& name, std::map<std::string, std::string> from, double fraction,
              const std::map<std::string, std::string>& into, const Update& update) const {
    Environment reading;
    const auto others = part_.others.find(fraction);
    if (others != part_.others.end()) from.insert(others->second.begin(), others->second.end());
    reading.fields = std::move(from);
    reading.time = part_.time_at(fraction);
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(name);
    for (const Advance& advance : advances_) {
      const auto target = into.find(advance.state);
      if (target == into.end()) continue;
      const Expr value = is_at_rest(advance)
                             ? begin(advance.state)
                             : update(advance.state, at_point(advance.rate, lowering_.placement_of(advance.state)));
      kernel.stores.push_back({target->second, false, value, advance.origin});
    }
    return Lowering::stage(std::move(kernel), at_point, reading.time);
  }

  std::map<std::string, std::string> results() const {
    std::map<std::string, std::string> fields;
    for (const Advance& advance : advances_) fields[advance.state] = advance.into;
    return fields;
  }

  std::string name(int number) const { return prefix_ + "_stage" + std::to_string(number); }
  /// The value of a state at the start of the substep.
  static Expr begin(const std::string& state) { return access(state); }
  /// Length of the substep.
  Expr dt() const { return part_.of == 1 ? param("dt") : param("dt") / static_cast<double>(part_.of); }

  /// weight/over of the substep.
  Expr length(double weight, double over) const {
    const Expr step = weight == 1 ? dt() : weight * dt();
    return over == 1 ? step : step / over;
  }
  Expr time(double fraction) const { return part_.time_at(fraction); }
  Expr end() const { return time(1); }

  /// An Euler step from the start of the substep, over all of it.
  Update forward() const {
    return [dt = dt()](const std::string& state, const Expr& rate) { return begin(state) + scaled(dt, rate); };
  }

 private:
  Lowering& lowering_;
  const std::vector<Advance>& advances_;
  std::string prefix_;
  const StepPart& part_;
};

using FieldsOfStages = std::vector<FieldsOfStates>;  // empty for the first stage: the states themselves

/// The update of a state by a row of the tableau.
Update update_of(const StageRow& row, const Stages& stages, const FieldsOfStages& fields) {
  return [&](const std::string& state, const Expr& rate) {
    const auto value = [&](int stage) {
      return stage == 0 ? stages.begin(state) : access(fields[static_cast<std::size_t>(stage)].at(state));
    };
    const Expr change = scaled(stages.length(row.weight, row.over), rate);
    std::optional<Expr> sum;
    for (const auto& [more, less, weight] : row.differences) {
      if (more == less) continue;
      const Expr change_of_state = value(more) - value(less);
      const Expr difference = weight == 1 ? change_of_state : weight * change_of_state;
      sum = sum ? *sum + difference : difference;
    }
    return value(row.base) + (sum ? (row.divisor == 1 ? *sum : *sum / row.divisor) + change : change);
  };
}

struct EndOfRow {
  double time;  // of the result, in substeps
  bool is_projected;
  bool is_last = true;
};

/// The stage of a row, followed by its projection, if there is one.
std::vector<Stage> stages_of_row(Lowering& lowering, const StageRow& row, const Stages& stages,
                                 const FieldsOfStages& fields, const std::string& name, const FieldsOfStates& into,
                                 const EndOfRow& end) {
  const FieldsOfStates left = end.is_projected ? before_projection(lowering, into, end.is_last) : into;
  const FieldsOfStates& from = fields[static_cast<std::size_t>(row.from)];
  std::vector<Stage> result{stages.stage(name, from, row.time, left, update_of(row, stages, fields))};
  if (!end.is_projected) return result;
  const Expr length = stages.length(row.weight, row.over);
  std::ranges::move(
      projection_stages(lowering, {name, left, into, stages.time(end.time), length, stages.dt(), end.is_last}),
      std::back_inserter(result));
  return result;
}

/// All stages of a tableau. A single stage is called `name`. `fields` receives the fields of the stages.
std::vector<Stage> stages_of(Lowering& lowering, Tableau tableau, const Stages& stages, const std::string& name,
                             const StepPart& part, FieldsOfStages& fields) {
  fields.assign(1, {});
  for (std::size_t i = 1; i < tableau.size(); ++i) fields.push_back(stages.fields(static_cast<int>(i)));
  std::vector<Stage> result;
  for (std::size_t i = 0; i < tableau.size(); ++i) {
    const bool is_last = i + 1 == tableau.size();
    const std::string stage_name = tableau.size() == 1 ? name : stages.name(static_cast<int>(i) + 1);
    std::ranges::move(
        stages_of_row(lowering, tableau[i], stages, fields, stage_name, is_last ? stages.results() : fields[i + 1],
                      {is_last ? 1 : tableau[i + 1].time, part.is_projected, is_last}),
        std::back_inserter(result));
  }
  return result;
}

/// The sum over all cells of the mean square, over the states, of the estimated error over the tolerated error.
Kernel kernel_of_error(Lowering& lowering, const std::string& name, const FieldsOfStates& results,
                       const FieldsOfStates& embedded) {
  const model::StepControl& control = *lowering.problem().substeps.control;
  const auto magnitude = [](const std::string& field) { return call(Fn::abs, {access(field)}); };
  Expr sum = 0.0;
  for (const model::State& each : lowering.problem().states) {  // in the model's order, not that of names
    if (!embedded.contains(each.name)) continue;
    const std::string &state = each.name, &other = embedded.at(state);
    const Expr size = call(Fn::max, {magnitude(state), magnitude(results.at(state))});
    const Expr tolerated = control.absolute + control.relative * size;
    sum = sum + power((access(other) - access(results.at(state))) / tolerated, 2.0);
  }
  Kernel kernel = lowering.kernel(name);
  kernel.sums.push_back(
      {lowering.fresh_field("estimated_error"), sum / static_cast<double>(std::max<std::size_t>(embedded.size(), 1))});
  return kernel;
}

/// Positions u move by v + dt/2 F, with the acceleration at the start. Velocities, and fields with equations of first
/// order, move by the mean of their rates at both ends; the later rate is evaluated at the new positions and an Euler
/// prediction of the rest. If F does not depend on velocities, this is velocity Verlet.
std::vector<Stage> velocity_verlet(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix,
                                   const StepPart& part) {
  std::vector<Advance> first = advances, second;
  for (Advance& advance : first) {
    const model::State* velocity = lowering.problem().velocity_of(advance.state);
    if (!velocity) {
      second.push_back(advance);
      continue;
    }
    const model::Expr half = model::binary(BinaryOp::divide, model::param("dt"), 2.0 * part.of);
    for (const Advance& other : advances) {
      if (other.state != velocity->name) continue;
      advance.rate = model::binary(BinaryOp::add, advance.rate, model::binary(BinaryOp::multiply, half, other.rate));
    }
  }
  Stages begin(lowering, first, prefix, part), end(lowering, second, prefix, part);
  std::map<std::string, std::string> guesses = end.fields(1);
  const Update mean = [&](const std::string& state, const Expr& rate) {
    return (end.begin(state) + access(guesses.at(state))) / 2.0 + scaled(end.dt() / 2.0, rate);
  };
  std::map<std::string, std::string> later = guesses;
  for (const Advance& advance : first) {
    if (lowering.problem().velocity_of(advance.state)) later[advance.state] = advance.into;
  }
  return {begin.stage(begin.name(1), {}, 0, later, begin.forward()),
          end.stage(end.name(2), later, 1, end.results(), mean)};
}

}  // namespace

Expr StepPart::time(double fraction) const {
  if (of == 1) return fraction;
  const Expr number = param(counter);
  return (fraction == 0 ? number : number + fraction) / static_cast<double>(of);
}

Expr StepPart::time_at(double fraction) const {
  if (of > 1) return param("t") + time(fraction) * param("dt");
  if (fraction == 0) return param("t");
  if (fraction == 1) return param("t") + param("dt");
  return param("t") + (fraction == 0.5 ? param("dt") / 2.0 : fraction * param("dt"));
}

std::vector<Stage> time_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                               const std::string& prefix, const StepPart& part) {
  FieldsOfStages fields;
  const auto by = [&](Tableau tableau) {
    return stages_of(lowering, tableau, Stages(lowering, advances, prefix, part), name, part, fields);
  };
  const model::TimeScheme time = lowering.problem().scheme.time;
  if (!time->stages.empty()) return by(time->stages);
  if (model::is_verlet(time)) return velocity_verlet(lowering, advances, prefix, part);
  require(model::is_implicit(time), "multi-step and exponential schemes have stages of their own");
  return implicit_stages(lowering, advances, name, part.is_projected);
}

std::vector<double> stability_polynomial(model::TimeScheme time) {
  const Tableau tableau = time->stages;
  if (tableau.empty()) return {};
  std::vector<std::vector<double>> stages{std::vector<double>(tableau.size() + 1)};
  stages.front().front() = 1;
  for (const StageRow& row : tableau) {
    std::vector<double> next = stages[static_cast<std::size_t>(row.base)];
    const auto add = [&](double factor, int stage, std::size_t power) {
      const std::vector<double>& from = stages[static_cast<std::size_t>(stage)];
      for (std::size_t i = 0; i + power < next.size(); ++i) next[i + power] += factor * from[i];
    };
    for (const model::DifferenceOfStages& difference : row.differences) {
      add(difference.weight / row.divisor, difference.more, 0);
      add(-difference.weight / row.divisor, difference.less, 0);
    }
    add(row.weight / row.over, row.from, 1);
    stages.push_back(std::move(next));
  }
  return stages.back();
}

std::vector<double> stage_times(model::TimeScheme time) {
  std::vector<double> times{0, 0.5, 1};
  for (const StageRow& row : time->stages) {
    if (std::ranges::find(times, row.time) == times.end()) times.push_back(row.time);
  }
  return times;
}

std::vector<Stage> stages_with_estimate(Lowering& lowering, const std::vector<Advance>& advances,
                                        const std::string& name, const std::string& prefix) {
  const model::TimeScheme time = lowering.problem().scheme.time;
  require(model::estimates_error(time), "a pair of results");
  const StepPart part;
  const Stages stages(lowering, advances, prefix, part);
  FieldsOfStates embedded;
  for (const Advance& advance : advances) {
    const auto gives_it = [&](const model::Projection& projection) { return projection.multiplier == advance.state; };
    if (stages.is_at_rest(advance) || std::ranges::any_of(lowering.problem().projections, gives_it)) continue;
    embedded[advance.state] = lowering.field_beside(advance.state, "embedded");
  }
  std::vector<Stage> result;
  if (model::is_implicit(time)) {
    result = implicit_stages(lowering, advances, name, part.is_projected, embedded);
  } else {
    FieldsOfStages fields;
    result = stages_of(lowering, time->stages, stages, name, part, fields);
    fields.push_back(stages.results());
    std::ranges::move(stages_of_row(lowering, *time->embedded, stages, fields, prefix + "_embedded", embedded,
                                    {1, part.is_projected}),
                      std::back_inserter(result));
  }
  result.push_back({kernel_of_error(lowering, prefix + "_error", stages.results(), embedded), stages.end(), {}});
  return result;
}

}  // namespace dpde::stencil
