// SPDX-License-Identifier: Apache-2.0
// Scenes made from others, their lets, parameters with values in the model, initial states made of one another.
#include <fmt/format.h>

#include <sstream>

#include "model/model_support.h"
#include "model/print/print_model.h"

namespace dpde::model {
namespace {

const std::string written_out = R"(
model m { field u, v; coefficient b; param k = 1, c = 2*k; dt(u) = k*lap(u) + c*b; dt(v) = u }
scheme s2 { time = rk2 }
scene a : m {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 2, cells 4
  let q = 2*pi*k
  b = sin(q*x)
  boundary u: x = 0, y.low = 1, y.high = zero_gradient
  initial u = cos(q*x) - b
  boundary v = zero_gradient
  initial v = 2*u
  time 0 .. 1, step 1/8
  output u every 1/4
  output v
}
)";

Problem changed(const std::string& more, const std::string& name) {
  return problem_of(written_out + more, {name, {}, ""});
}

/// The lines of the printed problem that begin so, without what is the scene's name.
std::vector<std::string> lines_with(const Problem& problem, const std::string& start) {
  std::vector<std::string> lines;
  std::istringstream text(print(problem));
  for (std::string line; std::getline(text, line);) {
    if (line.find("  " + start) == 0) lines.push_back(line.substr(2));
  }
  return lines;
}

TEST(Scenes, AreMadeFromOthersWithChanges) {
  const Problem b = changed("scene b = a with s2 { cells 16; step 1/32; k = 3 }", "b");
  EXPECT_EQ(b.axes[0].cells, 16);
  EXPECT_EQ(b.axes[1].cells, 16);
  EXPECT_EQ(b.axes[1].high, 2);
  EXPECT_EQ(b.steps, 32);
  EXPECT_EQ(b.scheme.time, time_method("rk2"));
  EXPECT_EQ(lines_with(b, "initial"), (std::vector<std::string>{"initial u = cos(2*pi*k*x) - sin(2*pi*k*x)",
                                                                "initial v = 2*(cos(2*pi*k*x) - sin(2*pi*k*x))"}));
  const Problem c = changed("scene c = b { cells 5, 3; let q = 1; initial v = 0 }\nscene b = a { k = 3 }", "c");
  EXPECT_EQ(c.axes[0].cells, 5);
  EXPECT_EQ(c.axes[1].cells, 3);
  EXPECT_EQ(lines_with(c, "k = "), std::vector<std::string>{"k = 3"});
  EXPECT_EQ(lines_with(c, "c = "), std::vector<std::string>{"c = 6"});
  EXPECT_EQ(lines_with(c, "initial"), (std::vector<std::string>{"initial u = cos(x) - sin(x)", "initial v = 0"}));
}

TEST(Scenes, ChangeSidesOfBoundariesOneByOne) {
  const Problem b = changed("scene b = a { boundary u: x.high = 5, y = 0 }", "b");
  EXPECT_EQ(lines_with(b, "boundary u"),
            std::vector<std::string>{"boundary u: x.low = 0, x.high = 5, y.low = 0, y.high = 0"});
  const Problem c = changed("scene c = a { boundary u = zero_gradient }", "c");
  EXPECT_EQ(lines_with(c, "boundary u"),
            std::vector<std::string>{
                "boundary u: x.low zero_gradient, x.high zero_gradient, y.low zero_gradient, y.high zero_gradient"});
}

/// Lines of a field are one boundary, in both scenes; what is on a periodic axis has none.
TEST(Scenes, ChangeSidesOfSeveralLines) {
  const std::string two_lines = "\nscene d = a { boundary u: x = 7\n boundary u: y = 8 }";
  EXPECT_EQ(lines_with(changed(two_lines, "d"), "boundary u"),
            std::vector<std::string>{"boundary u: x.low = 7, x.high = 7, y.low = 8, y.high = 8"});
  EXPECT_EQ(lines_with(changed(two_lines + "\nscene e = d { boundary u: y.low = 9 }", "e"), "boundary u"),
            std::vector<std::string>{"boundary u: x.low = 7, x.high = 7, y.low = 9, y.high = 8"});
  const std::string ring =
      "model r { field u; dt(u) = lap(u) }\nscene p : r { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells "
      "4\n boundary u = 0\n initial u = 1; time 0 .. 1, step 1/2 }\nscene q = p { boundary u: y.low = 2 }\n";
  EXPECT_EQ(lines_with(problem_of(ring, {"q", {}, ""}), "boundary u"),
            std::vector<std::string>{"boundary u: y.low = 2, y.high = 0"});
}

/// Cells of one axis beside those of all, components beside whole vectors, and the step in front of the time.
TEST(Scenes, ChangePartsOfWhatOthersSayAsAWhole) {
  const std::string text = R"(
model m { vector u; coefficient vector w; dt(u) = lap(u) + w }
scene s : m {
  grid y = 0 .. 1, periodic
  grid x = 0 .. 1
  cells 8, 4
  boundary u: x.low = (1, 2), x.high = zero_gradient
  w = (1, y)
  initial u = (x, y)
  time 0 .. 1, step 1/1000
}
scene d = s { step 1/2000; time 0 .. 2; grid x = 0 .. 2, cells 16; initial u.x = 3; w.y = 7; boundary u.y: x.low = 5 }
scene e = d { initial u = (x, 0); boundary u = 0; cells 3 }
scene f = e { initial u.x = y; step 1/4000 }
scene bad = s { cells 4, 4, 4 }
)";
  const Problem d = problem_of(text, {"d", {}, ""});
  EXPECT_EQ(d.axes[0].cells, 16);
  EXPECT_EQ(d.axes[1].cells, 4);
  EXPECT_EQ(d.steps, 4000);
  EXPECT_EQ(lines_with(d, "initial"), (std::vector<std::string>{"initial u.x = 3", "initial u.y = y"}));
  EXPECT_EQ(lines_with(d, "w"), (std::vector<std::string>{"w.x = 1", "w.y = 7"}));
  EXPECT_EQ(lines_with(d, "boundary"), (std::vector<std::string>{"boundary u.x: x.low = 1, x.high zero_gradient",
                                                                 "boundary u.y: x.low = 5, x.high zero_gradient"}));
  const Problem e = problem_of(text, {"e", {}, ""});
  EXPECT_EQ(e.axes[0].cells * e.axes[1].cells, 9);
  EXPECT_EQ(lines_with(e, "initial"), (std::vector<std::string>{"initial u.x = x", "initial u.y = 0"}));
  EXPECT_EQ(lines_with(e, "boundary u.y"), std::vector<std::string>{"boundary u.y: x.low = 0, x.high = 0"});
  const Problem f = problem_of(text, {"f", {}, ""});
  EXPECT_EQ(f.steps, 8000);
  EXPECT_EQ(lines_with(f, "initial"), (std::vector<std::string>{"initial u.x = y", "initial u.y = 0"}));
  EXPECT_EQ(outcome_of(text, {"bad", {}, ""}).code_and_hint(), "E0309 write one number for all axes, or one for each");
}

/// The run from another state has another exact solution.
TEST(Scenes, LeaveOutExactSolutionsOfOtherStates) {
  const std::string text = R"(
model m { field u; dt(u) = -u }
scene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = 1; exact u = exp(-t); time 0 .. 1, step 1/8 }
scene finer = s { cells 16 }
scene twice = s { initial u = 2 }
scene thrice = twice { initial u = 3; exact u = 3*exp(-t) }
)";
  EXPECT_TRUE(problem_of(text, {"finer", {}, ""}).states[0].exact);
  const Problem twice = problem_of(text, {"twice", {}, ""});
  EXPECT_FALSE(twice.states[0].exact);
  EXPECT_EQ(twice.remarks.dropped.front(), "exact u of scene s: it starts from another state there");
  EXPECT_TRUE(problem_of(text, {"thrice", {}, ""}).states[0].exact);
}

TEST(Scenes, OfLongChainsEnd) {
  std::string text = written_out;
  for (int i = 0; i < 20000; ++i)
    text += "scene a" + std::to_string(i) + " = a" + (i ? std::to_string(i - 1) : "") + " {}\n";
  EXPECT_EQ(problem_of(text, {"a19999", {}, ""}).axes[0].cells, 8);
  const auto with = [](const std::string& lets) {
    return outcome_of(
               "model m { field u; dt(u) = -u }\nscene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = q\n"
               "time 0 .. 1, step 1/8\n" +
               lets + "}")
        .code_and_hint();
  };
  std::string doubled = "let a0 = x\n", chain = doubled;
  for (int i = 1; i < 60; ++i) doubled += fmt::format("let a{} = a{} + a{}\n", i, i - 1, i - 1);
  for (int i = 1; i < 20000; ++i) chain += fmt::format("let a{} = a{} + 1\n", i, i - 1);
  EXPECT_EQ(with(doubled + "let q = a59\n"), "E0317 split it into several fields or scenes");
  EXPECT_EQ(with(chain + "let q = a19999\n").substr(0, 5), "E0317");
}

TEST(Scenes, ReplaceAllOutputs) {
  const Problem b = changed("scene b = a { output u }", "b");
  EXPECT_EQ(lines_with(b, "output"), std::vector<std::string>{"output u"});
}

TEST(Scenes, FormulasStandForWhatTheyGive) {
  const Problem problem = problem_of(
      "model m { vector w; field h; coefficient b; mask o; dt(w) = b*w*o; dt(h) = 0*h }\n"
      "scene s : m { grid x = 0 .. 1, cells 8, periodic; time 0 .. 1, step 1/8; o = x < 0.5\n"
      "b = 2*x; initial w = 3*x; initial h = 1 - b + w.x }\n");
  EXPECT_EQ(lines_with(problem, "initial h"), std::vector<std::string>{"initial h = 1 - 2*x + 3*x"});
}

TEST(Scenes, ValuesOfTheModelFollowThoseOfTheScene) {
  const std::string text = R"(
model m { field u; param a = 3, b = 2*a, c; dt(u) = a*b*c*u }
scene s : m { grid x = 0 .. 1, cells 8, periodic; c = b; initial u = 1; time 0 .. 1, step 1/8 }
scene of_five = s { a = 5 }
scene of_seven = s { b = 7 }
)";
  const auto values = [&](const std::string& scene, const std::map<std::string, std::string>& settings = {}) {
    std::map<std::string, double> found;
    for (const Parameter& p : problem_of(text, {scene, settings, ""}).params) found[p.name] = p.value;
    return std::vector<double>{found["a"], found["b"], found["c"]};
  };
  EXPECT_EQ(values("s"), (std::vector<double>{3, 6, 6}));
  EXPECT_EQ(values("of_five"), (std::vector<double>{5, 10, 10}));
  EXPECT_EQ(values("of_seven"), (std::vector<double>{3, 7, 7}));
  EXPECT_EQ(values("s", {{"a", "4"}}), (std::vector<double>{4, 8, 8}));
}

std::string needs_a_grid(const std::string& what) {
  return "E0401 " + what + " needs one: write grid x = 0 .. 1, cells 128, periodic";
}

TEST(Scenes, WithoutAGridAreOneCell) {
  const std::string model = "model m { field a, b; param k; dt(a) = b*k; dt(b) = RATE }\n";
  const std::string scene = "scene s : m { k = 2; initial a = 1; initial b = START; time 0 .. 1, step 1/8 }";
  const auto with = [&](const std::string& rate, const std::string& start) {
    std::string whole = model + scene;
    whole.replace(whole.find("RATE"), 4, rate);
    whole.replace(whole.find("START"), 5, start);
    return outcome_of(whole);
  };
  const Outcome fine = with("-a", "0");
  ASSERT_TRUE(fine.problem);
  EXPECT_EQ(fine.problem->axes.size(), 1U);
  EXPECT_EQ(fine.problem->axes.front().cells, 1);
  EXPECT_EQ(with("-dx(a)", "0").code_and_hint(), needs_a_grid("axis x"));
  EXPECT_EQ(with("-a", "sin(x)").code_and_hint(), needs_a_grid("axis x"));
}

TEST(Scenes, CellsOfAnAxisGoBeforeThoseOfAll) {
  const std::string text = R"(
model m { field u; dt(u) = lap(u) }
scene s : m { cells 4; grid x = 0 .. 1, periodic; grid y = 0 .. 1, cells 6, periodic
initial u = 0; time 0 .. 1, step 1 }
scene t = s { cells 5; grid y = 0 .. 1, cells 7, periodic }
scene w = s { cells 5, 3; grid y = 0 .. 1, cells 7, periodic }
)";
  EXPECT_EQ(problem_of(text, {"s", {}, ""}).axes[0].cells, 4);
  EXPECT_EQ(problem_of(text, {"s", {}, ""}).axes[1].cells, 6);
  EXPECT_EQ(problem_of(text, {"t", {}, ""}).axes[0].cells, 5);
  EXPECT_EQ(problem_of(text, {"t", {}, ""}).axes[1].cells, 7);
  EXPECT_EQ(outcome_of(text, {"w", {}, ""}).diagnostics.front().message, "the number of cells of y is given twice");
}

}  // namespace
}  // namespace dpde::model
