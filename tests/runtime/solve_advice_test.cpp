// SPDX-License-Identifier: Apache-2.0
#include "solve/solver/solve_advice.h"

#include <gtest/gtest.h>

#include "solve_operators.h"

namespace dpde::test {
namespace {

/// The suggested method solves the system.
TEST(SolveAdvice, IsTrueForTheOperator) {
  const auto advice = [](const StencilMatrix& matrix, SolverMethod failed, int iterations, double residual) {
    SolveReport report;
    report.method = failed;
    report.iterations = iterations;
    report.residual = residual;
    report.bound = 1e-12;
    return advice_on(std::make_shared<const GridOperator>(matrix, 0x1p-52), {.method = failed},
                     arbitrary_values(matrix.size(), 3), report);
  };
  StencilMatrix unsymmetric = diffusion({12, 9, 1}, {all_walls[1], all_walls[1], all_walls[0]}, 1, constant_one);
  for (std::size_t k = 0; k < unsymmetric.offsets.size(); ++k) {
    if (unsymmetric.offsets[k][0] == 1) {
      for (double& value : unsymmetric.values[k]) value *= 0.5;
    }
  }
  const std::string of_unsymmetric = advice(unsymmetric, SolverMethod::bicgstab, 200, 0.9);
  EXPECT_EQ(of_unsymmetric.find("cg"), std::string::npos) << of_unsymmetric;
  EXPECT_NE(of_unsymmetric.find("direct"), std::string::npos) << of_unsymmetric;
  const StencilMatrix indefinite = diffusion({8, 8, 1}, {all_walls[1], all_walls[1], all_walls[0]}, -35, constant_one);
  const std::string of_indefinite = advice(indefinite, SolverMethod::cg, 3, 2);
  EXPECT_EQ(of_indefinite.find("multigrid"), std::string::npos) << of_indefinite;
  EXPECT_NE(of_indefinite.find("direct"), std::string::npos) << of_indefinite;
  SolveReport singular;
  singular.is_singular = true;
  const auto same = std::make_shared<const GridOperator>(indefinite, 0x1p-52);
  EXPECT_NE(advice_on(same, {}, arbitrary_values(64, 1), singular).find("a value at a wall"), std::string::npos);
}

}  // namespace
}  // namespace dpde::test
