// SPDX-License-Identifier: Apache-2.0
#include "stencil/time_schemes.h"

#include <functional>
#include <map>

#include "model/build.h"
#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

bool is_at_rest(const Advance& advance) { return model::is_constant(advance.rate, 0); }

/// The value a kernel stores for a state, from its rate at the stage.
using Update = std::function<Expr(const std::string& state, const Expr& rate)>;

class Stages {
 public:
  Stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix, const StepPart& part)
      : lowering_(lowering), advances_(advances), prefix_(prefix), part_(part) {}

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
    from.insert(part_.fields.begin(), part_.fields.end());
    reading.fields = std::move(from);
    reading.time = time(fraction);
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(name);
    for (const Advance& advance : advances_) {
      const auto target = into.find(advance.state);
      if (target == into.end()) continue;
      const Expr value = is_at_rest(advance) ? begin(advance.state) : update(advance.state, at_point(advance.rate, lowering_.placement_of(advance.state)));
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
  Expr begin(const std::string& state) const {
    const auto found = part_.fields.find(state);
    return access(found == part_.fields.end() ? state : found->second);
  }
  /// How long the part is.
  Expr dt() const { return part_.of == 1 ? param("dt") : param("dt") / static_cast<double>(part_.of); }

  /// The value of the state where the part begins, and `fraction` of the part of its rate.
  Update forward(double fraction) const {
    const Expr step = fraction == 1 ? dt() : dt() / (1 / fraction);
    return [this, step](const std::string& state, const Expr& rate) { return begin(state) + scaled(step, rate); };
  }

 private:
  Expr time(double fraction) const {
    const double steps = part_.time(fraction);
    if (steps == 0) return param("t");
    return param("t") + (steps == 1 ? param("dt") : steps == 0.5 ? param("dt") / 2.0 : steps * param("dt"));
  }

  Lowering& lowering_;
  const std::vector<Advance>& advances_;
  std::string prefix_;
  const StepPart& part_;
};

std::vector<Stage> midpoint_method(Stages stages) {
  const auto u_1 = stages.fields(1);
  return {stages.stage(stages.name(1), {}, 0, u_1, stages.forward(0.5)),
          stages.stage(stages.name(2), u_1, 0.5, stages.results(), stages.forward(1))};
}

// The last stage of a scheme with several takes what the others found out of their states, not of rates that would have to be
// stored. It adds up differences of states, which are small, and a third of the sum: a third of the states themselves
// (u_1 + 2*u_2 + u_3 - u)/3 would be wrong in the last place in the same direction in each step, as 1/3 is no number of the machine.

std::vector<Stage> runge_kutta_4(Stages stages) {
  const auto u_1 = stages.fields(1), u_2 = stages.fields(2), u_3 = stages.fields(3);
  const Update last = [&](const std::string& state, const Expr& rate) {
    const Expr middle = access(u_2.at(state));
    const Expr differences = (access(u_1.at(state)) - middle) + (access(u_3.at(state)) - stages.begin(state));
    return middle + (differences / 3.0 + scaled(stages.dt() / 6.0, rate));
  };
  return {stages.stage(stages.name(1), {}, 0, u_1, stages.forward(0.5)),
          stages.stage(stages.name(2), u_1, 0.5, u_2, stages.forward(0.5)),
          stages.stage(stages.name(3), u_2, 0.5, u_3, stages.forward(1)),
          stages.stage(stages.name(4), u_3, 1, stages.results(), last)};
}

std::vector<Stage> shu_osher_3(Stages stages) {
  const auto u_1 = stages.fields(1), u_2 = stages.fields(2);
  const Update second = [&](const std::string& state, const Expr& rate) {
    const Expr begin = stages.begin(state);
    return begin + ((access(u_1.at(state)) - begin) / 4.0 + scaled(stages.dt() / 4.0, rate));
  };
  const Update last = [&](const std::string& state, const Expr& rate) {
    const Expr middle = access(u_2.at(state));
    return middle + ((stages.begin(state) - middle) / 3.0 + scaled(2.0 * stages.dt() / 3.0, rate));
  };
  return {stages.stage(stages.name(1), {}, 0, u_1, stages.forward(1)),
          stages.stage(stages.name(2), u_1, 1, u_2, second),
          stages.stage(stages.name(3), u_2, 0.5, stages.results(), last)};
}

/// Positions u move by v + dt/2 F, with the acceleration at the beginning; velocities, and fields with equations of first
/// order, by the mean of their rates at both ends, the later one taken at the new positions and a first guess of the rest.
/// Where F is free of velocities that is velocity Verlet.
std::vector<Stage> velocity_verlet(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix, const StepPart& part) {
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
  return {begin.stage(begin.name(1), {}, 0, later, begin.forward(1)),
          end.stage(end.name(2), later, 1, end.results(), mean)};
}

}  // namespace

std::vector<Stage> time_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name,
                               const std::string& prefix, const StepPart& part) {
  const Stages stages(lowering, advances, prefix, part);
  switch (lowering.problem().scheme.time) {
    case model::TimeScheme::euler: return {stages.stage(name, {}, 0, stages.results(), stages.forward(1))};
    case model::TimeScheme::rk2: return midpoint_method(stages);
    case model::TimeScheme::rk4: return runge_kutta_4(stages);
    case model::TimeScheme::ssp_rk3: return shu_osher_3(stages);
    case model::TimeScheme::verlet: return velocity_verlet(lowering, advances, prefix, part);
    case model::TimeScheme::ab2:
    case model::TimeScheme::leapfrog: break;
  }
  unreachable("time scheme");
}

}  // namespace dpde::stencil
