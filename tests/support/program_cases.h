// SPDX-License-Identifier: Apache-2.0
// Programs that together use every kind of node, boundary and statement, and small grids for them.
#pragma once

#include <string>
#include <vector>

#include "adjoint/adjoint.h"
#include "stencil/interpret/interpret.h"
#include "support/setting.h"

namespace dpde::testing {

struct ProgramCase {
  std::string name;
  int rank;
  std::string text;  // program `p`
  adjoint::Activity wrt;
};

std::vector<ProgramCase> program_cases();
/// All at night; by day about every `every`-th, from `first` on.
inline std::vector<ProgramCase> cases_by_day(std::size_t first, std::size_t every) {
  std::vector<ProgramCase> all = program_cases(), chosen;
  if (is_thorough()) return all;
  for (std::size_t i = first; i < all.size(); i += every) chosen.push_back(all[i]);
  return chosen;
}
/// Programs with repeats, part of program_cases().
std::vector<ProgramCase> repeat_cases();
/// Programs with poles, part of program_cases().
std::vector<ProgramCase> pole_cases();
/// Programs with solves, part of program_cases().
std::vector<ProgramCase> solve_cases();
/// Programs with networks whose weights are unknowns, too; these have no second derivatives.
std::vector<ProgramCase> network_cases();

/// Every extent from 1 to 7 in 1-D, all of 1..4 x 1..4 in 2-D, a selection in 3-D.
std::vector<stencil::Grid> small_grids(int rank);

}  // namespace dpde::testing
