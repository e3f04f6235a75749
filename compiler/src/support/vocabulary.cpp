// SPDX-License-Identifier: Apache-2.0
#include "support/vocabulary.h"

#include <algorithm>

#include "support/assert.h"

namespace dpde {

namespace {

constexpr std::array<std::string_view, along_count> letters_of_along{"", "d", "l", "u", "c", "cd", "cdd", "cddd"};

std::string_view letters_of(InterpolationBasis along) { return letters_of_along.at(static_cast<std::size_t>(along)); }

}  // namespace

AlongWeights weights_of(InterpolationBasis along) {
  constexpr AlongWeights lagrange{
      {{0, -1.0 / 3, 0.5, -1.0 / 6}, {1, -0.5, -1, 0.5}, {0, 1, 0.5, -0.5}, {0, -1.0 / 6, 0, 1.0 / 6}}};
  switch (along) {
    case InterpolationBasis::linear: return {{{}, {1, -1}, {0, 1}, {}}};
    case InterpolationBasis::slope: return {{{}, {-1}, {1}, {}}};
    case InterpolationBasis::lower: return {{{}, {1}, {}, {}}};
    case InterpolationBasis::upper: return {{{}, {}, {1}, {}}};
    case InterpolationBasis::cubic: return lagrange;
    case InterpolationBasis::cubic_slope:
      return {{{-1.0 / 3, 1, -0.5}, {-0.5, -2, 1.5}, {1, 1, -1.5}, {-1.0 / 6, 0, 0.5}}};
    case InterpolationBasis::cubic_bend: return {{{1, -1}, {-2, 3}, {1, -3}, {0, 1}}};
    case InterpolationBasis::cubic_third: return {{{-1}, {3}, {-3}, {1}}};
  }
  unreachable("what is taken along an axis");
}

bool is_derivative(InterpolationBasis along) { return letters_of(along).ends_with('d'); }

int reach_of(InterpolationBasis along) { return letters_of(along).starts_with('c') ? 2 : 1; }

std::optional<InterpolationBasis> derivative_of(InterpolationBasis along) {
  switch (along) {
    case InterpolationBasis::linear: return InterpolationBasis::slope;
    case InterpolationBasis::cubic: return InterpolationBasis::cubic_slope;
    case InterpolationBasis::cubic_slope: return InterpolationBasis::cubic_bend;
    case InterpolationBasis::cubic_bend: return InterpolationBasis::cubic_third;
    case InterpolationBasis::slope:
    case InterpolationBasis::lower:
    case InterpolationBasis::upper:
    case InterpolationBasis::cubic_third: return std::nullopt;
  }
  unreachable("what is taken along an axis");
}

std::string interp_name(const std::array<InterpolationBasis, 3>& along) {
  std::string name = "interp";
  for (std::size_t axis = 0; axis < along.size(); ++axis) {
    if (along[axis] == InterpolationBasis::linear) continue;
    if (name == "interp") name += '_';
    name.append(letters_of(along[axis])) += "xyz"[axis];
  }
  return name;
}

std::optional<std::array<InterpolationBasis, 3>> find_interp(std::string_view name) {
  std::array<InterpolationBasis, 3> along{};
  std::size_t at = std::string_view("interp_").size();
  for (std::size_t axis = 0; axis < along.size() && at < name.size(); ++axis) {
    const std::size_t end = name.find("xyz"[axis], at);
    if (end == std::string_view::npos) continue;
    for (int a = 0; a < along_count; ++a) {
      if (letters_of(static_cast<InterpolationBasis>(a)) == name.substr(at, end - at))
        along[axis] = static_cast<InterpolationBasis>(a);
    }
    at = end + 1;
  }
  return interp_name(along) == name ? std::optional(along) : std::nullopt;
}

std::string_view spelling(BinaryOp op) {
  switch (op) {
    case BinaryOp::add: return "+";
    case BinaryOp::subtract: return "-";
    case BinaryOp::multiply: return "*";
    case BinaryOp::divide: return "/";
    case BinaryOp::power: return "^";
    case BinaryOp::less: return "<";
    case BinaryOp::less_equal: return "<=";
    case BinaryOp::greater: return ">";
    case BinaryOp::greater_equal: return ">=";
    case BinaryOp::equal: return "==";
    case BinaryOp::not_equal: return "!=";
    case BinaryOp::logical_and: return "and";
    case BinaryOp::logical_or: return "or";
  }
  unreachable("operator");
}

int precedence(BinaryOp op) {
  switch (op) {
    case BinaryOp::logical_or: return 1;
    case BinaryOp::logical_and: return 2;
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: return 3;
    case BinaryOp::add:
    case BinaryOp::subtract: return 4;
    case BinaryOp::multiply:
    case BinaryOp::divide: return 5;
    case BinaryOp::power: return 7;
  }
  unreachable("operator");
}

std::string_view name_of(Fn fn) {
  switch (fn) {
    case Fn::sin: return "sin";
    case Fn::cos: return "cos";
    case Fn::tan: return "tan";
    case Fn::asin: return "asin";
    case Fn::acos: return "acos";
    case Fn::atan: return "atan";
    case Fn::sinh: return "sinh";
    case Fn::cosh: return "cosh";
    case Fn::tanh: return "tanh";
    case Fn::exp: return "exp";
    case Fn::log: return "log";
    case Fn::erf: return "erf";
    case Fn::sqrt: return "sqrt";
    case Fn::abs: return "abs";
    case Fn::sign: return "sign";
    case Fn::floor: return "floor";
    case Fn::fraction: return "fraction";
    case Fn::min: return "min";
    case Fn::max: return "max";
  }
  unreachable("function");
}

std::optional<Fn> find_fn(std::string_view name) {
  const std::vector<Fn> functions = every_function();
  const auto found = std::ranges::find(functions, name, [](Fn fn) { return name_of(fn); });
  return found == functions.end() ? std::nullopt : std::optional(*found);
}

std::vector<Fn> every_function() {
  std::vector<Fn> functions;
  for (int i = 0; i <= static_cast<int>(Fn::max); ++i) functions.push_back(static_cast<Fn>(i));
  return functions;
}

bool has_jumps(Fn fn) {
  switch (fn) {
    case Fn::sign:
    case Fn::floor:
    case Fn::fraction: return true;
    case Fn::sin:
    case Fn::cos:
    case Fn::tan:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::log:
    case Fn::erf:
    case Fn::sqrt:
    case Fn::abs:
    case Fn::min:
    case Fn::max: return false;
  }
  unreachable("function");
}

bool has_poles(Fn fn) {
  switch (fn) {
    case Fn::tan:
    case Fn::log: return true;
    case Fn::sin:
    case Fn::cos:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::erf:
    case Fn::sqrt:
    case Fn::abs:
    case Fn::sign:
    case Fn::floor:
    case Fn::fraction:
    case Fn::min:
    case Fn::max: return false;
  }
  unreachable("function");
}

std::string_view name_of(Reduction reduction) {
  switch (reduction) {
    case Reduction::mean: return "mean";
    case Reduction::sum: return "sum";
    case Reduction::max: return "max";
    case Reduction::min: return "min";
  }
  unreachable("reduction");
}

std::optional<Reduction> find_reduction(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Reduction::min); ++i) {
    if (name_of(static_cast<Reduction>(i)) == name) return static_cast<Reduction>(i);
  }
  return std::nullopt;
}

std::string_view name_of(SolveMethod method) {
  switch (method) {
    case SolveMethod::automatic: return "automatic";
    case SolveMethod::direct: return "direct";
    case SolveMethod::tridiagonal: return "tridiagonal";
    case SolveMethod::fourier: return "fourier";
    case SolveMethod::multigrid: return "multigrid";
    case SolveMethod::cg: return "cg";
    case SolveMethod::bicgstab: return "bicgstab";
    case SolveMethod::gmres: return "gmres";
  }
  unreachable("name of a method");
}

std::optional<SolveMethod> find_solve_method(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(SolveMethod::gmres); ++i) {
    if (name_of(static_cast<SolveMethod>(i)) == name) return static_cast<SolveMethod>(i);
  }
  return std::nullopt;
}

std::string_view name_of(Smoother smoother) {
  switch (smoother) {
    case Smoother::automatic: return "automatic";
    case Smoother::red_black: return "red_black";
    case Smoother::jacobi: return "jacobi";
    case Smoother::chebyshev: return "chebyshev";
  }
  unreachable("name of a smoother");
}

std::string_view name_of(Preconditioner preconditioner) {
  switch (preconditioner) {
    case Preconditioner::automatic: return "automatic";
    case Preconditioner::multigrid: return "multigrid";
    case Preconditioner::none: return "none";
  }
  unreachable("name of a preconditioner");
}

std::optional<Preconditioner> find_preconditioner(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Preconditioner::none); ++i) {
    if (name_of(static_cast<Preconditioner>(i)) == name) return static_cast<Preconditioner>(i);
  }
  return std::nullopt;
}

std::optional<Smoother> find_smoother(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Smoother::chebyshev); ++i) {
    if (name_of(static_cast<Smoother>(i)) == name) return static_cast<Smoother>(i);
  }
  return std::nullopt;
}

std::string_view name_of(Precision real) { return real == Precision::f32 ? "f32" : "f64"; }

int bytes_of(Precision real) { return real == Precision::f32 ? 4 : 8; }

double rounded(double value, Precision real) { return real == Precision::f32 ? static_cast<float>(value) : value; }

int arity(Fn fn) { return fn == Fn::min || fn == Fn::max ? 2 : 1; }

}  // namespace dpde
