// SPDX-License-Identifier: Apache-2.0
// Runs lowered problems with the reference interpreter.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/lower/from_model.h"
#include "stencil/stencil_text.h"

namespace scene_run {

/// The module of a problem without errors; it is valid and its text reads back as the same module.
inline dpde::stencil::Module lower(const dpde::model::Problem& problem) {
  dpde::DiagnosticSink sink;
  dpde::stencil::Module module = dpde::stencil::from_model(problem, dpde::stencil::program_names(problem), sink);
  for (const dpde::Diagnostic& diagnostic : sink.all()) ADD_FAILURE() << diagnostic.message;
  EXPECT_EQ(dpde::stencil::verify(module), std::vector<std::string>{});
  const std::string text = dpde::stencil::print(module);
  const dpde::stencil::Module read = dpde::stencil::module_of(text);
  EXPECT_EQ(dpde::stencil::print(read), text);
  EXPECT_TRUE(read == module) << text;
  return module;
}

/// One scene: its fields and parameters, and the means to run its programs.
class Scene {
 public:
  explicit Scene(const dpde::model::Problem& problem, dpde::stencil::Params params = {})
      : problem_(problem), module_(lower(problem)), state_(grid(problem), 6), params_(std::move(params)) {
    double cells = 1;
    for (std::size_t a = 0; a < problem.axes.size(); ++a) {
      const dpde::model::Axis& axis = problem.axes[a];
      state_.set_coordinate(static_cast<int>(a), axis.topology, axis.low, axis.spacing());
      params_[std::string("h") + "xyz"[a]] = axis.spacing();
      cells *= axis.cells;
    }
    params_["cells"] = cells;
    params_["dt"] = problem.step;
    params_["t"] = problem.t_begin;
  }

  /// Sets a field from a function of x (one axis).
  void set(const std::string& field, const std::function<double(double)>& f) {
    std::vector<double> values;
    for (int i = 0; i < cells(); ++i) values.push_back(f(x(i)));
    state_.set(field, values);
  }
  void set(const std::string& field, const std::vector<double>& values) { state_.set(field, values); }
  std::vector<double> get(const std::string& field) const { return state_.get(field); }

  /// Runs a program once and returns its sums.
  std::map<std::string, double> run(const std::string& program) {
    return dpde::stencil::interpret(module_, *module_.find_program(program), state_, params_);
  }
  void step(int steps) {
    for (int n = 0; n < steps; ++n) {
      params_["t"] = problem_.t_begin + time_steps_++ * problem_.step;
      run(problem_.scene + "_step");
    }
  }

  /// Largest |field - f(x)| over the cells of the only axis.
  double error(const std::string& field, const std::function<double(double)>& f) const {
    const std::vector<double> values = get(field);
    double worst = 0;
    for (int i = 0; i < cells(); ++i) {
      const double difference = std::abs(values[i] - f(x(i)));
      if (!(difference <= worst)) worst = difference;  // NaN counts
    }
    return worst;
  }

  int cells() const { return problem_.axes[0].cells; }
  double x(int i) const { return problem_.axes[0].low + (i + 0.5) * problem_.axes[0].spacing(); }
  const dpde::stencil::Module& module() const { return module_; }

 private:
  static dpde::stencil::Grid grid(const dpde::model::Problem& problem) {
    dpde::stencil::Grid grid;
    grid.rank = static_cast<int>(problem.axes.size());
    for (int a = 0; a < grid.rank; ++a) grid.cells[a] = problem.axes[a].cells;
    return grid;
  }

  dpde::model::Problem problem_;
  dpde::stencil::Module module_;
  dpde::stencil::State state_;
  dpde::stencil::Params params_;
  int time_steps_ = 0;
};

/// log2 of how much smaller the error is when everything is halved once.
inline double order(const std::function<double(int)>& error_at, int coarse) {
  const double before = error_at(coarse), after = error_at(2 * coarse);
  EXPECT_GT(after, 0);
  return std::log2(before / after);
}

}  // namespace scene_run
