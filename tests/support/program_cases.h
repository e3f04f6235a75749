// SPDX-License-Identifier: Apache-2.0
// Programs that between them use every kind of node, boundary and statement, and the small grids they are tried on.
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
/// All at night, by day every third or so from one on.
inline std::vector<ProgramCase> cases_by_day(std::size_t first, std::size_t every) {
  std::vector<ProgramCase> all = program_cases(), chosen;
  if (is_thorough()) return all;
  for (std::size_t i = first; i < all.size(); i += every) chosen.push_back(all[i]);
  return chosen;
}
/// Those of them that have repeats.
std::vector<ProgramCase> repeat_cases();
/// Poles: in program_cases(), too.
std::vector<ProgramCase> pole_cases();
/// Those of them that have solves.
std::vector<ProgramCase> solve_cases();
/// Programs that apply networks, whose weights vary too: these have no second derivatives.
std::vector<ProgramCase> network_cases();

/// Every extent from 1 to 7 in 1-D, all of 1..4 x 1..4 in 2-D, a selection of them in 3-D.
std::vector<stencil::Grid> small_grids(int rank);

}  // namespace dpde::testing
