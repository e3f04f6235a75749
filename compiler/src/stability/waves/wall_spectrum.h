// SPDX-License-Identifier: Apache-2.0
// Growth between walls and by networks, which Fourier modes do not show: the eigenvalues of a step's tangent on a small
// grid with the scene's boundary conditions and spacings. All else is frozen at one point.
#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"
#include "stability/step/compiled_tangent.h"
#include "stability/step/linear_step.h"
#include "stencil/interpret/interpret.h"

namespace dpde::stability {

/// Eigenvalues on at most 24, 8 x 8 or 5 x 5 x 5 cells, fewer with many states; with networks on 24, 4 x 4 or
/// 4 x 4 x 4. Empty if the tangent is not finite.
class WallSpectrum {
 public:
  WallSpectrum(const LinearStep& linear, std::vector<model::Axis> axes,
               std::map<std::string, stencil::Weights> weights = {})
      : linear_(linear), axes_(std::move(axes)), weights_(std::move(weights)) {}
  Eigen::VectorXcd eigenvalues(const FrozenPoint& point, double step) const;

 private:
  const LinearStep& linear_;
  std::vector<model::Axis> axes_;
  std::map<std::string, stencil::Weights> weights_;
  mutable std::unique_ptr<CompiledTangent> compiled_;  // made at the first call with many columns; else null
  mutable bool was_tried_ = false;
};
/// The cells of that grid along each axis, for this number of states.
std::vector<int> cells_between_walls(const std::vector<model::Axis>& axes, std::size_t states);
/// The number of cells of that grid with networks: fewer in two and three dimensions.
double cells_with_networks_along(const std::vector<model::Axis>& axes);

}  // namespace dpde::stability
