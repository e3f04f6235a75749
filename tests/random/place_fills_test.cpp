// SPDX-License-Identifier: Apache-2.0
// Programs give the same bits if their fills are removed and placed again by the boundary rules of their fields.
// DPDE_RANDOM_PROGRAMS: how many (100); DPDE_RANDOM_SEED: the first of their seeds (1).
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "random/variants.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/text/print_stencil.h"
#include "stencil/walk.h"
#include "support/halo_rules.h"
#include "support/program_cases.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using namespace stencil;

/// Whether fields go on in one way in the statements and in their blocks, and nothing else makes a halo of them: what
/// is computed beyond walls and filled later has none of its own in between, which rules do not say.
bool has_one_rule_each(const Module& module, const std::vector<Statement>& body) {
  std::map<std::string, Fill> first;
  std::set<std::string> beyond;
  bool good = true;
  for (const Statement& statement : body) {
    match(
        statement,
        [&](const Fill& fill) {
          const Fill& known = first.try_emplace(fill.field, fill).first->second;
          good = good && known == fill;
        },
        [&](const Fold& fold) { beyond.insert(fold.field); }, [](const Reduce&) {}, [](const NetworkCall&) {},
        [](const Transform&) {},
        [&](const Run& run) {
          const Effects e = effects(module, run);
          if (run.grow > 0) beyond.insert(e.writes.begin(), e.writes.end());
        },
        [&](const Solve& solve) { good = good && has_one_rule_each(module, solve.body); },
        [&](const Repeat& repeat) { good = good && has_one_rule_each(module, repeat.body); });
  }
  return good && std::ranges::none_of(beyond, [&](const std::string& field) { return first.contains(field); });
}

int fills_in(const Program& program) {
  int count = 0;
  for_each_kind<Fill>(program.body, [&](const Fill&) { ++count; });
  return count;
}

struct Compared {
  int programs = 0, fills = 0, fewer = 0;
};

void expect_same_bits(const Module& written, const Grid& grid, std::uint64_t seed, Compared& count) {
  const Program& program = written.programs.front();
  if (!has_one_rule_each(written, program.body) || fills_in(program) == 0) return;
  Module placed = with_rules(written);
  EXPECT_EQ(fills_in(placed.programs.front()), 0);
  place_fills(placed);
  EXPECT_EQ(verify(placed), std::vector<std::string>{}) << print(placed);
  const RunInputs inputs = inputs_for(written, program.name, grid, seed);
  const Outcome expected = run_interpreted(written, program, inputs);
  const Outcome computed = run_interpreted(placed, placed.programs.front(), inputs);
  EXPECT_EQ(distance(computed, expected), 0) << print(written) << "\nplaced:\n" << print(placed);
  const int fewer = fills_in(program) - fills_in(placed.programs.front());
  EXPECT_GE(fewer, 0) << print(written) << "\nplaced:\n" << print(placed);
  ++count.programs;
  count.fills += fills_in(program);
  count.fewer += fewer;
}

TEST(PlacedFills, OfRandomProgramsAreTheSame) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1), programs = setting("DPDE_RANDOM_PROGRAMS", 100);
  Compared count;
  for (std::uint64_t seed = first; seed < first + programs; ++seed) {
    const RandomProgram random = random_program(seed);
    expect_same_bits(random.module, random.grid, seed, count);
  }
  std::cout << count.programs << " programs with " << count.fills << " fills, of which " << count.fewer
            << " are not needed\n";
  EXPECT_GE(count.programs, static_cast<int>(programs) / 4);
}

TEST(PlacedFills, OfAllKindsOfProgramsAreTheSame) {
  Compared count;
  for (const auto& cases : {program_cases(), repeat_cases(), solve_cases()}) {
    for (const ProgramCase& c : cases) {
      SCOPED_TRACE(c.name);
      for (const Grid& grid : small_grids(c.rank)) expect_same_bits(parse_module(c.text), grid, 1, count);
    }
  }
  EXPECT_GE(count.programs, 100);
}

}  // namespace
}  // namespace dpde::testing
