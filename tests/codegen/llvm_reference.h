// SPDX-License-Identifier: Apache-2.0
// The meaning of a loop module, evaluated cell by cell with no regard to speed: the truth compiled rows are held to.
#pragma once

#include <limits>

#include "codegen/llvm_support.h"
#include "support/match.h"

namespace dpde::codegen::testing {

constexpr Topology P = Topology::periodic, B = Topology::bounded;

class Reference {
 public:
  Reference(const loop::Module& module, Memory& memory, const Params& params) : module_(module), memory_(memory) {
    for (const std::string& name : module.params) params_.push_back(params.at(name));
    for (const loop::UniformDef& uniform : module.uniforms) uniforms_.push_back(value(uniform.value));
  }

  void run(int grow) {
    for (const loop::Row& row : module_.rows) run_row(row, grow);
  }

 private:
  struct Tap {
    int64_t cell;
    double weight;
  };

  void run_row(const loop::Row& row, int grow) {
    row_ = &row;
    memory_.for_each_row(row.axes, grow, [&](int64_t y, int64_t z, int64_t first, int64_t count) {
      for (int64_t x = first; x < first + count; ++x) {
        cell_ = {x, y, z};
        run_cell();
      }
    });
  }

  void run_cell() {
    lets_.clear();
    for (const loop::Let& let : row_->lets) lets_.push_back(value(let.value));
    std::vector<double> stores, sums;
    for (const loop::Store& store : row_->stores) stores.push_back(value(store.value));
    for (const loop::Sum& sum : row_->sums) sums.push_back(value(sum.value));
    for (std::size_t i = 0; i < stores.size(); ++i) {
      double& place = stream(row_->stores[i].stream);
      place = row_->stores[i].accumulate ? place + stores[i] : stores[i];
    }
    const std::vector<std::string>& names = module_.programs[0].sums;
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const auto found = std::find(names.begin(), names.end(), row_->sums[i].name);
      memory_.sums().at(found - names.begin()) += sums[i];
    }
    for (const loop::Scatter& scatter : row_->scatters) {
      const double added = value(scatter.value);
      for_each_tap(scatter.target, [&](double& place, double weight) { place += weight * added; });
    }
  }

  double& stream(int index) {
    const loop::Stream& s = row_->streams.at(index);
    return memory_.at(s.field, cell_[0] + s.offset[0], cell_[1] + s.offset[1], cell_[2] + s.offset[2]);
  }

  /// Of the values p at -1, 0, 1, 2: Lagrange's polynomial at f, from its Newton form, by differences.
  static std::array<double, 4> cubic_weights(double f, int derivative) {
    std::array<double, 4> weights{};
    const double a[] = {f + 1, f, f - 1};  // Newton's factors
    const double first[] = {0, 1, a[0] + a[1], a[0] * a[1] + a[0] * a[2] + a[1] * a[2]};
    const double second[] = {0, 0, 2, 2 * (a[0] + a[1] + a[2])};
    const double third[] = {0, 0, 0, 6};
    const double plain[] = {1, a[0], a[0] * a[1], a[0] * a[1] * a[2]};
    const double* basis[] = {plain, first, second, third};
    const double differences[4][4] = {{1, 0, 0, 0}, {-1, 1, 0, 0}, {0.5, -1, 0.5, 0}, {-1.0 / 6, 0.5, -0.5, 1.0 / 6}};
    for (int order = 0; order < 4; ++order) {
      for (int k = 0; k < 4; ++k) weights[k] += basis[derivative][order] * differences[order][k];
    }
    return weights;
  }

  static std::array<double, 4> weights_at(InterpolationBasis along, double f) {
    switch (along) {
      case InterpolationBasis::linear: return {0, 1 - f, f, 0};
      case InterpolationBasis::slope: return {0, -1, 1, 0};
      case InterpolationBasis::lower: return {0, 1, 0, 0};
      case InterpolationBasis::upper: return {0, 0, 1, 0};
      case InterpolationBasis::cubic: return cubic_weights(f, 0);
      case InterpolationBasis::cubic_slope: return cubic_weights(f, 1);
      case InterpolationBasis::cubic_bend: return cubic_weights(f, 2);
      case InterpolationBasis::cubic_third: return cubic_weights(f, 3);
    }
    return {};
  }

  std::vector<Tap> taps(int axis, int64_t at, double d, InterpolationBasis along) {
    const int64_t n = memory_.layout().cells[axis];
    const bool periodic = row_->axes[axis] == Topology::periodic;
    const double position = periodic ? at + d : std::clamp<double>(at + d, -0.5, n - 0.5);
    const double whole = periodic ? at + std::floor(d) : std::floor(position);
    const double f = periodic ? d - std::floor(d) : position - whole;
    const bool is_slope = along == InterpolationBasis::slope || along == InterpolationBasis::cubic_slope ||
                          along == InterpolationBasis::cubic_bend || along == InterpolationBasis::cubic_third;
    std::vector<Tap> result;
    for (int k = 0; k < 4; ++k) {
      const double weight = is_slope && !periodic && position != at + d ? 0 : weights_at(along, f)[k];
      const int64_t cell = static_cast<int64_t>(whole) + k - 1;
      if (weight != 0) result.push_back({periodic ? (cell % n + n) % n : cell, weight});
    }
    return result;
  }

  template <class F>
  void for_each_tap(const loop::Interp& interp, const F& f) {
    std::vector<Tap> along[3] = {{{0, 1}}, {{0, 1}}, {{0, 1}}};
    for (int a = 0; a < row_->rank; ++a) {
      along[a] = taps(a, cell_[a] + interp.offset[a], value(interp.displacement[a]), interp.along[a]);
    }
    for (const Tap& z : along[2]) {
      for (const Tap& y : along[1]) {
        for (const Tap& x : along[0]) {
          f(memory_.at(row_->grids.at(interp.grid), x.cell, y.cell, z.cell), x.weight * y.weight * z.weight);
        }
      }
    }
  }

  bool is_inside(const loop::Inside& inside) {
    for (int a = 0; a < row_->rank; ++a) {
      if (row_->axes[a] == Topology::periodic) continue;
      const int64_t place = cell_[a] + inside.offset[a];
      if (place < -inside.grow || place >= memory_.layout().cells[a] + inside.grow) return false;
    }
    return true;
  }

  double interpolate(const loop::Interp& interp) {
    double total = 0;
    for_each_tap(interp, [&](double& place, double weight) { total += weight * place; });
    return total;
  }

  static double binary(BinaryOp kind, double a, double b) {
    switch (kind) {
      case BinaryOp::add: return a + b;
      case BinaryOp::subtract: return a - b;
      case BinaryOp::multiply: return a * b;
      case BinaryOp::divide: return a / b;
      case BinaryOp::power: return std::pow(a, b);
      case BinaryOp::less: return a < b;
      case BinaryOp::less_equal: return a <= b;
      case BinaryOp::greater: return a > b;
      case BinaryOp::greater_equal: return a >= b;
      case BinaryOp::equal: return a == b;
      case BinaryOp::not_equal: return a != b;
      case BinaryOp::logical_and: return a != 0 && b != 0;
      case BinaryOp::logical_or: return a != 0 || b != 0;
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  static double function(Fn fn, double a, double b) {
    switch (fn) {
      case Fn::sin: return std::sin(a);
      case Fn::cos: return std::cos(a);
      case Fn::tan: return std::tan(a);
      case Fn::asin: return std::asin(a);
      case Fn::acos: return std::acos(a);
      case Fn::atan: return std::atan(a);
      case Fn::sinh: return std::sinh(a);
      case Fn::cosh: return std::cosh(a);
      case Fn::tanh: return std::tanh(a);
      case Fn::exp: return std::exp(a);
      case Fn::log: return std::log(a);
      case Fn::erf: return std::erf(a);
      case Fn::sqrt: return std::sqrt(a);
      case Fn::abs: return std::abs(a);
      case Fn::sign: return a > 0 ? 1 : a < 0 ? -1 : 0;
      case Fn::floor: return std::floor(a);
      case Fn::fraction: return a - std::floor(a);
      case Fn::min: return std::min(a, b);
      case Fn::max: return std::max(a, b);
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  double value(const Expr& e) {
    return match(
        e->kind, [](const Literal& l) { return l.value; },
        [&](const loop::Uniform& u) { return uniforms_.at(u.index); },
        [&](const loop::Param& p) { return params_.at(p.index); },
        [](const loop::Counter&) { return std::numeric_limits<double>::quiet_NaN(); },  // no passes are counted here
        [&](const loop::Load& l) { return double{stream(l.stream)}; },
        [&](const loop::Local& l) { return lets_.at(l.index); },
        [&](const loop::Inside& i) { return is_inside(i) ? 1.0 : 0.0; },
        [&](const loop::Interp& i) { return interpolate(i); }, [&](const loop::Neg& n) { return -value(n.operand); },
        [&](const loop::Rounded& r) { return value(r.operand); },
        [&](const loop::Binary& b) { return binary(b.op, value(b.left), value(b.right)); },
        [&](const loop::Call& c) { return function(c.fn, value(c.arguments[0]), value(c.arguments.back())); },
        [&](const loop::Select& s) { return value(s.condition) != 0 ? value(s.yes) : value(s.no); });
  }

  const loop::Module& module_;
  Memory& memory_;
  std::vector<double> params_, uniforms_, lets_;
  const loop::Row* row_ = nullptr;
  std::array<int64_t, 3> cell_{};
};

inline void expect_close(double got, double expected, const std::string& where) {
  if (!std::isfinite(expected)) {
    EXPECT_TRUE(std::isnan(expected) ? std::isnan(got) : got == expected) << where << ": " << got;
    return;
  }
  EXPECT_NEAR(got, expected, 1e-13 * (1 + std::abs(expected))) << where;
}

/// Runs the module compiled and cell by cell on equal memory; every value of every field, halo included, must agree.
inline void expect_same(const loop::Module& module, const CompiledModule& compiled, std::array<int, 3> cells,
                        const Params& params = {}, int grow = 0) {
  Memory expected(module, cells);
  Memory got(module, cells);
  Reference(module, expected, params).run(grow);
  run(*compiled.find("all"), module.rows[0].axes, got, values_of(module, params), grow);
  const std::string size = std::to_string(cells[0]) + "x" + std::to_string(cells[1]) + "x" + std::to_string(cells[2]);
  for (const auto& [name, values] : expected.fields()) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      expect_close(got.field(name)[i], values[i], name + " of " + size + " at " + std::to_string(i));
      if (::testing::Test::HasFailure()) return;
    }
  }
  for (std::size_t s = 0; s < expected.sums().size(); ++s) {
    expect_close(got.sums()[s], expected.sums()[s], "sum of " + size);
  }
}

}  // namespace dpde::codegen::testing
