// SPDX-License-Identifier: Apache-2.0
// Mistakes: code, place, words and hint; and that what follows a mistake is still read.
#include <gtest/gtest.h>

#include "source/render.h"
#include "syntax/parse_helpers.h"

namespace dpde::ast {
namespace {

const std::string model_words = "understood here: field, vector, coefficient, mask, param, control, let, dt, solve";
const std::string scene_words =
    "understood here: grid, cells, let, coordinates, initial, exact, boundary, time, step, after, every, at, subcycle, "
    "observe, "
    "output, "
    "accuracy, "
    "parameter = value";
const std::string task_words =
    "understood here: data, unknown, learn, minimise, using, test, statistic, spectrum, correlation, growth";
const std::string file_words =
    "understood here: model, scene, scheme, task, kernel, program, loop, function, operator, network, dataset, import, "
    "chart";

TEST(Errors, NameWordsThatAreNotUnderstood) {
  EXPECT_EQ(problems_of("model gray_scott { field a; param Da, k; closure F\n  dt(a) = Da*lap(a) }"),
            "1:42 E0203 'closure' is not understood in a model | " + model_words + "\n");
  EXPECT_EQ(problems_of("model euler { conserved rho, vector m, E; param gamma\n let v = m/rho }"),
            "1:15 E0203 'conserved' is not understood in a model | " + model_words + "\n");
  EXPECT_EQ(problems_of("task train : hybrid { teach corrector }"),
            "1:23 E0203 'teach' is not understood in a task | " + task_words + "\n");
  EXPECT_EQ(problems_of("scene s : m { during step: u += corrector(u, re); nu = 1 }"),
            "1:15 E0203 'during' is not understood in a scene | " + scene_words + "\n");
}

TEST(Errors, NameBlocksThatAreNotUnderstood) {
  EXPECT_EQ(problems_of("mesh corrector(u: vector, re: constant) -> vector {\n"
                        "  repeat 3 { residual { conv 32, 5; relu }; relu }\n"
                        "}\n"
                        "graph c : wave {\n  vary cells in 64, 128\n}\n"
                        "model m { fild u }\n"),
            "1:1 E0202 'mesh' does not begin a block | " + file_words + "\n" +
                "4:1 E0202 'graph' does not begin a block | " + file_words + "\n" +
                "7:11 E0203 'fild' is not understood in a model | did you mean field? " + model_words + "\n");
  EXPECT_EQ(problems_of("modle m { field u }"),
            "1:1 E0202 'modle' does not begin a block | did you mean model? " + file_words + "\n");
  EXPECT_EQ(problems_of("}\n= 3\n"),
            "1:1 E0201 expected a block such as model or scene but found '}' | " + file_words + "\n");
}

TEST(Errors, SuggestTheWordThatWasMeant) {
  EXPECT_EQ(problems_of("scene s : m {\n  inital u = 0\n  grd x = 0 .. 1\n}"),
            "2:3 E0203 'inital' is not understood in a scene | did you mean initial? " + scene_words + "\n" +
                "3:3 E0203 'grd' is not understood in a scene | did you mean grid? " + scene_words + "\n");
  EXPECT_EQ(
      problems_of("scene s : m { grid x = 0 .. 1, cels 3 }"),
      "1:32 E0207 'cels' is not an option of grid | did you mean cells? understood here: cells, periodic, stretched\n");
  EXPECT_EQ(problems_of("scene s : m { time 0 .. 1, every 3 }"),
            "1:28 E0207 'every' is not an option of time | understood here: step, courant, speed, tolerance, absolute, "
            "first, until steady\n");
  EXPECT_EQ(problems_of("model m { initial u = 0 }"),
            "1:11 E0203 'initial' is not understood in a model | initial belongs in a scene; " + model_words + "\n");
}

TEST(Errors, SayThatUnknownsStandOnLinesOfTheirOwn) {
  const std::string hint = "each unknown stands on a line of its own: unknown a; unknown b\n";
  for (const std::string first : {"k", "k from 1.5", "k in 0 .. 1", "k from 1.5 in 0 .. 1"}) {
    const std::string before = "task fit : s { unknown " + first;
    EXPECT_EQ(problems_of(before + ", initial w }"),
              fmt::format("1:{} E0201 expected the end of the line but found ',' | {}", before.size() + 1, hint));
  }
}

TEST(Errors, SayWhatWasExpected) {
  EXPECT_EQ(problems_of("model { field u }"), "1:7 E0201 expected the name of the model but found '{'\n");
  EXPECT_EQ(problems_of("scene s burgers { }"), "1:9 E0201 expected ':' but found 'burgers'\n");
  EXPECT_EQ(problems_of("model m { field }"), "1:17 E0201 expected the name of a field but found '}'\n");
  EXPECT_EQ(problems_of("model m {\n  field\n  param nu\n}"),
            "2:8 E0201 expected the name of a field but found the end of the line\n");
  EXPECT_EQ(problems_of("model m { 3 }"),
            "1:11 E0201 expected an item of the model but found '3' | " + model_words + "\n");
  EXPECT_EQ(problems_of("scene s : m { grid x = 0, cells 3 }"), "1:25 E0201 expected '..' but found ','\n");
  EXPECT_EQ(problems_of("scene s : m { boundary u x.low = 0 }"),
            "1:26 E0201 expected ':' or '=' but found 'x' | as in: boundary u: x.low = 0, x.high = 1\n");
  EXPECT_EQ(problems_of("scene s : m { boundary u: x.left = 0 }"),
            "1:29 E0201 expected 'low' or 'high' but found 'left' | the sides of x are x.low, where x is least, and "
            "x.high\n");
  EXPECT_EQ(problems_of("scene s : m { grid x = 0 .. 1, periodic, periodic, cells 2 }"),
            "1:42 E0211 'periodic' is written twice\n");
  EXPECT_EQ(problems_of("task t : s { minimise mean(u) over 16 cells }"),
            "1:39 E0201 expected 'steps' but found 'cells'\n");
  EXPECT_EQ(problems_of("task t : s { minimise mean(u) over }"),
            "1:36 E0201 expected 'time', or a number of steps but found '}'\n");
  EXPECT_EQ(problems_of("program p { fill u 3 }"),
            "1:20 E0201 expected '=', 'periodic' or 'zero_gradient' but found '3'\n");
  EXPECT_EQ(problems_of("loop t in 0 .. n { p }"), "1:16 E0201 expected a whole number but found 'n'\n");
  EXPECT_EQ(problems_of("loop t in 0 .. 1.5 { p }"), "1:16 E0208 expected a whole number but found '1.5'\n");
}

TEST(Errors, OfEquations) {
  EXPECT_EQ(
      problems_of("model m {\n  u = lap(u)\n  dx(u) = 0\n  0 = div(u) give p\n}"),
      "2:3 E0209 an equation begins with dt(field), not with 'u' | write dt(u) = ... for a field, let u = ... for "
      "a shorthand, or u = ... inside a mask\n"
      "3:3 E0209 an equation begins with dt(field), not with 'dx'\n"
      "4:14 E0201 expected 'gives' but found 'give' | 0 = div(u) gives p; an equation without dt is solved: solve "
      "lap(u) = -f for u\n");
  EXPECT_EQ(problems_of("model m {\n  0 = div(u) gives p each time\n}"),
            "2:27 E0201 expected step or stage but found 'time' | 0 = div(u) gives p each step\n");
}

TEST(Errors, OfRatesAndProductsAsOthersWriteThem) {
  const auto hint_of = [](std::string_view item) {
    const std::string problem = problems_of(fmt::format("model m {{ {} }}", item));
    return problem.substr(std::min(problem.size(), problem.find(" | ")));
  };
  EXPECT_EQ(hint_of("drho/dt = lap(rho)"), " | write dt(rho) = ...\n");
  EXPECT_EQ(hint_of("d(rho)/dt = lap(rho)"), " | a rate is written dt(u) = ...\n");
  EXPECT_EQ(hint_of("u_t = lap(u)"),
            " | write dt(u) = ... for the rate of u, let u_t = ... for a shorthand, or u_t = ... inside a mask\n");
  for (const char* other : {"du/dx = 3", "dye/3 = 1", "dx(u) = 3"}) EXPECT_EQ(hint_of(other), "") << other;
  EXPECT_EQ(problems_of("model m { u_t = 0 inside disc }"), "");
  EXPECT_EQ(hint_of("dt(u) = k lap(u)"), " | a product is written with *, as in 2*x\n");
  EXPECT_EQ(hint_of("let k = 2 3"), "");
}

TEST(Errors, OfKernelHeaders) {
  EXPECT_EQ(problems_of("kernel k(out nu: param) { }"), "1:18 E0210 out can stand only before a field\n");
  EXPECT_EQ(problems_of("kernel k(sum u: field) { }"), "1:17 E0210 sum can stand only before a param\n");
  EXPECT_EQ(problems_of("kernel k(u: scalar) { }"), "1:13 E0201 expected 'field' or 'param' but found 'scalar'\n");
  EXPECT_EQ(problems_of("kernel k(u) { }"), "1:11 E0201 expected ':' but found ')'\n");
}

TEST(Errors, DoNotHideTheNextItem) {
  EXPECT_EQ(problems_of(
                "model m {\n  field u +\n  v\n  dt(u = 3\n  dt(v) = lap(v\n  let a = 2 3; let b = (1\n  let c = )\n}\n"
                "scene s : m { nu 3; mu = * }\n"),
            "2:11 E0201 expected the end of the line but found '+'\n"
            "4:8 E0201 expected ')' but found '='\n"
            "5:16 E0201 expected ',' or ')' but found the end of the line\n"
            "6:13 E0201 expected the end of the line but found '3'\n"
            "6:26 E0201 expected ',' or ')' but found the end of the line\n"
            "7:11 E0201 expected an expression but found ')'\n"
            "9:15 E0203 'nu' is not understood in a scene | " +
                scene_words +
                "\n"
                "9:26 E0201 expected an expression but found '*' | a power is written u^2, a product u*v\n");
}

TEST(Errors, OfUnits) {
  const std::string known =
      "known are m, g, s, A, K, mol, cd, N, Pa, J, W, V, C, F, ohm, S, Wb, T, H, Hz, rad, deg, L, bar, eV, min, h, "
      "day, year, with prefixes as in km; 1 is a pure number\n";
  EXPECT_EQ(problems_of("model m { field u in furlong/s }"), "1:22 E0212 furlong is no unit that is known | " + known);
  EXPECT_EQ(
      problems_of("model m { field u in degC }"),
      "1:22 E0212 degC is no unit that is known | its zero is not that of K, so that it cannot stand in products: "
      "give temperatures in K\n");
  EXPECT_EQ(problems_of("model m { field u in m/ }"),
            "1:22 E0212 m/ is no unit that is known | a unit is written m/s, kg*m/s^2, W/(m*K) or 1/s\n");
  EXPECT_EQ(problems_of("model m { param k = 1 in, b }"), "1:25 E0201 expected a unit but found ',' | as in: in m/s\n");
  EXPECT_EQ(problems_of("model m { field u in m s }"), "1:24 E0201 expected the end of the line but found 's'\n");
  EXPECT_EQ(problems_of("model m { field u in m**2 }"),
            "1:22 E0212 m** is no unit that is known | a power is written m^2\n");
  EXPECT_EQ(problems_of("model m { field u in m^2.5 }").substr(0, 10), "1:22 E0212");
}

TEST(Errors, KeepWhatWasUnderstood) {
  const SourceFile source("t.dpde", "model m {\n  field u\n  oops\n  param nu\n}\nbroken {\n}\nscheme s { a = 1 }\n");
  DiagnosticSink sink;
  const File file = parse(source, sink);
  EXPECT_EQ(sink.all().size(), 2u);
  EXPECT_EQ(print(file), "model m {\n  field u\n  param nu\n}\nscheme s { a = 1 }\n");
}

TEST(Errors, OfBlocksThatAreNotClosed) {
  EXPECT_EQ(problems_of("model m {\n  field u\n\nscene s : m {\n  oops 1\n}\n"),
            "1:9 E0205 the model has no closing }\n"
            "5:3 E0203 'oops' is not understood in a scene | " +
                scene_words + "\n");
  EXPECT_EQ(problems_of("program p {\n  run k"), "1:11 E0205 the program has no closing }\n");
  EXPECT_EQ(problems_of("loop t in 0 .. 1 {"), "1:18 E0205 the loop has no closing }\n");
  EXPECT_EQ(problems_of("model m {\n  closure {\nscene s : m { }\n"),
            "2:3 E0203 'closure' is not understood in a model | " + model_words +
                "\n"
                "1:9 E0205 the model has no closing }\n");
}

TEST(Errors, OfCharactersAreReportedOnce) {
  EXPECT_EQ(problems_of("model m {\n  field $u\n  param nu\n  let a = \"x\n  let b = 1e999\n}\n"),
            "2:9 E0101 unexpected character '$'\n"
            "4:11 E0102 text without a closing quote | close it with \" on the same line\n"
            "5:11 E0103 number 1e999 is out of range\n");
  EXPECT_EQ(problems_of("model m { dt(u) = a \u2212 b }"),
            "1:21 E0101 unexpected character '\u2212' | write the plain minus, -\n");
}

TEST(Errors, ShortenWhatIsLong) {
  EXPECT_EQ(problems_of("model m { " + std::string(1000, 'a') + " }"),
            "1:11 E0203 '" + std::string(40, 'a') + "...' is not understood in a model | " + model_words + "\n");
}

TEST(Errors, PointAtWhatIsStillOpen) {
  const SourceFile source("m.dpde", "model m {\n  dt(u) = nu*lap(u\n  field v\n}\n");
  DiagnosticSink sink;
  parse(source, sink);
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(render_text(source, sink.all()[0]),
            "m.dpde:2:19: error[E0201]: expected ',' or ')' but found the end of the line\n"
            "    dt(u) = nu*lap(u\n"
            "                    ^\n"
            "m.dpde:2:17: note: this is still open\n"
            "    dt(u) = nu*lap(u\n"
            "                  ^\n");
}

}  // namespace
}  // namespace dpde::ast
