// SPDX-License-Identifier: Apache-2.0
// What grows in a step, in shorter ones. Noise of a few steps does not tell it there, the vector of the step does: that
// of short steps is nearly the same.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>

#include "stability/coupled_means.h"
#include "stability/eigenvalues.h"

namespace dpde::stability {

namespace {

constexpr int most_near_vector = 8;

stencil::Params at_step(stencil::Params params, double step) {
  params["dt"] = step;
  return params;
}

}  // namespace

Eigen::MatrixXd CoupledRuns::largest_vector(double step, const Eigen::MatrixXd& start) const {
  const KrylovSpace space = runs_.on_krylov_space(at_step(params_, step), start, most_of_space(start));
  if (space.matrix.rows() == 0) return start;
  const Eigen::EigenSolver<Eigen::MatrixXd> of_space(space.matrix);
  if (of_space.info() != Eigen::Success) return start;
  Eigen::Index which = 0, largest = 0;
  of_space.eigenvalues().cwiseAbs().maxCoeff(&which);
  Eigen::VectorXcd vector = of_space.eigenvectors().col(which);
  vector.cwiseAbs().maxCoeff(&largest);
  vector *= std::conj(vector[largest]) / std::abs(vector[largest]);
  const Eigen::VectorXd all = space.basis * vector.real();
  return all.reshaped(start.rows(), start.cols());
}

/// The eigenvalue whose vector is nearest to it, which is the first of the basis.
std::optional<double> CoupledRuns::growth_of_vector(const TangentRuns& runs, double step,
                                                    const Eigen::MatrixXd& vector) const {
  const KrylovSpace space = runs.on_krylov_space(at_step(params_, step / parts_), vector, most_near_vector);
  if (space.matrix.rows() == 0) return std::nullopt;
  const Eigen::EigenSolver<Eigen::MatrixXd> of_space(space.matrix);
  if (of_space.info() != Eigen::Success) return std::nullopt;
  Eigen::Index which = 0;
  of_space.eigenvectors().row(0).cwiseAbs().maxCoeff(&which);
  return (std::log(std::abs(of_space.eigenvalues()[which])) - by_events_) * parts_;
}

}  // namespace dpde::stability
