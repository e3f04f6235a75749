// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/counters_from_ast.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "stencil/analyse/effects.h"
#include "support/names/bound_names.h"
#include "syntax/expand/blocks.h"

namespace dpde::stencil {

void check_counters(const Module& module, const Program& program, const ast::Program& source,
                    const std::vector<std::string>& fields, DiagnosticSink& sink) {
  std::set<std::string> taken(fields.begin(), fields.end());
  for (const Statement& statement : program.body) {
    const Effects e = effects(module, statement);  // without the counter, if it is a repeat
    taken.insert(e.params.begin(), e.params.end());
  }
  const auto is_taken = [&](const std::string& name) {
    return taken.contains(name) || find_bound_name(name) != nullptr;
  };
  const auto free_name = [&] {
    const std::vector<std::string> usual{"k", "i", "j", "n", "pass"};
    const auto free = std::ranges::find_if_not(usual, is_taken);
    return fmt::format("choose another name{}", free == usual.end() ? "" : fmt::format(": repeat {} in ...", *free));
  };
  ast::for_each_item(source.items, [&](const ast::Item& item) {
    const auto* repeat = get_if<ast::RepeatItem>(&item.kind);
    if (!repeat || !repeat->counter || !is_taken(repeat->counter->name)) return;
    const BoundName* known = find_bound_name(repeat->counter->name);
    sink.report("bad-program", repeat->counter->range,
                {fmt::format("program {} counts the passes of a repeat by {}, which is {}", program.name,
                             repeat->counter->name, known ? known->meaning : "a field or a param of it")},
                free_name());
  });
}

}  // namespace dpde::stencil
