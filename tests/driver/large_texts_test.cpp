// SPDX-License-Identifier: Apache-2.0
// Texts that grow if sums are expanded or lets are substituted: the work of compilation is bounded, otherwise the test
// never ends.
#include <algorithm>
#include <ctime>
#include <string>

#include "codegen/llvm/emit_llvm.h"
#include "driver/compile/lone_models.h"
#include "driver_support.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"

namespace dpde::testing {
namespace {

driver::CompileOptions of_task(const char* name) {
  driver::CompileOptions options;
  options.selection.name = name;
  options.adjoint = true;
  return options;
}

/// Each let is the square of the one before: 2^40 factors after substitution.
TEST(LargeTexts, SquaresOfSquaresStayLets) {
  std::string lets;
  for (int i = 1; i <= 40; ++i)
    lets += "  let a" + std::to_string(i) + " = a" + std::to_string(i - 1) + "*a" + std::to_string(i - 1) + "\n";
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

/// Nested factors and sums: the instructions of each level were once counted twice by the level above, here 2^24 times.
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

/// This number of fields, each coupled to the next.
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

/// Calls instead of copies, for which the machine-code scheduler needs quadratic time; small rows are inlined.
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

/// Processor time for checking this number of models, each with a function and a network: the minimum of three.
std::clock_t ticks_for_models(int models, const std::string& rhs) {
  std::string text;
  for (int i = 0; i < models; ++i) {
    const std::string n = std::to_string(i);
    text += "model m" + n + " { field u; dt(u) = " + rhs + " + f" + n + "(u) + n" + n + "(u) }\nfunction f" + n +
            "(a) = 2*a\nnetwork n" + n + "(u) -> scalar { conv 1, 1 }\n";
  }
  const SourceFile source("models.dpde", text);
  DiagnosticSink sink;
  const ast::File file = parse(source, sink);
  std::clock_t least = 0;
  for (int trial = 0; trial < 3; ++trial) {
    const std::clock_t start = std::clock();
    driver::check_lone_models(file, source, sink);
    const std::clock_t ticks = std::max<std::clock_t>(std::clock() - start, 1);
    least = trial == 0 ? ticks : std::min(least, ticks);
  }
  return least;
}

/// Eight times as many models take eight times as long; 64 times if each is checked together with all others.
TEST(LargeTexts, ModelsAreCheckedOneByOne) {
  for (const char* rhs : {"u", "v"}) {
    EXPECT_LT(double(ticks_for_models(1600, rhs)) / double(ticks_for_models(200, rhs)), 24) << rhs;
  }
}

/// For three models with the same name the error was reported three times for each.
TEST(LargeTexts, NamesOfModelsAreCheckedOnce) {
  const SourceFile source("same.dpde", "model m { field u; dt(u) = u }\nmodel m { field u; dt(u) = u }\n");
  DiagnosticSink sink;
  driver::check_lone_models(parse(source, sink), source, sink);
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].notes.size(), 1u);
}

/// Uncalled items are checked too, and hints also name items that a model does not use.
TEST(LargeTexts, ModelsKnowTheirWholeFile) {
  const auto messages_of = [](const std::string& text) {
    const SourceFile source("whole.dpde", text);
    DiagnosticSink sink;
    driver::check_lone_models(parse(source, sink), source, sink);
    std::string all;
    for (const Diagnostic& diagnostic : sink.all()) all += diagnostic.message + "; " + diagnostic.hint + "\n";
    return all;
  };
  const std::string models = "model a { field u; dt(u) = u }\nmodel b { field u; dt(u) = twyce(u) }\n";
  EXPECT_NE(messages_of(models + "function twice(a) = 2*once(a)\nfunction once(a) = a").find("did you mean twice?"),
            std::string::npos);
  const std::string wrong = messages_of("model a { field u; dt(u) = u }\nnetwork n(u) -> scalar { conv 0, 3 }\n");
  EXPECT_NE(wrong, "");
  EXPECT_EQ(messages_of("model a { field u; dt(u) = g(u) }\nfunction g(a) = h(a)\nfunction h(a) = lap(a)"), "");
}

}  // namespace
}  // namespace dpde::testing
