// SPDX-License-Identifier: Apache-2.0
// Methods that step in time, a row each: what anybody asks of one is in its row. Who adds a method of one of these
// families adds a row to methods.cpp, a row to the table of schemes.md and a case to tests/model/methods_test.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace dpde::model {

/// One stage of an explicit Runge-Kutta method in stage-state form. With U_0 the state where the step begins,
///   U = U_base + (sum of weight*(U_a - U_b))/divisor + dt*weight/over*F(U_from).
/// A last stage takes what the others found out of their states, not of rates that would have to be stored. It adds up
/// differences of states, which are small, and a third of the sum: a third of the states themselves,
/// (U_1 + 2*U_2 + U_3 - U_0)/3, would be wrong in the last place in the same direction in each step, as 1/3 is no
/// number of the machine.
struct DifferenceOfStages {
  int more = 0, less = 0;  // the same: none
  double weight = 1;
};
struct StageRow {
  double time;  // of U_from, in steps
  int from, base;
  double weight, over;
  double divisor = 1;
  std::array<DifferenceOfStages, 6> differences = {};
};

/// Additive methods of an explicit part N and a part L that is solved for, with the same coefficient `own` on the
/// diagonal of L in all stages, the last of which is the result (U. M. Ascher, S. J. Ruuth and R. J. Spiteri, Applied
/// Numerical Mathematics 25 (1997)).
constexpr std::size_t most_additive_stages = 4;
using AdditiveWeight = long double;  // rounded once, when all is added up
using AdditiveWeights = std::array<AdditiveWeight, most_additive_stages>;
struct AdditiveRow {
  AdditiveWeight time;             // of the stage, in steps
  AdditiveWeights of_rest;         // a_ij of N, j = 0, 1, ..., i - 1
  AdditiveWeights of_solved = {};  // b_ij of L, j = 1, 2, ..., i - 1
};
struct AdditiveTableau {
  AdditiveWeight own = 0;
  std::span<const AdditiveRow> rows = {};
  const AdditiveRow* embedded = nullptr;  // of a pair's other result; b_ij of all stages
};

/// Weights of the rates of one step of an Adams-Bashforth method: of its own, of the step before, and of that before.
/// Methods of order 4 would need another start: that of a step of Euler's leaves an error of dt^3.
using AdamsRow = std::array<double, 3>;

struct TimeMethod {
  enum class Family : unsigned char {
    runge_kutta,      // explicit: `stages`
    additive,         // `additive`: it solves for the terms of model/analyse/implicit_part.h
    trapezoidal,      // Crank-Nicolson: likewise, with all of the right side at both ends
    adams_bashforth,  // `rates`: of the first step, of the second, ..., of all behind these
    leapfrog,
    verlet,
    exponential  // the linear part without error, as multipliers of waves; of order 2 or 4
                 // (stencil/time/exponential.cpp)
  };
  const char* name;
  Family family;
  int order;
  std::span<const StageRow> stages = {};
  const StageRow* embedded = nullptr;  // of a pair of `stages`, its other result
  AdditiveTableau additive = {};
  std::span<const AdamsRow> rates = {};
  int order_of_estimate = 0;      // of pairs: the results differ by step^order for small steps
  bool is_made_of_euler = false;  // convex combinations of Euler steps, none longer than its own
};

/// All of them, in the order in which messages list them.
std::span<const TimeMethod> time_methods();
/// A row of time_methods(); what scheme blocks hold. Never null.
using TimeScheme = const TimeMethod*;
/// nullptr where there is none.
TimeScheme find_time_method(std::string_view name);
/// One that is known to be there.
TimeScheme time_method(std::string_view name);

/// An embedded pair: it also makes a result of one order less, and the difference is an estimate of its error.
constexpr bool estimates_error(TimeScheme time) { return time->order_of_estimate > 0; }
/// It remembers the rates of the steps before.
constexpr bool is_adams_bashforth(TimeScheme time) { return time->family == TimeMethod::Family::adams_bashforth; }
constexpr bool is_leapfrog(TimeScheme time) { return time->family == TimeMethod::Family::leapfrog; }
constexpr bool is_multistep(TimeScheme time) { return is_adams_bashforth(time) || is_leapfrog(time); }
constexpr bool is_verlet(TimeScheme time) { return time->family == TimeMethod::Family::verlet; }
constexpr bool is_exponential(TimeScheme time) { return time->family == TimeMethod::Family::exponential; }
constexpr bool is_trapezoidal(TimeScheme time) { return time->family == TimeMethod::Family::trapezoidal; }
constexpr bool is_euler(TimeScheme time) { return time->stages.size() == 1; }
/// It solves for the terms of model/analyse/implicit_part.h.
constexpr bool is_implicit(TimeScheme time) {
  return time->family == TimeMethod::Family::additive || is_trapezoidal(time);
}
/// Several stages, each of which a projection can follow; a step of the others has one.
constexpr bool has_several_stages(TimeScheme time) { return time->stages.size() > 1 || time->additive.rows.size() > 1; }

}  // namespace dpde::model
