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
  bool math = false, minimum = false, maximum = false, sign = false, fraction = false, inside = false, periodic = false, bounded = false;
  std::array<bool, loop::max_rank + 1> interp{}, scatter{};  // by rank
};

void add_axes(Uses& uses, const loop::Row& row) {
  for (const Topology topology : row.axes) (topology == Topology::periodic ? uses.periodic : uses.bounded) = true;
}

void add_expression(Uses& uses, const loop::Row* row, Precision real, const loop::Expr& e) {
  loop::visit(e, [&](const loop::Expr& part) {
    if (const loop::Call* call = std::get_if<loop::Call>(&part->kind)) {
      uses.minimum = uses.minimum || call->fn == Fn::min;
      uses.maximum = uses.maximum || call->fn == Fn::max;
      uses.sign = uses.sign || call->fn == Fn::sign;
      uses.fraction = uses.fraction || call->fn == Fn::fraction;
      uses.math = uses.math || (call->fn != Fn::min && call->fn != Fn::max && call->fn != Fn::sign);
    }
    const loop::Binary* binary = std::get_if<loop::Binary>(&part->kind);
    const loop::Literal* literal = std::get_if<loop::Literal>(&part->kind);
    uses.math = uses.math || (binary && binary->op == BinaryOp::power && !is_small_power(*binary)) ||
                (literal && !std::isfinite(rounded(literal->value, real)));  // INFINITY and NAN are macros of <math.h>
    uses.inside = uses.inside || std::holds_alternative<loop::Inside>(part->kind);
    if (row && std::holds_alternative<loop::Interp>(part->kind)) {
      uses.interp.at(row->rank) = true;
      add_axes(uses, *row);
    }
  });
}

void add_uniforms(Uses& uses, const loop::Module& module) {
  for (const loop::UniformDef& uniform : module.uniforms) add_expression(uses, nullptr, Precision::f64, uniform.value);
}

void add_rows(Uses& uses, const loop::Module& module) {
  for (const loop::Row& row : module.rows) {
    loop::for_each_expression(row, [&](const loop::Expr& e) { add_expression(uses, &row, module.real, e); });
    if (row.scatters.empty()) continue;
    uses.scatter.at(row.rank) = true;
    add_axes(uses, row);
  }
}

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

constexpr std::string_view pair_text = R"(
// Two neighbouring cells of an axis and what an interpolation takes of each.
struct dpde_pair {
  int64_t cell[2];
  double weight[2];
};

// A number that may be anything, NaN included, as a cell in [low, high].
static inline int64_t dpde_between(double cell, double low, double high) {
  const double at_least = cell > low ? cell : low;
  return (int32_t)(at_least < high ? at_least : high);
}

// Weights 1-f and f or, for the slope, -1 and 1 (0 and 0 where the place was clamped); NaN where f is.
static inline dpde_pair dpde_weigh(int64_t low, int64_t high, double f, bool clamped, bool slope) {
  const double rate = f != f ? f : clamped ? 0.0 : 1.0;
  return {{low, high}, {slope ? -rate : 1.0 - f, slope ? rate : f}};
}
)";

constexpr std::string_view periodic_text = R"(
// Between which cells of a periodic axis the point `at` displaced by d cells lies.
static inline dpde_pair dpde_periodic(int64_t at, double d, int64_t cells, bool slope) {
  const double whole = floor(d), n = (double)cells;
  const double place = (double)at + whole;
  const int64_t low = dpde_between(place - n*floor(place/n), 0.0, n - 1.0);
  return dpde_weigh(low, low + 1 == cells ? 0 : low + 1, d - whole, false, slope);
}
)";

constexpr std::string_view bounded_text = R"(
// The same for a bounded axis: places are clamped to [-1/2, cells - 1/2], half-way into the first halo cell.
static inline dpde_pair dpde_bounded(int64_t at, double d, int64_t cells, bool slope) {
  const double whole = floor(d), n = (double)cells;
  const double place = (double)at + whole, f = d - whole;
  const bool clamped = (f < -0.5 - place) | (f > n - 0.5 - place);  // no branch: the loop around must vectorise
  const int64_t low = dpde_between(place, -1.0, n - 1.0);
  return dpde_weigh(low, low + 1, clamped ? 0.5 : f, clamped, slope);
}
)";

constexpr std::array<std::string_view, loop::max_rank + 1> interp_text = {"", R"(
static inline double dpde_interp_1(const double* u, dpde_pair x) {
  return x.weight[0]*u[x.cell[0]] + x.weight[1]*u[x.cell[1]];
}
)",
                                                                          R"(
static inline double dpde_interp_2(const double* u, dpde_pair x, dpde_pair y, int64_t stride_y) {
  const double* low = u + y.cell[0]*stride_y;
  const double* high = u + y.cell[1]*stride_y;
  return y.weight[0]*(x.weight[0]*low[x.cell[0]] + x.weight[1]*low[x.cell[1]]) +
         y.weight[1]*(x.weight[0]*high[x.cell[0]] + x.weight[1]*high[x.cell[1]]);
}
)",
                                                                          R"(
static inline double dpde_interp_3(const double* u, dpde_pair x, dpde_pair y, dpde_pair z, int64_t stride_y,
                                   int64_t stride_z) {
  double sum = 0.0;
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      const double* along = u + y.cell[j]*stride_y + z.cell[k]*stride_z;
      sum += z.weight[k]*y.weight[j]*(x.weight[0]*along[x.cell[0]] + x.weight[1]*along[x.cell[1]]);
    }
  }
  return sum;
}
)"};

constexpr std::array<std::string_view, loop::max_rank + 1> scatter_text = {"", R"(
static inline void dpde_scatter_1(double* u, double value, dpde_pair x) {
  for (int i = 0; i < 2; ++i) u[x.cell[i]] += x.weight[i]*value;
}
)",
                                                                           R"(
static inline void dpde_scatter_2(double* u, double value, dpde_pair x, dpde_pair y, int64_t stride_y) {
  for (int j = 0; j < 2; ++j) {
    double* along = u + y.cell[j]*stride_y;
    for (int i = 0; i < 2; ++i) along[x.cell[i]] += x.weight[i]*y.weight[j]*value;
  }
}
)",
                                                                           R"(
static inline void dpde_scatter_3(double* u, double value, dpde_pair x, dpde_pair y, dpde_pair z, int64_t stride_y,
                                  int64_t stride_z) {
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      double* along = u + y.cell[j]*stride_y + z.cell[k]*stride_z;
      for (int i = 0; i < 2; ++i) along[x.cell[i]] += x.weight[i]*y.weight[j]*z.weight[k]*value;
    }
  }
}
)"};

std::string text_of(const Uses& uses) {
  std::string out;
  const auto add = [&](bool used, std::string_view text) {
    if (used) out += text;
  };
  add(uses.minimum, minimum_text);
  add(uses.maximum, maximum_text);
  add(uses.sign, sign_text);
  add(uses.fraction, fraction_text);
  add(uses.inside, inside_text);
  add(uses.periodic || uses.bounded, pair_text);
  add(uses.periodic, periodic_text);
  add(uses.bounded, bounded_text);
  for (int rank = 1; rank <= loop::max_rank; ++rank) {
    add(uses.interp[rank], interp_text[rank]);
    add(uses.scatter[rank], scatter_text[rank]);
  }
  return out;
}

/// Types, literals and calls of the text as they are for floats.
std::string in_single_precision(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const auto replace = [&](std::string_view word, std::string_view by) {
      if (text.compare(i, word.size(), word) != 0) return false;
      out += by;
      i += word.size();
      return true;
    };
    if (replace("double", "float") || replace("floor(", "floorf(")) continue;
    out += text[i++];
    const bool ends_literal = i >= 3 && std::isdigit(text[i - 1]) && text[i - 2] == '.' && std::isdigit(text[i - 3]);
    if (ends_literal) out += 'f';  // all of them have one decimal
  }
  return out;
}

}  // namespace

bool needs_math(const loop::Module& module) {
  Uses uses;
  add_uniforms(uses, module);
  add_rows(uses, module);
  return uses.math || uses.periodic || uses.bounded;  // interpolation takes the floor of places
}

std::string cpp_helpers(const loop::Module& module) {
  Uses uses;
  add_uniforms(uses, module);
  if (module.real == Precision::f64) {
    add_rows(uses, module);
    return text_of(uses);
  }
  Uses of_rows;  // beside those of the uniforms, which are doubles: overloads
  add_rows(of_rows, module);
  return text_of(uses) + in_single_precision(text_of(of_rows));
}

}  // namespace dpde::codegen
