// SPDX-License-Identifier: Apache-2.0
#include "support/derivative_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "source/render.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/text/from_ast.h"
#include "support/split_mix.h"
#include "syntax/parser.h"

namespace dpde::testing {

using namespace stencil;

namespace {

using Values = std::map<std::string, std::vector<double>>;

/// Initial values and results of one run of a program.
struct Run {
  Values fields;
  Params params;
  std::map<std::string, Weights> weights;
};
struct Results {
  Values fields;
  std::map<std::string, double> sums;
  std::map<std::string, Weights> weights;
};

size_t size_of(const Grid& grid) { return static_cast<size_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2]; }

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
  state.weights = run.weights;
  Results results;
  results.sums = interpret(module, program, state, run.params);
  results.weights = state.weights;
  for (const Swap& swap : program.swaps)
    results.fields[swap.next] = state.get(swap.state);  // already swapped by the interpreter
  for (const std::string& keep : program.keeps) results.fields[keep] = state.get(keep);
  return results;
}

class Checker {
 public:
  Checker(const Module& module, const std::string& program, const Derivatives& derived, const adjoint::Activity& wrt,
          const Grid& grid, std::uint64_t seed)
      : module_(module),
        program_(*module.find_program(program)),
        grid_(grid),
        random_(seed),
        tangent_(derived.tangent),
        adjoint_(derived.adjoint) {
    active_fields_ = wrt.fields;
    for (const Swap& swap : program_.swaps) {
      if (tangent_.field(swap.state) != nullptr) active_fields_.insert(swap.state);
    }
    active_params_ = wrt.params;
    const Interface needs = interface_of(module, program_);
    for (const std::string& field : needs.inputs) primal_.fields[field] = draw(0.5, 1.5);
    for (const std::string& field : active_fields_) primal_.fields.emplace(field, draw(0.5, 1.5));
    for (const std::string& name : needs.params) primal_.params[name] = draw_one(0.2, 0.8);
    for (const std::string& field : active_fields_) direction_.fields[field] = draw(-1, 1);
    for (const network::Network& network : module.networks) {
      const auto count = static_cast<size_t>(weight_count(network));
      primal_.weights[network.name].values = random_.uniform(count, -0.5, 0.5);
      if (active_params_.erase(network.name) > 0) primal_.weights[network.name].rates = random_.uniform(count, -1, 1);
    }
    for (const std::string& name : active_params_) direction_.params[name] = draw_one(-1, 1);
  }

  Check check() {
    const Results dots = run_tangent(primal_);
    Check result;
    against_differences(dots, result);
    double forward = 0, magnitude = 0;
    Run seeded = primal_;
    for (const auto& [field, values] : dots.fields) {
      const std::vector<double> w = draw(-1, 1);
      seeded.fields[*adjoint_.field(field)] = w;
      for (size_t i = 0; i < w.size(); ++i) {
        forward += w[i] * values[i];
        magnitude += std::abs(w[i] * values[i]);
      }
    }
    for (const std::string& sum : interface_of(module_, program_).sums) {
      const std::string* const bar = adjoint_.sum(sum);
      if (bar == nullptr) continue;
      const double w = draw_one(-1, 1);
      seeded.params[*bar] = w;
      forward += w * dots.sums.at(sum);
      magnitude += std::abs(w * dots.sums.at(sum));
    }
    double reverse_magnitude = 0;
    const double reverse = run_adjoint(seeded, reverse_magnitude);
    result.dot_product = std::abs(forward - reverse) / std::max({magnitude, reverse_magnitude, 1e-300});
    result.forward = forward;
    result.reverse = reverse;
    result.magnitude = magnitude;
    return result;
  }

 private:
  std::vector<double> draw(double low, double high) { return random_.uniform(size_of(grid_), low, high); }
  double draw_one(double low, double high) { return random_.uniform(low, high); }

  /// Derivatives of the results, under the names of the primal results.
  Results run_tangent(Run run) {
    for (const auto& [field, d] : direction_.fields) run.fields[*tangent_.field(field)] = d;
    for (const auto& [name, d] : direction_.params) run.params[*tangent_.param(name)] = d;
    const Results raw = run_program(tangent_.module, tangent_.program, grid_, run);
    Results dots;
    const auto take = [&](const std::string& field) {
      const std::string* const dot = tangent_.field(field);
      if (dot != nullptr && raw.fields.contains(*dot)) dots.fields[field] = raw.fields.at(*dot);
    };
    for (const Swap& swap : program_.swaps) take(swap.next);
    for (const std::string& keep : program_.keeps) take(keep);
    for (const std::string& sum : interface_of(module_, program_).sums) {
      const std::string* const dot = tangent_.sum(sum);
      dots.sums[sum] = dot != nullptr && raw.sums.contains(*dot) ? raw.sums.at(*dot) : 0.0;
    }
    return dots;
  }

  /// The smallest error over several steps h: rounding grows as 1/h, curvature as h^2.
  void against_differences(const Results& dots, Check& result) {
    const Results base = displaced(0);
    result.finite_difference = INFINITY;
    std::vector<double> before;
    for (const double h : {1e-6, 1e-5, 1e-4, 1e-7}) {
      const Results up = displaced(h), down = displaced(-h);
      double worst = 0, bend = 0, largest = 0.1;  // inputs and directions are of order 1
      double spread = 0;                          // at least the rounding error of the values
      std::vector<double> differences;
      const auto add = [&](double value, double above, double here, double below) {
        const double difference = (above - below) / (2 * h), error = std::abs(value - difference);
        largest = std::max(largest, std::abs(difference));
        spread = std::max(spread, 0x1p-51 * std::max(std::abs(above), std::abs(below)) / h);
        differences.push_back(difference);
        worst = std::isfinite(error) ? std::max(worst, error) : INFINITY;
        bend = std::max(bend, std::abs(above - 2 * here + below) / h);
      };
      for (const auto& [field, values] : dots.fields) {
        for (size_t i = 0; i < values.size(); ++i) {
          add(values[i], up.fields.at(field)[i], base.fields.at(field)[i], down.fields.at(field)[i]);
        }
      }
      for (const auto& [sum, value] : dots.sums) add(value, up.sums.at(sum), base.sums.at(sum), down.sums.at(sum));
      if (worst / largest < result.finite_difference) result.finite_difference = worst / largest;
      result.bend = bend / largest;
      if (result.finite_difference < 1e-6) return;
      for (size_t i = 0; i < before.size(); ++i) spread = std::max(spread, std::abs(differences[i] - before[i]));
      if (!before.empty()) result.spread = std::min(result.spread, spread / largest);
      before = std::move(differences);
      result.change = change_over(h, dots) / largest;
    }
  }

  /// The largest change of J d over several points within half a step. A wave much shorter than the step has
  /// differences of bounded size, but its slope changes by its full size. With few points all may have the same slope
  /// by chance.
  double change_over(double h, const Results& dots) {
    double change = 0;
    const auto add = [&](double there, double here) { change = std::max(change, std::abs(there - here)); };
    for (const double part : {-0.5, -0.382, -0.264, -0.146, -0.028, 0.09, 0.208, 0.326, 0.444, 0.5}) {
      const Results there = run_tangent(at(part * h));
      for (const auto& [field, values] : dots.fields) {
        for (size_t i = 0; i < values.size(); ++i) add(there.fields.at(field)[i], values[i]);
      }
      for (const auto& [sum, value] : dots.sums) add(there.sums.at(sum), value);
    }
    return change;
  }

  Results displaced(double h) { return run_program(module_, program_.name, grid_, at(h)); }

  Run at(double h) const {
    Run run = primal_;
    for (const auto& [field, d] : direction_.fields) {
      for (size_t i = 0; i < d.size(); ++i) run.fields[field][i] += h * d[i];
    }
    for (const auto& [name, d] : direction_.params) run.params[name] += h * d;
    for (auto& [name, weights] : run.weights) {
      for (size_t i = 0; i < weights.rates.size(); ++i) weights.values[i] += h * weights.rates[i];
    }
    return run;
  }

  double run_adjoint(const Run& seeded, double& magnitude) {
    const Results raw = run_program(adjoint_.module, adjoint_.program, grid_, seeded);
    double reverse = 0;
    const auto add = [&](double term) {
      reverse += term;
      magnitude += std::abs(term);
    };
    for (const auto& [field, d] : direction_.fields) {
      const std::vector<double>& bar = raw.fields.at(*adjoint_.field(field));
      for (size_t i = 0; i < d.size(); ++i) add(bar[i] * d[i]);
    }
    for (const auto& [name, d] : direction_.params) {
      const auto sum = raw.sums.find(*adjoint_.param(name));
      if (sum != raw.sums.end()) add(sum->second * d);
    }
    for (const auto& [name, weights] : raw.weights) {
      for (size_t i = 0; i < weights.rates.size() && !weights.bars.empty(); ++i)
        add(weights.rates[i] * weights.bars[i]);
    }
    return reverse;
  }

  const Module& module_;
  const Program& program_;
  const Grid grid_;
  SplitMix random_;
  const adjoint::Derivative &tangent_, &adjoint_;
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

Check check_derivatives(const Module& module, const std::string& program, const adjoint::Activity& wrt,
                        const Grid& grid, std::uint64_t seed) {
  DiagnosticSink sink;
  const Derivatives derived{adjoint::tangent(module, program, wrt, sink), adjoint::adjoint(module, program, wrt, sink)};
  EXPECT_FALSE(sink.has_errors());
  EXPECT_EQ(verify(derived.tangent.module), std::vector<std::string>{});
  EXPECT_EQ(verify(derived.adjoint.module), std::vector<std::string>{});
  return check_derivatives(module, program, derived, wrt, grid, seed);
}

Check check_derivatives(const Module& module, const std::string& program, const Derivatives& derived,
                        const adjoint::Activity& wrt, const Grid& grid, std::uint64_t seed) {
  return Checker(module, program, derived, wrt, grid, seed).check();
}

}  // namespace dpde::testing
