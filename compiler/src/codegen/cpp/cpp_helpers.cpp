// SPDX-License-Identifier: Apache-2.0
#include "codegen/cpp/cpp_helpers.h"

#include <array>
#include <cctype>
#include <cmath>
#include <string_view>

#include "codegen/cpp/cpp_expression.h"
#include "loop/expressions.h"

namespace dpde::codegen {

namespace {

struct Uses {
  bool math = false, product = false, minimum = false, maximum = false, sign = false, fraction = false, inside = false,
       periodic = false, bounded = false;
  std::array<bool, loop::max_rank + 1> interp{}, scatter{};  // by rank
  std::array<bool, along_count> along{};
};

void add_place(Uses& uses, const loop::Row& row, const loop::Interp& interp) {
  for (std::size_t axis = 0; axis < row.axes.size(); ++axis) {
    (row.axes[axis] == Topology::periodic ? uses.periodic : uses.bounded) = true;
    uses.along.at(static_cast<std::size_t>(interp.along[axis])) = true;
  }
}

void add_expression(Uses& uses, const loop::Row* row, Precision real, const loop::Expr& e) {
  visit(e, [&](const loop::Expr& part) {
    if (const loop::Call* call = as<loop::Call>(part)) {
      uses.minimum = uses.minimum || call->fn == Fn::min;
      uses.maximum = uses.maximum || call->fn == Fn::max;
      uses.sign = uses.sign || call->fn == Fn::sign;
      uses.fraction = uses.fraction || call->fn == Fn::fraction;
      uses.math = uses.math || (call->fn != Fn::min && call->fn != Fn::max && call->fn != Fn::sign);
    }
    const loop::Binary* binary = as<loop::Binary>(part);
    const Literal* literal = as<Literal>(part);
    uses.math = uses.math || (binary && binary->op == BinaryOp::power && !is_small_power(*binary)) ||
                (literal && !std::isfinite(rounded(literal->value, real)));  // INFINITY and NAN are macros of <math.h>
    const loop::Rounded* rounded = as<loop::Rounded>(part);
    uses.product = uses.product || (rounded && is_rounded_product(*rounded));
    uses.inside = uses.inside || is<loop::Inside>(part);
    const loop::Interp* interp = as<loop::Interp>(part);
    if (row && interp) {
      uses.interp.at(row->rank) = true;
      add_place(uses, *row, *interp);
    }
  });
}

void add_uniforms(Uses& uses, const loop::Module& module) {
  for (const loop::UniformDef& uniform : module.uniforms) add_expression(uses, nullptr, Precision::f64, uniform.value);
}

void add_rows(Uses& uses, const loop::Module& module) {
  for (const loop::Row& row : module.rows) {
    for_each_expression(row, [&](const loop::Expr& e) { add_expression(uses, &row, module.real, e); });
    for (const loop::Scatter& scatter : row.scatters) {
      uses.scatter.at(row.rank) = true;
      add_place(uses, row, scatter.target);
    }
  }
}

constexpr std::string_view product_text = R"(
// A product that is rounded before anything is added to it, as what decides between cases has to be: an fma is contracted no more.
static inline double dpde_product(double a, double b) {
#if defined(__clang__)
#pragma clang fp contract(off)
  return a*b;
#elif defined(__FP_FAST_FMA)
  return __builtin_fma(a, b, -0.0);
#else
  return a*b;
#endif
}
)";

constexpr std::string_view minimum_text = R"(
static inline double dpde_min(double a, double b) { return b < a ? b : a; }
)";

constexpr std::string_view maximum_text = R"(
static inline double dpde_max(double a, double b) { return a < b ? b : a; }
)";

constexpr std::string_view fraction_text = R"(
static inline double dpde_fraction(double x) { return x - floor(x); }
)";

constexpr std::string_view sign_text = R"(
static inline double dpde_sign(double x) { return (x > 0.0 ? 1.0 : 0.0) - (x < 0.0 ? 1.0 : 0.0); }
)";

constexpr std::string_view inside_text = R"(
// -grow <= place < cells + grow
static inline bool dpde_inside(int64_t place, int64_t cells, int64_t grow) {
  return (uint64_t)(place + grow) < (uint64_t)(cells + 2*grow);
}
)";

constexpr std::string_view place_text = R"(
// A place on an axis: f of the way from cell[1] to cell[2]. rate is that of f by the displacement: 1, or 0 where the place was
// clamped. A displacement that is no number makes f and rate NaN.
struct dpde_place {
  int64_t cell[4];
  double f, rate;
};

// Cells of an axis and what an interpolation takes of each.
template <int n>
struct dpde_taps {
  int64_t cell[n];
  double weight[n];
};

// A number that may be anything, NaN included, as a cell in [low, high].
static inline int64_t dpde_between(double cell, double low, double high) {
  const double at_least = cell > low ? cell : low;
  return (int32_t)(at_least < high ? at_least : high);
}
)";

constexpr std::string_view periodic_text = R"(
// Where on a periodic axis the point `at` displaced by d cells lies. From the middle of a cell no rounding leads to another turn.
static inline dpde_place dpde_periodic(int64_t at, double d, int64_t cells) {
  const double whole = floor(d), n = (double)cells;
  const double place = (double)at + whole, f = d - whole;
  const int64_t low = dpde_between(place - n*floor((place + 0.5)*(1.0/n)), 0.0, n - 1.0);
  const int64_t high = low + 1 == cells ? 0 : low + 1;
  return {{(low == 0 ? cells : low) - 1, low, high, high + 1 == cells ? 0 : high + 1}, f, f != f ? f : 1.0};
}
)";

constexpr std::string_view bounded_text = R"(
// The same for a bounded axis: places are clamped to [-1/2, cells - 1/2], half-way into the first halo cell.
static inline dpde_place dpde_bounded(int64_t at, double d, int64_t cells) {
  const double whole = floor(d), n = (double)cells;
  const double place = (double)at + whole, f = d - whole;
  const bool clamped = (f < -0.5 - place) | (f > n - 0.5 - place);  // no branch: the loop around must vectorise
  const int64_t low = dpde_between(place, -1.0, n - 1.0);
  return {{low - 1, low, low + 1, low + 2}, clamped ? 0.5 : f, f != f ? f : clamped ? 0.0 : 1.0};
}
)";

struct AlongText {
  std::string_view name, text;
};

constexpr std::array<AlongText, along_count> along_texts = {{
    {"dpde_linear", R"(
static inline dpde_taps<2> dpde_linear(dpde_place p) { return {{p.cell[1], p.cell[2]}, {1.0 - p.f, p.f}}; }
)"},
    {"dpde_slope", R"(
// The derivative of dpde_linear.
static inline dpde_taps<2> dpde_slope(dpde_place p) { return {{p.cell[1], p.cell[2]}, {-p.rate, p.rate}}; }
)"},
    {"dpde_lower", R"(
static inline dpde_taps<1> dpde_lower(dpde_place p) { return {{p.cell[1]}, {p.f != p.f ? p.f : 1.0}}; }
)"},
    {"dpde_upper", R"(
static inline dpde_taps<1> dpde_upper(dpde_place p) { return {{p.cell[2]}, {p.f != p.f ? p.f : 1.0}}; }
)"},
    {"dpde_cubic", R"(
// Lagrange's polynomial through four cells.
static inline dpde_taps<4> dpde_cubic(dpde_place p) {
  const double f = p.f, g = 1.0 - f;
  return {{p.cell[0], p.cell[1], p.cell[2], p.cell[3]},
          {-f*g*(2.0 - f)/6.0, (1.0 + f)*g*(2.0 - f)/2.0, f*(1.0 + f)*(2.0 - f)/2.0, -f*g*(1.0 + f)/6.0}};
}
)"},
    {"dpde_cubic_slope", R"(
// The derivative of dpde_cubic.
static inline dpde_taps<4> dpde_cubic_slope(dpde_place p) {
  const double f = p.f, s = p.rate/6.0;
  return {{p.cell[0], p.cell[1], p.cell[2], p.cell[3]},
          {s*((6.0 - 3.0*f)*f - 2.0), s*((9.0*f - 12.0)*f - 3.0), s*((6.0 - 9.0*f)*f + 6.0), s*(3.0*f*f - 1.0)}};
}
)"},
    {"dpde_cubic_bend", R"(
// Its second derivative.
static inline dpde_taps<4> dpde_cubic_bend(dpde_place p) {
  const double f = p.f, s = p.rate;
  return {{p.cell[0], p.cell[1], p.cell[2], p.cell[3]}, {s*(1.0 - f), s*(3.0*f - 2.0), s*(1.0 - 3.0*f), s*f}};
}
)"},
    {"dpde_cubic_third", R"(
// Its third derivative.
static inline dpde_taps<4> dpde_cubic_third(dpde_place p) {
  const double s = p.rate;
  return {{p.cell[0], p.cell[1], p.cell[2], p.cell[3]}, {-s, 3.0*s, -3.0*s, s}};
}
)"},
}};

constexpr std::array<std::string_view, loop::max_rank + 1> interp_text = {"", R"(
template <int nx>
static inline double dpde_interp_1(const double* u, dpde_taps<nx> x) {
  double sum = x.weight[0]*u[x.cell[0]];
  for (int i = 1; i < nx; ++i) sum += x.weight[i]*u[x.cell[i]];
  return sum;
}
)",
                                                                          R"(
template <int nx, int ny>
static inline double dpde_interp_2(const double* u, dpde_taps<nx> x, dpde_taps<ny> y, int64_t stride_y) {
  double sum = 0.0;
  for (int j = 0; j < ny; ++j) {
    const double* along = u + y.cell[j]*stride_y;
    double row = x.weight[0]*along[x.cell[0]];
    for (int i = 1; i < nx; ++i) row += x.weight[i]*along[x.cell[i]];
    sum += y.weight[j]*row;
  }
  return sum;
}
)",
                                                                          R"(
template <int nx, int ny, int nz>
static inline double dpde_interp_3(const double* u, dpde_taps<nx> x, dpde_taps<ny> y, dpde_taps<nz> z, int64_t stride_y,
                                   int64_t stride_z) {
  double sum = 0.0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      const double* along = u + y.cell[j]*stride_y + z.cell[k]*stride_z;
      double row = x.weight[0]*along[x.cell[0]];
      for (int i = 1; i < nx; ++i) row += x.weight[i]*along[x.cell[i]];
      sum += z.weight[k]*y.weight[j]*row;
    }
  }
  return sum;
}
)"};

constexpr std::array<std::string_view, loop::max_rank + 1> scatter_text = {"", R"(
template <int nx>
static inline void dpde_scatter_1(double* u, double value, dpde_taps<nx> x) {
  for (int i = 0; i < nx; ++i) u[x.cell[i]] += x.weight[i]*value;
}
)",
                                                                           R"(
template <int nx, int ny>
static inline void dpde_scatter_2(double* u, double value, dpde_taps<nx> x, dpde_taps<ny> y, int64_t stride_y) {
  for (int j = 0; j < ny; ++j) {
    double* along = u + y.cell[j]*stride_y;
    for (int i = 0; i < nx; ++i) along[x.cell[i]] += x.weight[i]*y.weight[j]*value;
  }
}
)",
                                                                           R"(
template <int nx, int ny, int nz>
static inline void dpde_scatter_3(double* u, double value, dpde_taps<nx> x, dpde_taps<ny> y, dpde_taps<nz> z,
                                  int64_t stride_y, int64_t stride_z) {
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      double* along = u + y.cell[j]*stride_y + z.cell[k]*stride_z;
      for (int i = 0; i < nx; ++i) along[x.cell[i]] += x.weight[i]*y.weight[j]*z.weight[k]*value;
    }
  }
}
)"};

std::string text_of(const Uses& uses) {
  std::string out;
  const auto add = [&](bool used, std::string_view text) {
    if (used) out += text;
  };
  add(uses.product, product_text);
  add(uses.minimum, minimum_text);
  add(uses.maximum, maximum_text);
  add(uses.sign, sign_text);
  add(uses.fraction, fraction_text);
  add(uses.inside, inside_text);
  add(uses.periodic || uses.bounded, place_text);
  add(uses.periodic, periodic_text);
  add(uses.bounded, bounded_text);
  for (std::size_t a = 0; a < along_texts.size(); ++a) add(uses.along[a], along_texts[a].text);
  for (int rank = 1; rank <= loop::max_rank; ++rank) {
    add(uses.interp[rank], interp_text[rank]);
    add(uses.scatter[rank], scatter_text[rank]);
  }
  return out;
}

/// Changes types, literals and calls from double to float.
std::string in_single_precision(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto replace = [&](std::string_view word, std::string_view by) {
      if (text.compare(i, word.size(), word) != 0) return false;
      out += by;
      i += word.size();
      return true;
    };
    if (replace("double", "float") || replace("floor(", "floorf(") || replace("__builtin_fma(", "__builtin_fmaf("))
      continue;
    out += text[i++];
    const bool ends_literal = i >= 3 && std::isdigit(text[i - 1]) && text[i - 2] == '.' && std::isdigit(text[i - 3]);
    if (ends_literal) out += 'f';  // all literals of these texts have one decimal
  }
  return out;
}

}  // namespace

std::string_view cpp_taps(InterpolationBasis along) { return along_texts.at(static_cast<std::size_t>(along)).name; }

bool needs_math(const loop::Module& module) {
  Uses uses;
  add_uniforms(uses, module);
  add_rows(uses, module);
  return uses.math || uses.periodic || uses.bounded;  // interpolation calls floor
}

std::string cpp_helpers(const loop::Module& module) {
  Uses uses;
  add_uniforms(uses, module);
  if (module.real == Precision::f64) {
    add_rows(uses, module);
    return text_of(uses);
  }
  Uses of_rows;  // overloads next to the functions of the uniforms, which are doubles
  add_rows(of_rows, module);
  return text_of(uses) + in_single_precision(text_of(of_rows));
}

}  // namespace dpde::codegen
