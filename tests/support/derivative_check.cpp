// SPDX-License-Identifier: Apache-2.0
#include "support/derivative_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "source/render.h"
#include "stencil/build.h"
#include "stencil/from_ast.h"
#include "stencil/verify_stencil.h"
#include "syntax/parser.h"

namespace dpde::testing {

using namespace stencil;

namespace {

using Values = std::map<std::string, std::vector<double>>;

/// What one run of a program starts from and leaves.
struct Run {
  Values fields;
  Params params;
};
struct Results {
  Values fields;
  std::map<std::string, double> sums;
};

size_t size_of(const Grid& grid) {
  return static_cast<size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2];
}

int halo_of(const Module& module, const Program& program) {
  int widest = 1;
  for (const auto& [field, halo] : required_halo(module, program)) {
    for (const int h : halo) widest = std::max(widest, h);
  }
  return widest;
}

Results run_program(const Module& module, const std::string& name, const Grid& grid, const Run& run) {
  const Program& program = *module.find_program(name);
  State state(grid, halo_of(module, program));
  for (const auto& [field, values] : run.fields) state.set(field, values);
  for (int axis = 0; axis < grid.rank; ++axis) state.set_coordinate(axis, program.axes[axis], 0, 0.3);
  Results results;
  results.sums = interpret(module, program, state, run.params);
  for (const Swap& swap : program.swaps) results.fields[swap.next] = state.get(swap.state);  // swapped by the interpreter
  for (const std::string& keep : program.keeps) results.fields[keep] = state.get(keep);
  return results;
}

class Checker {
 public:
  Checker(const Module& module, const std::string& program, const adjoint::Activity& wrt, const Grid& grid, unsigned seed)
      : module_(module), program_(*module.find_program(program)), grid_(grid), random_(seed) {
    DiagnosticSink sink;
    tangent_ = adjoint::tangent(module, program, wrt, sink);
    adjoint_ = adjoint::adjoint(module, program, wrt, sink);
    EXPECT_FALSE(sink.has_errors());
    EXPECT_EQ(verify(tangent_.module), std::vector<std::string>{});
    EXPECT_EQ(verify(adjoint_.module), std::vector<std::string>{});
    active_fields_ = wrt.fields;
    for (const Swap& swap : program_.swaps) {
      if (tangent_.names.contains(swap.state)) active_fields_.insert(swap.state);
    }
    active_params_ = wrt.params;
    const Interface needs = interface_of(module, program_);
    for (const std::string& field : needs.inputs) primal_.fields[field] = draw(0.5, 1.5);
    for (const std::string& field : active_fields_) primal_.fields.emplace(field, draw(0.5, 1.5));
    for (const std::string& name : needs.params) primal_.params[name] = draw_one(0.2, 0.8);
    for (const std::string& field : active_fields_) direction_.fields[field] = draw(-1, 1);
    for (const std::string& name : active_params_) direction_.params[name] = draw_one(-1, 1);
  }

  Check check() {
    const Results dots = run_tangent();
    Check result;
    result.finite_difference = against_differences(dots);
    double forward = 0, magnitude = 0;
    Run seeded = primal_;
    for (const auto& [field, values] : dots.fields) {
      const std::vector<double> w = draw(-1, 1);
      seeded.fields[adjoint_.names.at(field)] = w;
      for (size_t i = 0; i < w.size(); ++i) {
        forward += w[i] * values[i];
        magnitude += std::abs(w[i] * values[i]);
      }
    }
    for (const std::string& sum : interface_of(module_, program_).sums) {
      if (!adjoint_.names.contains(sum)) continue;
      const double w = draw_one(-1, 1);
      seeded.params[adjoint_.names.at(sum)] = w;
      forward += w * dots.sums.at(sum);
      magnitude += std::abs(w * dots.sums.at(sum));
    }
    const double reverse = run_adjoint(seeded);
    result.dot_product = std::abs(forward - reverse) / std::max(magnitude, 1e-300);
    result.magnitude = magnitude;
    return result;
  }

 private:
  std::vector<double> draw(double low, double high) {
    std::vector<double> values(size_of(grid_));
    for (double& v : values) v = draw_one(low, high);
    return values;
  }
  double draw_one(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  /// Result dots under the primal names of the results.
  Results run_tangent() {
    Run run = primal_;
    for (const auto& [field, d] : direction_.fields) run.fields[tangent_.names.at(field)] = d;
    for (const auto& [name, d] : direction_.params) run.params[tangent_.names.at(name)] = d;
    const Results raw = run_program(tangent_.module, tangent_.program, grid_, run);
    Results dots;
    const auto take = [&](const std::string& field) {
      const auto name = tangent_.names.find(field);
      if (name != tangent_.names.end() && raw.fields.contains(name->second)) dots.fields[field] = raw.fields.at(name->second);
    };
    for (const Swap& swap : program_.swaps) take(swap.next);
    for (const std::string& keep : program_.keeps) take(keep);
    for (const std::string& sum : interface_of(module_, program_).sums) {
      const auto name = tangent_.names.find(sum);
      dots.sums[sum] = name != tangent_.names.end() && raw.sums.contains(name->second) ? raw.sums.at(name->second) : 0.0;
    }
    return dots;
  }

  double against_differences(const Results& dots) {
    const double h = 1e-6;
    const Results up = displaced(h), down = displaced(-h);
    double worst = 0, largest = 0.1;  // inputs and directions are of order 1
    for (const auto& [field, values] : dots.fields) {
      for (size_t i = 0; i < values.size(); ++i) {
        const double difference = (up.fields.at(field)[i] - down.fields.at(field)[i]) / (2 * h);
        largest = std::max(largest, std::abs(difference));
        worst = std::max(worst, std::abs(values[i] - difference));
        if (std::isnan(values[i])) return values[i];
      }
    }
    for (const auto& [sum, value] : dots.sums) {
      const double difference = (up.sums.at(sum) - down.sums.at(sum)) / (2 * h);
      largest = std::max(largest, std::abs(difference));
      worst = std::max(worst, std::abs(value - difference));
    }
    return worst / largest;
  }

  Results displaced(double h) {
    Run run = primal_;
    for (const auto& [field, d] : direction_.fields) {
      for (size_t i = 0; i < d.size(); ++i) run.fields[field][i] += h * d[i];
    }
    for (const auto& [name, d] : direction_.params) run.params[name] += h * d;
    return run_program(module_, program_.name, grid_, run);
  }

  double run_adjoint(const Run& seeded) {
    const Results raw = run_program(adjoint_.module, adjoint_.program, grid_, seeded);
    double reverse = 0;
    for (const auto& [field, d] : direction_.fields) {
      const std::vector<double>& bar = raw.fields.at(adjoint_.names.at(field));
      for (size_t i = 0; i < d.size(); ++i) reverse += bar[i] * d[i];
    }
    for (const auto& [name, d] : direction_.params) {
      const auto sum = raw.sums.find(adjoint_.names.at(name));
      if (sum != raw.sums.end()) reverse += sum->second * d;
    }
    return reverse;
  }

  const Module& module_;
  const Program& program_;
  const Grid grid_;
  std::mt19937 random_;
  adjoint::Derivative tangent_, adjoint_;
  std::set<std::string> active_fields_, active_params_;
  Run primal_, direction_;
};

}  // namespace

Module parse_module(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  Module module = from_ast(parse(source, sink), sink);
  for (const Diagnostic& diagnostic : sink.all()) ADD_FAILURE() << render_text(source, diagnostic);
  EXPECT_EQ(verify(module), std::vector<std::string>{});
  return module;
}

Check check_derivatives(const Module& module, const std::string& program, const adjoint::Activity& wrt, const Grid& grid,
                        unsigned seed) {
  return Checker(module, program, wrt, grid, seed).check();
}

}  // namespace dpde::testing
