// SPDX-License-Identifier: Apache-2.0
// Stages as substeps of a longer step: with other initial fields, another start time and another length.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/lower/lowering.h"

namespace dpde::stencil {

struct Displacement {
  std::map<std::string, std::string> begins;  // the initial field of each state, if not the state itself
  Expr time, length;                          // replace t and dt
};
std::vector<Stage> displaced(std::vector<Stage> stages, const Displacement& by);

}  // namespace dpde::stencil
