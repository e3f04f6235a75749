// SPDX-License-Identifier: Apache-2.0
// Vocabulary shared by all levels: operators, functions, kinds of axes and boundaries, precisions.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  erf,
  sqrt,
  abs,
  sign,
  floor,
  fraction,
  min,
  max
};

enum class Topology { periodic, bounded };
/// Reductions of a field along axes.
enum class Reduction { mean, sum, max, min };
/// Methods for linear systems; automatic: chosen by the operator's properties.
enum class SolveMethod { automatic, direct, tridiagonal, fourier, multigrid, cg, bicgstab, gmres };
/// Smoothers of multigrid cycles; automatic: chosen by the runtime.
enum class Smoother { automatic, red_black, jacobi, chebyshev };
/// Preconditioners of cg, bicgstab and gmres; automatic: chosen by the runtime.
enum class Preconditioner { automatic, multigrid, none };
/// Properties of the operator A of a solve for all values of its coefficients.
struct OperatorTraits {
  bool is_symmetric = false;
  bool takes_constants_to_zero = false;  // A*1 = 0
  bool sums_to_zero = false;             // A^T*1 = 0
  bool operator==(const OperatorTraits&) const = default;
};
/// Method and accuracy of a solve. Missing the tolerance is an error, or a warning if `warns`.
struct SolveBy {
  SolveMethod method = SolveMethod::automatic;
  double tolerance = 1e-12;
  int most_iterations = 200;
  bool warns = false;
  Smoother smoother = Smoother::automatic;
  Preconditioner preconditioner = Preconditioner::automatic;
  bool operator==(const SolveBy&) const = default;
};
/// Precision of fields and of computations with them.
enum class Precision { f64, f32 };

/// Basis of an interpolation along one axis. stencil/stencil.h has the weights.
enum class InterpolationBasis { linear, slope, lower, upper, cubic, cubic_slope, cubic_bend, cubic_third };
constexpr int along_count = 8;
/// Weights of the four cells around a point, from the second one below to the second one above it: polynomials in the
/// distance f from the cell below, as coefficients of 1, f, f^2, f^3. All 0: the cell is not used.
using AlongWeights = std::array<std::array<double, 4>, 4>;
AlongWeights weights_of(InterpolationBasis along);
/// Whether it is a derivative, i.e. 0 where the position is clamped.
bool is_derivative(InterpolationBasis along);
/// Number of ghost cells that points inside the domain read at most.
int reach_of(InterpolationBasis along);
/// The derivative with respect to the position; nullopt if it is 0.
std::optional<InterpolationBasis> derivative_of(InterpolationBasis along);
/// interp, interp_dx, interp_lxuy, interp_cxcdy ...: names the basis along each axis that is not linear.
std::string interp_name(const std::array<InterpolationBasis, 3>& along);
std::optional<std::array<InterpolationBasis, 3>> find_interp(std::string_view name);

/// As written: "+", "<=", "and", ...
std::string_view spelling(BinaryOp op);
/// Higher binds tighter: or 1, and 2, comparisons 3, + - 4, * / 5, (unary minus 6,) ^ 7. All but ^ are
/// left-associative.
int precedence(BinaryOp op);
constexpr int unary_precedence = 6;

std::string_view name_of(Fn fn);
std::optional<Fn> find_fn(std::string_view name);
int arity(Fn fn);
/// All functions, in the order of the enumeration.
std::vector<Fn> every_function();
/// Whether values jump: sign, floor, fraction.
bool has_jumps(Fn fn);
/// Whether values are unbounded near some argument: log at 0, tan at odd multiples of pi/2.
bool has_poles(Fn fn);

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
/// `value` rounded to the precision.
double rounded(double value, Precision real);

}  // namespace dpde
