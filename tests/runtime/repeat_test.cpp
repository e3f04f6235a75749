// SPDX-License-Identifier: Apache-2.0
// Repeats and stacks in the executor: carried, saved and loaded values; no copies and no allocations.
#include <gtest/gtest.h>

#include "allocations.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "test_program.h"

namespace dpde {
namespace {

using test::Doubles;
using test::TestProgram;

/// v = 2*u + 1
void grow(const dpde_row* row) {
  const Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[1][i] = 2 * s[0][i] + 1;
}

/// r = 10*w + u
void join(const dpde_row* row) {
  const Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) s[2][i] = 10 * s[0][i] + s[1][i];
}

struct Bound {
  explicit Bound(TestProgram& program)
      : layout(make_layout(std::vector<int64_t>{3}, {0, 0, 0})), executor(program.table(), layout) {
    for (int f = 0; f < executor.program().field_count; ++f) fields.emplace_back(layout, f).fill(-1);
    for (int f = 0; f < executor.program().field_count; ++f) executor.bind(f, fields[static_cast<size_t>(f)].base());
  }
  Field& field(const char* name) { return fields[static_cast<size_t>(executor.field_index(name))]; }

  dpde_layout layout;
  Executor executor;
  std::vector<Field> fields;
};

TEST(Repeat, WritesTheLastPassToItsResult) {
  for (const int64_t count : {1, 2, 3, 4, 7}) {
    TestProgram program("p", 1, {"u"}, {"v", "last"});
    program.sweep(grow, {{"u"}, {"v"}});
    program.repeat(count, 1, {{"u", "v", "last"}});
    Bound run(program);
    for (int again = 0; again < 2; ++again) {
      run.field("u").fill(0);
      run.executor.run();
      EXPECT_EQ(run.field("last").at(1), static_cast<double>((1 << count) - 1));
      EXPECT_EQ(run.field("u").at(1), 0);
      EXPECT_EQ(run.executor.bound(0), run.fields[0].base());
    }
  }
}

TEST(Repeat, LoadsWhatWasSavedLastFirst) {
  TestProgram program("p", 1, {"u", "w"}, {"v", "last", "r", "all"});
  program.sweep(grow, {{"u"}, {"v"}});
  program.repeat(3, 1, {{"u", "v", "last"}}, {{"u", 0}});
  program.sweep(join, {{"w"}, {"u"}, {"r"}});
  program.repeat(3, 1, {{"w", "r", "all"}}, {}, {{"u", 0}});
  program.stacks({2});
  Bound run(program);
  EXPECT_EQ(run.executor.memory().at(0).kept, 4096 + 3 * 8);  // two fields in a page, three scalars
  run.executor.make_stacks();
  run.field("u").fill(0);
  run.field("w").fill(0);
  const long before = test::allocations();
  run.executor.run();
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(run.field("all").at(0), 310);  // 3, 1, 0
  EXPECT_EQ(run.field("last").at(0), 7);
  EXPECT_EQ(run.field("u").at(0), 0);
}

/// A value that a pass writes without carrying it, and a value that it loads.
TEST(Repeat, SavesWhatIsWrittenAndWhatIsLoaded) {
  TestProgram program("p", 1, {"u", "w"}, {"v", "last", "own", "r", "all", "s", "end"});
  program.sweep(grow, {{"u"}, {"v"}});
  program.sweep(grow, {{"v"}, {"own"}});
  program.repeat(2, 2, {{"u", "v", "last"}}, {{"own", 0}});
  program.sweep(join, {{"w"}, {"own"}, {"r"}});
  program.repeat(2, 1, {{"w", "r", "all"}}, {{"own", 1}}, {{"own", 0}});
  program.sweep(join, {{"w"}, {"own"}, {"s"}});
  program.repeat(2, 1, {{"w", "s", "end"}}, {}, {{"own", 1}});
  program.stacks({2, 0});
  Bound run(program);
  run.field("u").fill(0);
  run.field("w").fill(0);
  run.executor.run();
  EXPECT_EQ(run.field("all").at(2), 73);  // own is 3, then 7
  EXPECT_EQ(run.field("end").at(2), 37);
}

TEST(Repeat, InARepeat) {
  TestProgram program("p", 1, {"u"}, {"v", "inner", "last"});
  program.sweep(grow, {{"u"}, {"v"}});
  program.repeat(2, 1, {{"u", "v", "inner"}});
  program.repeat(3, 1, {{"u", "inner", "last"}});
  Bound run(program);
  run.field("u").fill(0);
  run.executor.run();
  EXPECT_EQ(run.field("last").at(0), 63);
  EXPECT_EQ(run.field("u").at(0), 0);
}

}  // namespace
}  // namespace dpde
