// SPDX-License-Identifier: Apache-2.0
#include "stability/state_groups.h"

#include <utility>

#include "adjoint/reverse/plan.h"

namespace dpde::stability {

std::vector<StateGroup> state_groups(const stencil::Module& module, const std::string& step) {
  const stencil::Program* program = module.find_program(step);
  if (program == nullptr || program->swaps.size() < 2) return {{}};
  std::vector<std::set<std::string>> reached;  // by each state, in any number of steps
  for (const stencil::Swap& swap : program->swaps)
    reached.push_back(adjoint::find_varied(module, *program, {{swap.state}, {}}).fields);
  std::vector<StateGroup> groups;
  StateGroup seen;
  for (std::size_t i = 0; i < program->swaps.size(); ++i) {
    if (seen.contains(program->swaps[i].state)) continue;
    StateGroup group;
    for (std::size_t j = i; j < program->swaps.size(); ++j) {
      const std::string &first = program->swaps[i].state, &other = program->swaps[j].state;
      if (reached[i].contains(other) && reached[j].contains(first)) group.insert(other);
    }
    seen.insert(group.begin(), group.end());
    groups.push_back(std::move(group));
  }
  return groups.size() == 1 ? std::vector<StateGroup>{{}} : groups;
}

}  // namespace dpde::stability
