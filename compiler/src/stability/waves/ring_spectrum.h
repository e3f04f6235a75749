// SPDX-License-Identifier: Apache-2.0
// Eigenvalues of what is the same from each cell of a ring to the next.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace dpde::stability {

/// Of `step`, which has states one behind the other, each by cells with x first. Waves along `axis` stand alone there:
/// each has a matrix with as many times fewer rows as the ring has cells. nullopt where cells of the ring differ.
std::optional<Eigen::VectorXcd> eigenvalues_on_ring(const Eigen::MatrixXd& step, const std::array<int, 3>& cells,
                                                    std::size_t axis);

}  // namespace dpde::stability
