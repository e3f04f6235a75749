// SPDX-License-Identifier: Apache-2.0
#include "solve/linear_solver.h"

#include <Eigen/QR>

#include "dpde/runtime/error.h"

namespace dpde {

std::string_view name_of(SolverMethod method) {
  switch (method) {
    case SolverMethod::automatic: return "automatic";
    case SolverMethod::direct: return "direct";
    case SolverMethod::tridiagonal: return "tridiagonal";
    case SolverMethod::fourier: return "fourier";
    case SolverMethod::multigrid: return "multigrid";
    case SolverMethod::cg: return "cg";
    case SolverMethod::bicgstab: return "bicgstab";
    case SolverMethod::gmres: return "gmres";
  }
  return "";
}

struct LinearSolver::Impl {
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  std::string reason = "a small system";
};

LinearSolver::LinearSolver(StencilMatrix matrix, SolveOptions options) : impl_(std::make_unique<Impl>()) {
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(matrix.size(), matrix.size());
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    dense(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(column)) += value;
  });
  impl_->inverse.setThreshold(64 * options.rounding * static_cast<double>(matrix.size()));
  impl_->inverse.compute(dense);
}
LinearSolver::~LinearSolver() = default;

SolveReport LinearSolver::solve(std::span<const double> b, std::span<double> x) {
  const auto size = static_cast<Eigen::Index>(b.size());
  Eigen::Map<Eigen::VectorXd>(x.data(), size) =
      impl_->inverse.solve(Eigen::Map<const Eigen::VectorXd>(b.data(), size));
  return {};
}
SolverMethod LinearSolver::method() const { return SolverMethod::direct; }
const std::string& LinearSolver::reason() const { return impl_->reason; }

}  // namespace dpde
