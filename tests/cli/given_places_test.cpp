// SPDX-License-Identifier: Apache-2.0
// Given adjoints are checked at the scene's positions: an error in one per cent of the domain, or in one cell, is
// refused.
#include <regex>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class GivenPlaces : public Command {
 protected:
  /// The code of the error that ends a gradient, or "".
  std::string code_of(const std::string& text) {
    write("given.dpde", text);
    const Outcome outcome = dpde("gradient given.dpde t --no-certify --force --json");
    const std::vector<std::string> codes = outcome.codes();
    EXPECT_EQ(outcome.status == 0, codes.empty()) << outcome.err;
    return codes.empty() ? "" : codes[0];
  }
};

std::string put(std::string text, const std::vector<std::pair<std::string, std::string>>& words) {
  for (const auto& [word, value] : words) text = std::regex_replace(text, std::regex(word), value);
  return text;
}

constexpr const char* one_axis = R"(
operator rise(u) order 0 = SPEED*(u - u[-1])/hx
  adjoint u_bar = (SPEED*rise_bar - NEXT*rise_bar[+1])*FACTOR/hx
model m { field u; param a; dt(u) = -a*rise(u) }
scene s : m {
  grid x = LOW .. HIGH, cells CELLS WALLS
  a = 1e-3
  initial u = 0.1
  time 0 .. 1/4, step 1/16
}
task t : s { unknown initial u; minimise mean(u^2) }
)";

const std::string walls = "\n  boundary u: x = 0.2";

std::string line(const std::string& factor, int cells, const std::string& low = "0", const std::string& high = "1") {
  return put(one_axis, {{"SPEED", "1"},
                        {"NEXT", "1"},
                        {"FACTOR", factor},
                        {"CELLS", std::to_string(cells)},
                        {"WALLS", walls},
                        {"LOW", low},
                        {"HIGH", high}});
}

/// Errors in one per cent of the axis, in the first, the last or a middle cell; with few and very many cells, on small
/// and large axes.
TEST_F(GivenPlaces, WrongSomewhereIsRefused) {
  std::vector<int> sizes{1, 3, 128, 50000};
  if (is_thorough()) sizes.insert(sizes.end(), {2, 3000});
  for (const int cells : sizes) {
    const std::string h = std::to_string(1.0 / cells);
    EXPECT_EQ(code_of(line("1", cells)), "");
    EXPECT_EQ(code_of(line("if(x < 2, 1, 1.5)", cells)), "") << "nowhere";
    for (const std::string wrong :
         {"if(x < 1/CELLS, 1.5, 1)", "if(x > 1 - 1/CELLS, 1.5, 1)", "if(x > 1 - 1/CELLS, 1.000001, 1)",
          "if(abs(x - (floor(CELLS/3) + 1/2)/CELLS) < 1/CELLS/2, 1.5, 1)"}) {
      EXPECT_EQ(code_of(line(wrong, cells)), "E0606") << wrong << " " << cells;
    }
    if (cells < 100) continue;
    for (const std::string wrong :
         {"if(x < 0.01, 1.5, 1)", "if(x > 0.99, 1.5, 1)", "(1 + 0.5*exp(-((x - 0.7)/0.01)^2))",
          "(1 + max(0, x - 0.99))", "(1 + abs(x - 0.01) - (x - 0.01))"}) {
      EXPECT_EQ(code_of(line(wrong, cells)), "E0606") << wrong << " " << cells;
    }
  }
  EXPECT_EQ(code_of(line("if(x > 9800, 1.5, 1)", 100, "-10000", "10000")), "E0606");
  EXPECT_EQ(code_of(line("if(x > 10001, 1.5, 1)", 100, "-10000", "10000")), "");
  EXPECT_EQ(code_of(line("if(x < -0.99e-6, 1.5, 1)", 200, "-1e-6", "1e-6")), "E0606");
}

/// Correct formulas of the position, with walls: x + hx is the neighbour's position. Across a periodic boundary it is
/// not, unless the formula is periodic.
TEST_F(GivenPlaces, RightOnesPass) {
  const auto formula = [](const std::string& speed, const std::string& next, const std::string& sides) {
    return put(one_axis, {{"SPEED", speed},
                          {"NEXT", next},
                          {"FACTOR", "1"},
                          {"CELLS", "64"},
                          {"WALLS", sides},
                          {"LOW", "0"},
                          {"HIGH", "1"}});
  };
  for (const char* at : {"(1 + x)", "if(x < 0.1, 2, 1)", "if(x > 1 - 1/64, 2, 1)", "(1.5 + sin(2*pi*x))"}) {
    const std::string next = std::regex_replace(std::string(at), std::regex("x"), "(x + hx)");
    EXPECT_EQ(code_of(formula(at, next, walls)), "") << at;
    EXPECT_EQ(code_of(formula(at, at, walls)), "E0606") << at;
  }
  EXPECT_EQ(code_of(formula("(1 + x)", "(1 + x + hx)", ", periodic")), "E0606");
  EXPECT_EQ(code_of(formula("(1.5 + sin(2*pi*x))", "(1.5 + sin(2*pi*(x + hx)))", walls)), "");
  EXPECT_EQ(code_of(formula("1", "if(x < 3, 1, 2)", ", periodic")), "");
  EXPECT_EQ(code_of(formula("1", "if(x > 0.98, 2, 1)", ", periodic")), "E0606");
}

constexpr const char* two_axes = R"(
operator rise(u, c) order 0 = (u - u[-1, 0])*c/hx
  adjoint u_bar = (c*rise_bar - c*rise_bar[+1, 0])*FACTOR/hx
model m { field u; param a, edge; dt(u) = -rise(u, a) + 0*edge }
scene s : m {
  grid x = 0 .. 1, cells CELLS
  grid y = 0 .. 1000, cells CELLS, periodic
  a = 0.01
  edge = 0
  boundary u: x = 0.2
  initial u = 0.1
  time 0 .. 1/4, step 1/16
}
task t : s { unknown initial u; minimise mean(u^2) }
)";

TEST_F(GivenPlaces, OnTwoAxes) {
  for (const char* cells : {"12", "200"}) {
    const auto code = [&](const std::string& factor) {
      return code_of(put(two_axes, {{"FACTOR", factor}, {"CELLS", cells}}));
    };
    EXPECT_EQ(code("1"), "");
    EXPECT_EQ(code("if(x < 2 and y < 1001, 1, 2)"), "");
    const std::string n = std::string("/") + cells;
    for (const std::string& wrong : {"if(x < 1" + n + ", 2, 1)", "if(y > 1000 - 1000" + n + ", 2, 1)",
                                     "if(x > 1 - 1" + n + " and y < 1000" + n + ", 2, 1)",
                                     std::string("if((x - 0.3)^2 + (y/1000 - 0.6)^2 < 0.01, 2, 1)")}) {
      EXPECT_EQ(code(wrong), "E0606") << wrong << " " << cells;
    }
  }
}

/// In kernels, whose formulas may read x at neighbours; the threshold is a parameter of the scene.
TEST_F(GivenPlaces, OfKernels) {
  const std::string text = R"(
kernel step(u: field halo 1, x: field halo 1, out v: field, edge, dt: param) {
  let c = if(x < edge, 2, 1)
  v = u - dt*c*(u - u[-1])
  adjoint u_bar = v_bar - dt*(if(x < edge, 2, 1)*v_bar - if(x[+1] < edge, 2, NEXT)*v_bar[+1])
}
program move { fill u x = 0.2; run step; swap u, v }
scene s : move {
  grid x = 0 .. 1000, cells 400
  edge = 5
  initial u = 0.1
  time 0 .. 1/4, step 1/16
}
task t : s { unknown initial u; minimise mean(u^2) }
)";
  EXPECT_EQ(code_of(put(text, {{"NEXT", "1"}})), "");
  EXPECT_EQ(code_of(put(text, {{"NEXT", "if(x > 990, 1.1, 1)"}})), "E0606");
  EXPECT_EQ(code_of(put(text, {{"NEXT", "1"}, {"2, 1\\)\\*v_bar -", "2 + if(x > edge - 3, 0.1, 0), 1)*v_bar -"}})),
            "E0606");
}

}  // namespace
}  // namespace dpde::testing
