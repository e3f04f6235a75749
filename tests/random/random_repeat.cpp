// SPDX-License-Identifier: Apache-2.0
#include "random/random_repeat.h"

#include <algorithm>
#include <map>

#include "stencil/build.h"

namespace dpde::testing {

using namespace stencil;

namespace {

/// Numbers in what passes compute, and beyond their walls.
void count_passes(Module& module, Repeat& repeat, SplitMix& random) {
  if (std::ranges::any_of(module.kernels, [](const Kernel& kernel) { return !kernel.custom_adjoints.empty(); })) return;
  repeat.counter = {"k", random.percent(50)};
  const std::map<std::string, Expr> counted{{"dt", param("dt") * (1.0 + 0.25 * param("k"))},
                                            {"g", param("g") + 0.1 * param("k")}};
  const auto with_number = [&](const Expr& e) { return substitute_params(e, counted); };
  for (Kernel& kernel : module.kernels) kernel = map_expressions(kernel, with_number);
  for (Statement& statement : repeat.body) {
    if (Fill* fill = std::get_if<Fill>(&statement)) fill->axes = map_sides(fill->axes, with_number);
  }
}

}  // namespace

void repeat_it(Module& module, Program& program, SplitMix& random) {
  if (program.swaps.empty()) return;
  const auto known = interface_of(module, program);
  const auto is_written = [&](const std::string& field) { return std::ranges::count(known.written, field) > 0; };
  if (std::ranges::any_of(program.swaps, [&](const Swap& swap) { return is_written(swap.state); })) return;
  Repeat repeat{2 + random.below(3), std::move(program.body), {}};
  if (random.percent(50)) count_passes(module, repeat, random);
  Kernel tame{"tame", static_cast<int>(program.axes.size()), {}, {}, {}, {}};
  for (Swap& swap : program.swaps) {
    const std::string next = swap.state + "_tame", last = swap.state + "_last";
    tame.stores.push_back({next, false, 1.0 + 0.5 * call(Fn::sin, {access(swap.next)}), {}});
    repeat.carries.push_back({swap.state, next, last});
    swap.next = last;
  }
  repeat.body.push_back(Run{tame.name, 0});
  module.kernels.push_back(std::move(tame));
  program.keeps.clear();
  program.body = {std::move(repeat)};
}

}  // namespace dpde::testing
