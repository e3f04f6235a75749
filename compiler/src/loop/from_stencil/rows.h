// SPDX-License-Identifier: Apache-2.0
// One stencil kernel as row functions: streams, uniforms, regrouped products, small powers as products.
#pragma once

#include <vector>

#include "loop/from_stencil/uniforms.h"
#include "loop/loop.h"
#include "stencil/stencil.h"

namespace dpde::loop {

/// The rows of a kernel in the order in which they run: one for stores and sums, one (NAME_scatter) for scatters.
/// `grow` is that of the run: points outside the run's region need no masks.
std::vector<Row> rows_of(const stencil::Kernel& kernel, const std::vector<Topology>& axes, int grow,
                         UniformTable& uniforms);

/// Whether the rows of the kernel differ between axes and regions.
bool depends_on_axes(const stencil::Kernel& kernel);

/// An expression of parameters and numbers as the definition of a uniform.
Expr uniform_definition(const stencil::Expr& e, UniformTable& uniforms);

}  // namespace dpde::loop
