// SPDX-License-Identifier: Apache-2.0
// Names of derivatives, common to all levels.
#pragma once

#include <string>

namespace dpde {

/// The adjoint of `name`.
inline std::string bar_of(const std::string& name) { return name + "_bar"; }

}  // namespace dpde
