// SPDX-License-Identifier: Apache-2.0
// Time-stepping methods, one row each; all their properties are in that row. A new method of one of these families
// needs a row in methods.cpp and the manual's tables; tests/model/methods_test.cpp measures each row.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace dpde::model {

/// One stage of an explicit Runge-Kutta method in stage-state form. With U_0 the state where the step begins,
///   U = U_base + (sum of weight*(U_a - U_b))/divisor + dt*weight/over*F(U_from).
/// The last stage combines the stage states, so no right-hand sides need to be stored. It sums small differences of
/// states and divides the sum by 3. Dividing the states themselves, (U_1 + 2*U_2 + U_3 - U_0)/3, would give a rounding
/// error of the same sign in each step, as 1/3 is not a machine number.
struct DifferenceOfStages {
  int more = 0, less = 0;  // equal: no difference
  double weight = 1;
};
struct StageRow {
  double time;  // of U_from, in steps
  int from, base;
  double weight, over;
  double divisor = 1;
  std::array<DifferenceOfStages, 6> differences = {};
};

/// Additive (IMEX) methods: an explicit part N and an implicit part L. All stages have the same diagonal coefficient
/// `own` of L; the last stage is the result (U. M. Ascher, S. J. Ruuth and R. J. Spiteri, Applied Numerical Mathematics
/// 25 (1997)).
constexpr std::size_t most_additive_stages = 4;
using AdditiveWeight = long double;  // rounded once, after the sum
using AdditiveWeights = std::array<AdditiveWeight, most_additive_stages>;
struct AdditiveRow {
  AdditiveWeight time;             // of the stage, in steps
  AdditiveWeights of_rest;         // a_ij of N, j = 0, 1, ..., i - 1
  AdditiveWeights of_solved = {};  // b_ij of L, j = 1, 2, ..., i - 1
};
struct AdditiveTableau {
  AdditiveWeight own = 0;
  std::span<const AdditiveRow> rows = {};
  const AdditiveRow* embedded = nullptr;  // other result of an embedded pair; b_ij of all stages
};

/// Weights of an Adams-Bashforth step: of the current right-hand side, of the one of the step before, and of the one
/// before that. Order 4 would need another start: the starting Euler step leaves an error of dt^3.
using AdamsRow = std::array<double, 3>;

struct TimeMethod {
  enum class Family : unsigned char {
    runge_kutta,      // explicit: `stages`
    additive,         // `additive`: implicit in the terms of model/analyse/implicit_part.h
    trapezoidal,      // Crank-Nicolson: likewise; the whole right-hand side at both ends
    adams_bashforth,  // `rates`: of the first step, of the second, ..., of all further steps
    leapfrog,
    verlet,
    exponential  // the linear part exactly, by Fourier multipliers; of order 2 or 4 (stencil/time/exponential.cpp)
  };
  const char* name;
  Family family;
  int order;
  std::span<const StageRow> stages = {};
  const StageRow* embedded = nullptr;  // the other result of an embedded pair of `stages`
  AdditiveTableau additive = {};
  std::span<const AdamsRow> rates = {};
  int order_of_estimate = 0;  // embedded pairs: for small steps the two results differ by O(step^order)
  /// C > 0: a convex combination of Euler steps of length at most step/C (S. Gottlieb, C.-W. Shu and E. Tadmor, SIAM
  /// Review 43 (2001)).
  double ssp_coefficient = 0;
};

/// All methods, in the order of messages.
std::span<const TimeMethod> time_methods();
/// A row of time_methods(), as a scheme block selects it. Never null.
using TimeScheme = const TimeMethod*;
/// nullptr if there is none.
TimeScheme find_time_method(std::string_view name);
/// The method must exist.
TimeScheme time_method(std::string_view name);

/// Embedded pair: a second result of one order less gives an error estimate.
constexpr bool estimates_error(TimeScheme time) { return time->order_of_estimate > 0; }
/// The method stores right-hand sides of previous steps.
constexpr bool is_adams_bashforth(TimeScheme time) { return time->family == TimeMethod::Family::adams_bashforth; }
constexpr bool is_leapfrog(TimeScheme time) { return time->family == TimeMethod::Family::leapfrog; }
constexpr bool is_multistep(TimeScheme time) { return is_adams_bashforth(time) || is_leapfrog(time); }
constexpr bool is_verlet(TimeScheme time) { return time->family == TimeMethod::Family::verlet; }
constexpr bool is_exponential(TimeScheme time) { return time->family == TimeMethod::Family::exponential; }
constexpr bool is_trapezoidal(TimeScheme time) { return time->family == TimeMethod::Family::trapezoidal; }
constexpr bool is_euler(TimeScheme time) { return time->stages.size() == 1; }
/// Whether it is implicit in the terms of model/analyse/implicit_part.h.
constexpr bool is_implicit(TimeScheme time) {
  return time->family == TimeMethod::Family::additive || is_trapezoidal(time);
}
/// Whether a projection can follow each of several stages; other methods have one stage.
constexpr bool has_several_stages(TimeScheme time) { return time->stages.size() > 1 || time->additive.rows.size() > 1; }

}  // namespace dpde::model
