// SPDX-License-Identifier: Apache-2.0
// One run of a program and of its derivatives with random inputs, for certificates of single programs.
#pragma once

#include <map>
#include <random>
#include <string>
#include <vector>

#include "analysis/certificate/certificate.h"
#include "driver/compile/pipeline.h"
#include "driver/scene/workspace.h"
#include "stencil/build.h"

namespace dpde::analysis {

/// One program with its derivatives on one grid. Inputs without a value in `problem` are random.
class ProgramCheck {
 public:
  /// `tangents`: code of `tangent`; program and adjoint are those of `compiled`.
  ProgramCheck(const driver::Compiled& compiled, const stencil::Program& program, const adjoint::Derivative& tangent,
               const codegen::CompiledModule& tangents, const model::Problem& problem, const std::vector<int>& cells,
               std::mt19937_64& random);

  /// Errors are relative to the larger number and to a thousandth (single precision: a tenth) of the sum of the terms'
  /// magnitudes. For an error above the limit, rounding is measured and recorded.
  DotCase dot_product(bool single = false);
  /// Adds remainders of the gradient, and their slope.
  void taylor(Certificate& certificate);

 private:
  using Values = std::vector<double>;

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Values randoms(double low, double high);
  std::vector<std::string> results() const;
  void choose_inputs();
  void choose_weight_rates();
  void choose_seeds();
  double functional();
  double forward();
  double backward(double& scale);
  void set_inputs();
  double rounding(double epsilon);

  const driver::Compiled& compiled_;
  const adjoint::Derivative &tangent_, &adjoint_;
  const stencil::Program& program_;
  const dpde_program& tangent_code_;
  stencil::Interface interface_;
  std::mt19937_64& random_;
  Workspace workspace_, forward_;                                   // of program and adjoint; of the tangent
  std::map<std::string, Values> inputs_, rates_, seeds_;            // fields by primal name
  std::map<std::string, Values> weight_rates_;                      // by network
  std::map<std::string, double> params_, param_rates_, sum_seeds_;  // scalars by primal name
};

}  // namespace dpde::analysis
