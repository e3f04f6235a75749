// SPDX-License-Identifier: Apache-2.0
#include "stencil/time_schemes.h"

#include <algorithm>
#include <array>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <span>

#include "model/build.h"
#include "stencil/build.h"
#include "stencil/implicit_schemes.h"
#include "stencil/projections.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

/// One stage of an explicit Runge-Kutta method in stage-state form. With U_0 the state where the step begins,
///   U = U_base + (sum of U_a - U_b)/divisor + dt*weight/over*F(U_from).
/// A last stage takes what the others found out of their states, not of rates that would have to be stored. It adds up
/// differences of states, which are small, and a third of the sum: a third of the states themselves,
/// (U_1 + 2*U_2 + U_3 - U_0)/3, would be wrong in the last place in the same direction in each step, as 1/3 is no
/// number of the machine.
struct StageRow {
  double time;  // of U_from, in steps
  int from, base;
  double weight, over;
  double divisor = 1;
  std::array<std::array<int, 2>, 2> differences = {};  // {0, 0}: none
};
using Tableau = std::span<const StageRow>;

constexpr StageRow euler[] = {{0, 0, 0, 1, 1}};
constexpr StageRow midpoint_rule[] = {{0, 0, 0, 1, 2}, {0.5, 1, 0, 1, 1}};
/// Kutta 1901: U_4 = (U_1 + 2*U_2 + U_3 - U_0)/3 + dt/6*F(U_3).
constexpr StageRow runge_kutta_4[] = {
    {0, 0, 0, 1, 2}, {0.5, 1, 0, 1, 2}, {0.5, 2, 0, 1, 1}, {1, 3, 2, 1, 6, 3, {{{1, 2}, {3, 0}}}}};
/// Shu and Osher 1988: U_2 = 3/4*U_0 + (U_1 + dt*F(U_1))/4, U_3 = U_0/3 + 2/3*(U_2 + dt*F(U_2)).
constexpr StageRow shu_osher_3[] = {{0, 0, 0, 1, 1}, {1, 1, 0, 1, 4, 4, {{{1, 0}}}}, {0.5, 2, 2, 2, 3, 3, {{{0, 2}}}}};

/// The value a kernel stores for a state, from its rate at the stage.
using Update = std::function<Expr(const std::string& state, const Expr& rate)>;

class Stages {
 public:
  Stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix, const StepPart& part)
      : lowering_(lowering), advances_(advances), prefix_(prefix), part_(part) {}

  /// Neither a rate nor a constraint changes it.
  bool is_at_rest(const Advance& advance) const {
    return model::is_constant(advance.rate, 0) &&
           !(part_.is_projected && lowering_.problem().is_projected(advance.state));
  }

  /// The fields of stage `number`, in the place of the states.
  std::map<std::string, std::string> fields(int number) {
    std::map<std::string, std::string> fields;
    for (const Advance& advance : advances_) {
      if (!is_at_rest(advance)) {
        fields[advance.state] = lowering_.field_beside(advance.state, std::to_string(number));
      }
    }
    return fields;
  }

  /// Rates of the states `from` when this fraction of the part is over; results go to `into`.
  Stage stage(const std::string& name, std::map<std::string, std::string> from, double fraction,
              const std::map<std::string, std::string>& into, const Update& update) const {
    Reading reading;
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
  /// The value of a state where the part begins.
  static Expr begin(const std::string& state) { return access(state); }
  /// How long the part is.
  Expr dt() const { return part_.of == 1 ? param("dt") : param("dt") / static_cast<double>(part_.of); }

  /// weight/over of that.
  Expr length(double weight, double over) const {
    const Expr step = weight == 1 ? dt() : weight * dt();
    return over == 1 ? step : step / over;
  }
  Expr time(double fraction) const { return part_.time_at(fraction); }

  /// The value of the state where the part begins, and all of the part with its rate.
  Update forward() const {
    return [dt = dt()](const std::string& state, const Expr& rate) { return begin(state) + scaled(dt, rate); };
  }

 private:
  Lowering& lowering_;
  const std::vector<Advance>& advances_;
  std::string prefix_;
  const StepPart& part_;
};

/// A single stage is called `name`.
std::vector<Stage> stages_of(Lowering& lowering, Tableau tableau, Stages stages, const std::string& name,
                             const StepPart& part) {
  std::vector<std::map<std::string, std::string>> fields(
      1);  // of each stage; those of the first one stand for themselves
  for (std::size_t i = 1; i < tableau.size(); ++i) fields.push_back(stages.fields(static_cast<int>(i)));
  std::vector<Stage> result;
  for (std::size_t i = 0; i < tableau.size(); ++i) {
    const StageRow& row = tableau[i];
    const Update update = [&](const std::string& state, const Expr& rate) {
      const auto value = [&](int stage) {
        return stage == 0 ? stages.begin(state) : access(fields[static_cast<std::size_t>(stage)].at(state));
      };
      const Expr change = scaled(stages.length(row.weight, row.over), rate);
      std::optional<Expr> sum;
      for (const auto& [more, less] : row.differences) {
        if (more == less) continue;
        const Expr difference = value(more) - value(less);
        sum = sum ? *sum + difference : difference;
      }
      return value(row.base) + (sum ? *sum / row.divisor + change : change);
    };
    const bool is_last = i + 1 == tableau.size();
    const std::string stage_name = tableau.size() == 1 ? name : stages.name(static_cast<int>(i) + 1);
    const FieldsOfStates into = is_last ? stages.results() : fields[i + 1];
    const FieldsOfStates left = part.is_projected ? before_projection(lowering, into) : into;
    result.push_back(stages.stage(stage_name, fields[static_cast<std::size_t>(row.from)], row.time, left, update));
    if (!part.is_projected) continue;
    const Expr end = stages.time(is_last ? 1 : tableau[i + 1].time), length = stages.length(row.weight, row.over);
    std::ranges::move(projection_stages(lowering, {stage_name, left, into, end, length}), std::back_inserter(result));
  }
  return result;
}

/// Positions u move by v + dt/2 F, with the acceleration at the beginning; velocities, and fields with equations of
/// first order, by the mean of their rates at both ends, the later one taken at the new positions and a first guess of
/// the rest. Where F is free of velocities that is velocity Verlet.
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
  return param("t") + (fraction == 1 ? param("dt") : param("dt") / 2.0);
}

std::vector<Stage> time_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                               const std::string& prefix, const StepPart& part) {
  const auto by = [&](Tableau tableau) {
    return stages_of(lowering, tableau, Stages(lowering, advances, prefix, part), name, part);
  };
  switch (lowering.problem().scheme.time) {
    case model::TimeScheme::euler: return by(euler);
    case model::TimeScheme::rk2: return by(midpoint_rule);
    case model::TimeScheme::rk4: return by(runge_kutta_4);
    case model::TimeScheme::ssp_rk3: return by(shu_osher_3);
    case model::TimeScheme::verlet: return velocity_verlet(lowering, advances, prefix, part);
    case model::TimeScheme::ab2:
    case model::TimeScheme::ab3:
    case model::TimeScheme::leapfrog: break;
    case model::TimeScheme::etdrk2:
    case model::TimeScheme::etdrk4: break;
    case model::TimeScheme::backward_euler:
    case model::TimeScheme::crank_nicolson:
    case model::TimeScheme::imex_euler:
    case model::TimeScheme::ars222:
    case model::TimeScheme::ars443: return implicit_stages(lowering, advances, name, part.is_projected);
  }
  unreachable("time scheme");
}

}  // namespace dpde::stencil
