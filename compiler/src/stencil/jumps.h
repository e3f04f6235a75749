// SPDX-License-Identifier: Apache-2.0
// Whether what a kernel stores or adds up jumps where a condition, sign, floor or fraction switches.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// What moves, and the values of parameters that do not.
struct Movement {
  std::function<bool(const std::string&)> moves;  // of fields and parameters
  std::function<std::optional<double>(const std::string&)> value;
};

struct KernelJump {
  SourceRange range;
  std::set<std::string> movers;  // fields and parameters that move the switch
};
std::optional<KernelJump> jump_in(const Kernel& kernel, const Movement& movement);

}  // namespace dpde::stencil
