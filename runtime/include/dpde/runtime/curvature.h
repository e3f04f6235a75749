// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dpde {

/// The Hessian of the loss, or its Gauss-Newton approximation, which leaves out the curvature of the model and is
/// positive semidefinite.
enum class Curvature { full, gauss_newton };

}  // namespace dpde
