// SPDX-License-Identifier: Apache-2.0
// The words all levels share: operators, functions, kinds of axes and of boundaries, precisions.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace dpde {

enum class BinaryOp {
  add,
  subtract,
  multiply,
  divide,
  power,
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  logical_and,
  logical_or
};
enum class Fn {
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  sinh,
  cosh,
  tanh,
  exp,
  log,
  sqrt,
  abs,
  sign,
  floor,
  fraction,
  min,
  max
};

enum class Topology { periodic, bounded };
/// How the values of a field along some axes become one.
enum class Reduction { mean, sum, max, min };
/// How a linear system is solved; automatic: as the operator's properties say.
enum class SolveMethod { automatic, direct, tridiagonal, fourier, multigrid, cg, bicgstab, gmres };
/// What the cycles of multigrid smooth by; automatic: as the runtime chooses.
enum class Smoother { automatic, red_black, jacobi, chebyshev };
/// What the iterations of cg, bicgstab and gmres are preconditioned by; automatic: as the runtime chooses.
enum class Preconditioner { automatic, multigrid, none };
/// What the operator A of a solve is whatever the values of its coefficients are.
struct OperatorTraits {
  bool is_symmetric = false;
  bool takes_constants_to_zero = false;  // A*1 = 0
  bool sums_to_zero = false;             // A^T*1 = 0
  bool operator==(const OperatorTraits&) const = default;
};
/// How, and how well. What does not come near enough is an error, or where `warns` a warning.
struct SolveBy {
  SolveMethod method = SolveMethod::automatic;
  double tolerance = 1e-12;
  int most_iterations = 200;
  bool warns = false;
  Smoother smoother = Smoother::automatic;
  Preconditioner preconditioner = Preconditioner::automatic;
  bool operator==(const SolveBy&) const = default;
};
/// What the values of fields are, and what is computed with them.
enum class Precision { f64, f32 };

/// What an interpolation takes along one axis between the cells around a place. stencil/stencil.h has the weights.
enum class InterpolationBasis { linear, slope, lower, upper, cubic, cubic_slope, cubic_bend, cubic_third };
constexpr int along_count = 8;
/// Weights of the cells from the one before that below the place to the second above it, as polynomials of the way f
/// from the one below: coefficients of 1, f, f^2, f^3. All 0: the cell is not taken.
using AlongWeights = std::array<std::array<double, 4>, 4>;
AlongWeights weights_of(InterpolationBasis along);
/// Whether it is 0 where the place is clamped.
bool is_derivative(InterpolationBasis along);
/// By how many cells at most a place inside the domain reads beyond it.
int reach_of(InterpolationBasis along);
/// The derivative by the place; nothing where that is 0.
std::optional<InterpolationBasis> derivative_of(InterpolationBasis along);
/// interp, interp_dx, interp_lxuy, interp_cxcdy ...: for each axis that is not linear what is taken along it.
std::string interp_name(const std::array<InterpolationBasis, 3>& along);
std::optional<std::array<InterpolationBasis, 3>> find_interp(std::string_view name);

/// As written: "+", "<=", "and", ...
std::string_view spelling(BinaryOp op);
/// Higher binds tighter: or 1, and 2, comparisons 3, + - 4, * / 5, (unary minus 6,) ^ 7. All but ^ associate to the
/// left.
int precedence(BinaryOp op);
constexpr int unary_precedence = 6;

std::string_view name_of(Fn fn);
std::optional<Fn> find_fn(std::string_view name);
int arity(Fn fn);

std::string_view name_of(Reduction reduction);
std::optional<Reduction> find_reduction(std::string_view name);

std::string_view name_of(SolveMethod method);
std::optional<SolveMethod> find_solve_method(std::string_view name);
std::string_view name_of(Smoother smoother);
std::optional<Smoother> find_smoother(std::string_view name);
std::string_view name_of(Preconditioner preconditioner);
std::optional<Preconditioner> find_preconditioner(std::string_view name);

/// "f64", "f32"
std::string_view name_of(Precision real);
int bytes_of(Precision real);
/// The value a field of this precision holds when it is given `value`.
double rounded(double value, Precision real);

}  // namespace dpde
