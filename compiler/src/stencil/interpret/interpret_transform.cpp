// SPDX-License-Identifier: Apache-2.0
// Transforms by their definition: sums over all cells for each wave, one axis after the other. The code is independent
// of the runtime, which uses a fast Fourier transform and represents polynomials by their coefficients.
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/interpret/interpret.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

using Complex = std::complex<double>;
/// For each axis i times the wave number, and whether the wave has two cells along the axis.
struct Waves {
  std::array<Complex, max_rank> numbers{};
  std::array<bool, max_rank> are_shortest{};
  bool is_shortest(int axis) const { return are_shortest[static_cast<std::size_t>(axis)]; }
};

/// Values of all cells, x fastest.
class Spectrum {
 public:
  Spectrum(const Grid& grid, const std::array<bool, max_rank>& axes) : cells_(grid.cells), axes_(axes) {}

  std::vector<Complex> forward(const std::vector<double>& values) const {
    return along_axes({values.begin(), values.end()}, -1);
  }
  std::vector<Complex> backward(std::vector<Complex> waves) const { return along_axes(std::move(waves), 1); }

 private:
  std::vector<Complex> along_axes(std::vector<Complex> all, int sign) const {
    std::size_t stride = 1;
    for (std::size_t axis = 0; axis < max_rank; ++axis) {
      const auto n = static_cast<std::size_t>(cells_[axis]);
      if (axes_[axis]) along(all, n, stride, sign);
      stride *= n;
    }
    return all;
  }

  static void along(std::vector<Complex>& all, std::size_t n, std::size_t stride, int sign) {
    std::vector<Complex> roots(n), line(n);
    for (std::size_t i = 0; i < n; ++i)
      roots[i] = std::polar(1.0, sign * 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n));
    for (std::size_t first = 0; first < all.size(); ++first) {
      if (first / stride % n != 0) continue;
      for (std::size_t i = 0; i < n; ++i) line[i] = all[first + i * stride];
      for (std::size_t m = 0; m < n; ++m) {
        Complex sum = 0;
        for (std::size_t i = 0; i < n; ++i) sum += line[i] * roots[i * m % n];
        all[first + m * stride] = sign > 0 ? sum / static_cast<double>(n) : sum;
      }
    }
  }

  std::array<int, max_rank> cells_;
  std::array<bool, max_rank> axes_;
};

/// The symbol for one wave.
Complex value_of(const Expr& e, const Waves& waves, const State& state, const Params& params) {
  if (const auto axis = wave_axis(e))
    return is_slope_number(e) && waves.is_shortest(*axis) ? 0 : waves.numbers[static_cast<std::size_t>(*axis)];
  if (!holds_wave_number(e)) return uniform_value(e, state, params);
  const auto value = [&](const Expr& part) { return value_of(part, waves, state, params); };
  if (const Neg* neg = as<Neg>(e)) return -value(neg->operand);
  const Binary* b = as<Binary>(e);
  require(b != nullptr, "a polynomial of wave numbers");
  switch (b->op) {
    case BinaryOp::add: return value(b->left) + value(b->right);
    case BinaryOp::subtract: return value(b->left) - value(b->right);
    case BinaryOp::multiply: return value(b->left) * value(b->right);
    case BinaryOp::divide: return value(b->left) / value(b->right);
    case BinaryOp::power: return std::pow(value(b->left), static_cast<int>(uniform_value(b->right, state, params)));
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: break;
  }
  unreachable("a polynomial of wave numbers");
}

/// phi_number(z) by its recursion, averaged over a circle around z that avoids 0 (A.-K. Kassam and L. N. Trefethen,
/// SIAM J. Sci. Comput. 26, 2005, 1214). Each step of the recursion divides errors by |w|, so digits are lost near 0.
Complex phi(int number, Complex z) {
  constexpr int points = 64;
  const double size = std::abs(z), apart = std::max(2.0, 0.5 * number);
  const double radius = size < 2 * apart ? size + apart : 1;
  Complex sum = 0;
  for (int i = 0; i < points; ++i) {
    const Complex w = z + std::polar(radius, 2 * std::numbers::pi * (i + 0.5) / points);
    Complex value = std::exp(w);
    double factorial = 1;
    for (int n = 1; n <= number; ++n) {
      value = (value - 1 / factorial) / w;
      factorial *= n;
    }
    sum += value;
  }
  return sum / static_cast<double>(points);
}

/// Signed number of mode m of n: modes beyond n/2 are negative.
int signed_mode(int m, int n) { return 2 * m <= n ? m : m - n; }

/// The multiplier of each mode of the spectrum.
class Factor {
 public:
  Factor(const Multiplier& by, const State& state, const Params& params, const std::array<bool, max_rank>& axes)
      : by_(by),
        state_(state),
        params_(params),
        axes_(axes),
        has_numbers_(holds_wave_number(by.factor) || (by.function && holds_wave_number(by.argument))) {}

  Complex at(const CellIndex& mode) const {
    const CellIndex& n = state_.grid().cells;
    for (std::size_t axis = 0; axis < max_rank; ++axis) {
      const int m = std::abs(signed_mode(mode[axis], n[axis]));
      const bool is_short = axes_[axis] && m != 0 && 3 * m >= n[axis];
      if (by_.within_two_thirds && is_short) return 0;
    }
    return mean(mode);
  }

 private:
  /// Mean over k and -k along axes where the wave has two cells: both are the same wave there.
  Complex mean(const CellIndex& mode) const {
    Complex sum = 0;
    int count = 0;
    for (int signs = 0; signs < 8; ++signs) {
      Waves waves{};
      bool is_new = true;
      for (std::size_t axis = 0; axis < max_rank; ++axis) {
        const int n = state_.grid().cells[axis], m = signed_mode(mode[axis], n);
        const bool turns = (signs >> axis & 1) != 0;
        is_new = is_new && (!turns || (axes_[axis] && 2 * m == n));
        if (axes_[axis] && has_numbers_)
          waves.numbers[axis] = Complex(0, (turns ? -m : m) * 2 * std::numbers::pi / (n * spacing(axis)));
        waves.are_shortest[axis] = axes_[axis] && 2 * m == n;
      }
      if (!is_new) continue;
      sum += function_at(waves) * value_of(by_.factor, waves, state_, params_);
      ++count;
    }
    return sum / static_cast<double>(count);
  }
  Complex function_at(const Waves& waves) const {
    if (!by_.function) return 1;
    const Complex argument = value_of(by_.argument, waves, state_, params_);
    if (by_.function.kind == WaveFunction::Kind::phi) return phi(by_.function.number, argument);
    if (by_.function.kind == WaveFunction::Kind::heaviside) return argument.real() > 0 ? 1 : 0;
    return std::abs(argument) <= 1e-13 * size_of(waves) ? 0 : std::pow(argument, -by_.function.number);
  }
  /// Sum of the magnitudes of the argument's terms.
  double size_of(const Waves& waves) const {
    double size = 0;
    const std::vector<Monomial> terms = polynomial_of(by_.argument).value();
    for (const Monomial& term : terms) {
      double part = std::abs(uniform_value(term.coefficient, state_, params_));
      for (std::size_t axis = 0; axis < max_rank; ++axis)
        part *= term.vanishes[axis] && waves.are_shortest[axis]
                    ? 0
                    : std::pow(std::abs(waves.numbers[axis]), term.powers[axis]);
      size += part;
    }
    return size;
  }
  double spacing(std::size_t axis) const { return params_.at(std::string("h").append(1, "xyz"[axis])); }

  const Multiplier& by_;
  const State& state_;
  const Params& params_;
  const std::array<bool, max_rank> axes_;
  const bool has_numbers_;  // otherwise spacings are not needed, and may be missing
};

}  // namespace

void apply(State& state, const Transform& transform, const Params& params) {
  const std::array<bool, max_rank> axes = axes_of(transform, static_cast<std::size_t>(state.grid().rank));
  const Spectrum spectrum(state.grid(), axes);
  std::vector<Complex> sum;
  for (const Transform::Term& term : transform.terms) {
    const Factor factor(term.by, state, params, axes);
    const std::vector<Complex> waves = spectrum.forward(state.get(term.field));
    sum.resize(waves.size());
    std::size_t i = 0;
    for_each_cell({}, state.grid().cells, [&](const CellIndex& mode) {
      sum[i] += factor.at(mode) * waves[i];
      ++i;
    });
  }
  std::vector<double> values;
  for (const Complex& value : spectrum.backward(std::move(sum))) values.push_back(value.real());
  state.set(transform.result, values);
}

}  // namespace dpde::stencil
