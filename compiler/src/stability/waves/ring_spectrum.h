// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of a matrix that is block circulant along a periodic axis.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace dpde::stability {

/// Eigenvalues of `step`, whose vectors hold the states one after the other, each with x fastest. Fourier modes along
/// `axis` decouple: the matrix of each has rows / cells[axis] rows. nullopt if `step` is not circulant along `axis`.
std::optional<Eigen::VectorXcd> eigenvalues_on_ring(const Eigen::MatrixXd& step, const std::array<int, 3>& cells,
                                                    std::size_t axis);

}  // namespace dpde::stability
