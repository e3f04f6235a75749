// SPDX-License-Identifier: Apache-2.0
// Detects kernels whose stores or sums jump where a condition, sign, floor or fraction switches, or where a divisor is
// 0.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "stencil/stencil.h"
#include "support/maths/piecewise.h"

namespace dpde::stencil {

/// The fields and parameters that vary, and the values of parameters.
struct Movement {
  std::function<bool(const std::string&)> moves;  // whether a field or parameter varies
  std::function<Piecewise::Symbol(const std::string&)> param;
  bool keeps_signs = true;  // divisors are assumed to keep one sign
};

struct KernelJump {
  SourceRange range;
  std::string what;              // "sign", "floor"; "" for if
  std::set<std::string> movers;  // fields and parameters that move the switch
  bool is_at_pole = false;       // division by 0
};
std::optional<KernelJump> jump_in(const Kernel& kernel, const Movement& movement);

}  // namespace dpde::stencil
