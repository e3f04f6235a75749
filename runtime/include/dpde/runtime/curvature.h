// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace dpde {

/// The Hessian of the loss, or what Gauss and Newton put in its place: without the curvature of the model, never
/// negative.
enum class Curvature { full, gauss_newton };

}  // namespace dpde
