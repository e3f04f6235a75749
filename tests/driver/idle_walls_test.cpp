// SPDX-License-Identifier: Apache-2.0
// Reports of boundary conditions that nothing reads.
#include "driver_support.h"

namespace dpde::testing {
namespace {

/// The codes of the compiler's messages on scene s or task t, with the text at their positions.
std::string told(const std::string& text, const std::string& name) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = name;
  driver::compile(source, options, sink);
  std::string all;
  for (const Diagnostic& d : sink.all()) {
    EXPECT_TRUE(d.range.is_known());
    EXPECT_FALSE(d.hint.empty());
    all += (all.empty() ? "" : "; ") + std::string(d.kind->code) + " " +
           text.substr(static_cast<std::size_t>(d.range.begin), static_cast<std::size_t>(d.range.end - d.range.begin));
  }
  return all;
}

/// Long waves in a channel, velocities on the walls.
std::string channel(const std::string& eta, const std::string& u, const std::string& more = "",
                    const std::string& scheme = "", const std::string& initial = "0") {
  return "model tide { field u on faces.x; field eta; param nu, A; dt(eta) = -dx(u)" + more +
         "; dt(u) = -dx(eta) }\nscheme c { time = rk4" + scheme +
         " }\nscene s : tide with c {\n  grid x = 0 .. 1, cells 16\n  nu = 0.1\n  A = 0.5\n  boundary eta: " + eta +
         "\n  boundary u: " + u + "\n  initial eta = " + initial +
         "\n  initial u = 0\n  time 0 .. 0.5, step 1/64\n  observe o = mean(eta) + A*nu\n}\n"
         "task t : s { unknown A; minimise sample(eta, at = 0.6)^2 + mean((eta - A)^2) }\n";
}

/// A linearly extrapolated flux changes the value.
TEST(IdleWalls, AStraightLineIsNoOpenEnd) {
  EXPECT_EQ(told(channel("x = 2", "x = linear", "", "", "2"), "s"), "E0558 2");
  EXPECT_EQ(told(channel("x = linear", "x = linear"), "s"), "");
}

TEST(IdleWalls, SilentWhereTheStepReadsThem) {
  EXPECT_EQ(told(channel("x = zero_gradient", "x = 0"), "s"), "");
  EXPECT_EQ(told(channel("x = gradient(0)", "x = 0"), "s"), "");
  EXPECT_EQ(told(channel("x = A*t", "x = 0", " + nu*lap(eta)"), "s"), "");
  EXPECT_EQ(told(channel("x = A*t", "x = 0", "", "; dx = central(4)"), "s"), "");  // from the second inner face
}

TEST(IdleWalls, OfFieldsThatNobodyDifferentiates) {
  const auto ode = [](const std::string& rate, const std::string& observed) {
    return "model m { field u; dt(u) = " + rate +
           " }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  boundary u: x.low = 3, x.high = 4\n  initial u = 1\n" +
           "  time 0 .. 1, step 1/8\n  observe o = " + observed + "\n}\n";
  };
  EXPECT_EQ(told(ode("-u", "mean(u)"), "s"), "W0502 3; W0502 4");
  EXPECT_EQ(told(ode("-u", "mean(dx(u)^2)"), "s"), "");
  EXPECT_EQ(told(ode("-u", "sample(u, at = 0.5)"), "s"), "");
  EXPECT_EQ(told(ode("lap(u)", "mean(u)"), "s"), "");
  EXPECT_EQ(told(ode("-mean(dx(u))", "mean(u)"), "s"), "");
}

TEST(IdleWalls, DtOfUHasTheBoundaryOfU) {
  const std::string text =
      "model m { field u; dt(dt(u)) = lap(dt(u)) - u }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  boundary u: x = "
      "3\n  initial u = 3\n"
      "  initial dt(u) = 0\n  time 0 .. 1, step 1/256\n}\n";
  EXPECT_EQ(told(text, "s"), "");
}

/// A condition is read if any formula of the scene takes a difference there.
TEST(IdleWalls, SilentWhereAnyPlaceReadsThem) {
  const std::string neutral = "u/2";
  const auto text = [&](const std::string& slot, const std::string& read) {
    const auto at = [&](const std::string& name) { return name == slot ? read : neutral; };
    const std::string equation = slot == "operator" ? "phi" : at("equation");
    return "model m {\n  field u, v\n  mask solid\n  solve div((1 + " + at("operator") +
           ")*grad(phi)) - phi = " + at("right") + " for phi\n  dt(u) = -u + " + (slot == "right" ? "phi" : equation) +
           "\n  dt(v) = 0\n  v = " + at("held") + " inside solid\n  let q = u + " + at("output") +
           "\n}\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  solid = x < 0.5\n  boundary u: x = 3\n" +
           "  boundary v: x = zero_gradient\n  boundary phi: x = zero_gradient\n  initial u = 1\n  initial v = 0\n" +
           "  time 0 .. 1, step 1/8, courant 0.5, speed 1 + |" + at("speed") + "|\n  after step: u = u + " +
           at("event") + "\n  observe o = mean(" + at("observable") + ")\n  output q\n}\n" +
           "task t : s { unknown initial u; minimise mean(" + at("loss") + "); test e = mean(" + at("test") + ") }\n";
  };
  EXPECT_EQ(told(text("none", ""), "t"), "W0502 3");
  for (const char* slot :
       {"equation", "operator", "right", "held", "speed", "event", "observable", "output", "loss", "test"})
    EXPECT_EQ(told(text(slot, "dx(u)"), "t"), "") << slot;
}

}  // namespace
}  // namespace dpde::testing
