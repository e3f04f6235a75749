// SPDX-License-Identifier: Apache-2.0
// Texts that grow when sums are multiplied out or lets are put in place: compiled in bounded work, or the test never ends.
#include <string>

#include "codegen/llvm/emit_llvm.h"
#include "driver_support.h"
#include "stencil/print_stencil.h"

namespace dpde::testing {
namespace {

driver::CompileOptions of_task(const char* name) {
  driver::CompileOptions options;
  options.selection.name = name;
  options.adjoint = true;
  return options;
}

/// Each let is the square of the one before it: 2^40 factors when they are put in place.
TEST(LargeTexts, SquaresOfSquaresStayLets) {
  std::string lets;
  for (int i = 1; i <= 40; ++i) lets += "  let a" + std::to_string(i) + " = a" + std::to_string(i - 1) + "*a" + std::to_string(i - 1) + "\n";
  const SourceFile source("squares.dpde", "kernel k(u: field, out v: field) {\n  let a0 = u*0.5\n" + lets + R"(  v = a40
}
program p { run k; swap u, v }
scene s : p { grid x = 0 .. 1, cells 8, periodic; initial u = 0.1; time 0 .. 1, step 0.1 }
task g : s { unknown initial u from 0; minimise mean(u^2) at t = 1 }
)");
  const auto code = compiled(source, of_task("g"));
  ASSERT_NE(code, nullptr);
  EXPECT_LT(stencil::print(code->stencil).size(), 5000u);
}

/// Factors in sums in factors: the instructions of each were once counted twice by the level above, 2^24 times here.
TEST(LargeTexts, NestedProductsAreCountedOnce) {
  std::string value = "0.5";
  for (int i = 1; i <= 24; ++i) value = "(0.01*v + u*" + value + ")";
  const SourceFile source("nested.dpde", "kernel k(u: field, v: field, out w: field) {\n  w = " + value + R"(
}
program p { run k; swap u, w }
scene s : p { grid x = 0 .. 1, cells 8, periodic; initial u = 0.1; v = 0.2; time 0 .. 1, step 0.1 }
task g : s { unknown initial u from 0; minimise mean(u^2) at t = 1 }
)");
  ASSERT_NE(compiled(source, of_task("g")), nullptr);
}

/// So many fields, each coupled to the next.
SourceFile with_fields(int fields) {
  std::string model, initial;
  for (int i = 0; i < fields; ++i) {
    const std::string u = "u" + std::to_string(i), next = "u" + std::to_string((i + 1) % fields);
    model += "  field " + u + "\n  dt(" + u + ") = k*lap(" + u + ") + 0.1*" + u + "*" + next + "\n";
    initial += "  initial " + u + " = 0.1\n";
  }
  return SourceFile("fields.dpde", "model m {\n  param k\n" + model +
                                       "}\nscene s : m {\n  grid x = 0 .. 1, cells 64, periodic\n  k = 1e-4\n" +
                                       initial + R"(  time 0 .. 0.1, step 0.01
}
task g : s { unknown k; minimise mean(u0^2) at t = 0.1 }
)");
}

/// Calls instead of copies, which the scheduler of machine code takes quadratic time for; small rows are inlined.
TEST(LargeTexts, RowsOfManyLinesStayFunctions) {
  const auto ir_of = [](int fields) {
    return codegen::emit_llvm(compiled(with_fields(fields), of_task("g"))->loop, false);
  };
  EXPECT_NE(ir_of(120).find("noinline"), std::string::npos);
  EXPECT_EQ(ir_of(4).find("noinline"), std::string::npos);
}

/// The fourth derivative by eight points in a stretched coordinate nests products of sums of sums.
TEST(LargeTexts, FourthDerivativesOnStretchedAxes) {
  const SourceFile source("fourth.dpde", R"(model m { field u; param k; dt(u) = k*lap(u) }
scheme c { dx = central(8); lap = central(8); time = euler }
scene s : m with c {
  grid x = 0 .. 1, cells 32, periodic, stretched x + 0.1*sin(2*pi*x)
  k = 1e-6
  initial u = sin(2*pi*x)
  time 0 .. 0.1, step 0.01
}
task g : s { unknown initial u from 0; minimise mean(d(u, x, 4)^2) at t = 0.1 }
)");
  const auto code = compiled(source, of_task("g"));
  ASSERT_NE(code, nullptr);
}

}  // namespace
}  // namespace dpde::testing
