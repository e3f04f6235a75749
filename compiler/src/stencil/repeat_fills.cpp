// SPDX-License-Identifier: Apache-2.0
#include "stencil/repeat_fills.h"

#include <set>

#include "stencil/build.h"
#include "stencil/effects.h"

namespace dpde::stencil {

std::vector<Statement> fills_for(const Module& module, const Repeat& repeat,
                                 const std::map<std::string, Fill>& filled) {
  std::set<std::string> known;  // filled in the block, or by no fill from before it
  for (const Carry& carry : repeat.carries) known.insert(carry.state);
  for (const Stacked& load : repeat.loads) known.insert(load.field);
  std::vector<Statement> fills;
  for (const Statement& statement : repeat.body) {
    const Effects e = effects(module, statement);
    for (const auto* fields : {&e.fills, &e.writes}) known.insert(fields->begin(), fields->end());
    if (!e.inner.empty()) continue;  // a repeat has fills of its own
    for (const std::string& kernel : e.kernels) {
      for (const Signature::Read& read : signature(*module.find_kernel(kernel)).reads) {
        const bool is_around = read.interpolated || read.halo != std::array<int, max_rank>{};
        const auto fill = filled.find(read.field);
        if (is_around && fill != filled.end() && known.insert(read.field).second) fills.push_back(fill->second);
      }
    }
  }
  return fills;
}

}  // namespace dpde::stencil
