// SPDX-License-Identifier: Apache-2.0
// Whether what a kernel stores or adds up jumps where a condition, sign, floor or fraction switches, or where it
// divides by 0.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "stencil/stencil.h"
#include "support/maths/piecewise.h"

namespace dpde::stencil {

/// What moves, and the values that parameters have.
struct Movement {
  std::function<bool(const std::string&)> moves;  // of fields and parameters
  std::function<Piecewise::Symbol(const std::string&)> param;
  bool keeps_signs = true;  // fields that something is divided by have one for which it is written
};

struct KernelJump {
  SourceRange range;
  std::string what;              // "sign", "floor"; "" for if
  std::set<std::string> movers;  // fields and parameters that move the switch
  bool is_at_pole = false;       // where something is divided by 0
};
std::optional<KernelJump> jump_in(const Kernel& kernel, const Movement& movement);

}  // namespace dpde::stencil
