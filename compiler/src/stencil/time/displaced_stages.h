// SPDX-License-Identifier: Apache-2.0
// Stages as parts of a longer step: they begin with other fields, at another time, and take another time.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

struct Displacement {
  std::map<std::string, std::string> begins;  // what stands for a state where they begin; else itself
  Expr time, length;                          // in the place of t and dt
};
std::vector<Stage> displaced(std::vector<Stage> stages, const Displacement& by);

}  // namespace dpde::stencil
