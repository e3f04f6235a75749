// SPDX-License-Identifier: Apache-2.0
// The programs that derivatives and back ends are compared on have every kind of statement, expression and boundary: a
// kind that is added needs a case.
#include "support/program_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/derivative_check.h"

namespace dpde::testing {
namespace {

struct Kinds {
  std::set<std::size_t> statements, expressions;
  std::set<SideKind> sides;
};

void add_boundary(const std::vector<stencil::AxisBoundary>& axes, Kinds& kinds) {
  for (const stencil::AxisBoundary& axis : axes) {
    if (axis.topology == Topology::bounded) kinds.sides.insert({axis.low.kind, axis.high.kind});
  }
}

void add(const stencil::Module& module, Kinds& kinds) {
  const auto look = [&](const stencil::Expr& part) { kinds.expressions.insert(part->kind.index()); };
  for (const stencil::Kernel& kernel : module.kernels) {
    for (const stencil::Let& let : kernel.lets) visit(let.value, look);
    for (const stencil::Store& store : kernel.stores) visit(store.value, look);
  }
  for (const stencil::Program& program : module.programs) {
    for_each_statement(program.body, [&](const stencil::Statement& statement) {
      kinds.statements.insert(statement.index());
      if (const auto* fill = std::get_if<stencil::Fill>(&statement)) add_boundary(fill->axes, kinds);
    });
  }
}

template <class... All>
constexpr std::size_t count_of(const std::variant<All...>*) {
  return sizeof...(All);
}

/// Folds are made by adjoints alone.
TEST(ProgramCases, HaveEachKind) {
  Kinds kinds;
  for (const std::vector<ProgramCase>& cases : {program_cases(), network_cases()}) {
    for (const ProgramCase& one : cases) {
      const stencil::Module module = parse_module(one.text);
      add(module, kinds);
      DiagnosticSink sink;
      add(adjoint::adjoint(module, "p", one.wrt, sink).module, kinds);
    }
  }
  for (std::size_t i = 0; i < count_of(static_cast<stencil::Statement*>(nullptr)); ++i)
    EXPECT_TRUE(kinds.statements.contains(i)) << "no case has the statement " << i;
  for (std::size_t i = 0; i < std::variant_size_v<stencil::Kind>; ++i)
    EXPECT_TRUE(kinds.expressions.contains(i)) << "no case has the expression " << i;
  for (const SideCondition& condition : side_condition_table()) {
    if (condition.level == SideCondition::Level::models) continue;
    EXPECT_TRUE(kinds.sides.contains(condition.kind)) << "no case has " << condition.usage;
  }
}

}  // namespace
}  // namespace dpde::testing
