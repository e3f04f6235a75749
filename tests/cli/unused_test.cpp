// SPDX-License-Identifier: Apache-2.0
// `dpde check` lists unused parts of a scene, with reasons, as in its programs.
#include "command_support.h"

namespace dpde::testing {
namespace {

class Unused : public Command {
 protected:
  /// Kind and name of all items that `check` lists, in order; `json` gets the entries themselves.
  std::vector<std::string> parts(const std::string& text, const std::string& name, Json* json = nullptr) const {
    write("s.dpde", text);
    const Outcome check = dpde("check s.dpde " + name + " --json");
    EXPECT_EQ(check.status, 0) << check.err;
    std::vector<std::string> found;
    const Json rows = check.json()["unused"];
    for (const Json& row : rows) found.push_back(row["kind"].get<std::string>() + " " + row["name"].get<std::string>());
    if (json != nullptr) *json = rows;
    return found;
  }
};

const std::string plane = "  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 6, periodic\n";
const std::string short_run = "  time 0 .. 1/64, step 1/512\n}\n";

std::vector<std::string> nothing() { return {}; }

/// c is advected, and no observable depends on it; v is not observed itself, but u depends on it.
TEST_F(Unused, FieldsThatNothingObservedDependsOn) {
  const std::string model =
      "model m {\n  field u, v, c\n  dt(u) = lap(u) + v\n  dt(v) = lap(v) - u\n  dt(c) = lap(c) + u\n}\n";
  const std::string scene =
      "scene s : m {\n" + plane + "  initial u = sin(2*pi*x)*sin(2*pi*y)\n  initial v = y\n  initial c = x\n";
  Json rows;
  EXPECT_EQ(parts(model + scene + "  observe energy = mean(u^2)\n" + short_run, "s", &rows),
            std::vector<std::string>{"field c"});
  EXPECT_EQ(rows[0]["place"]["line"], 5);
  EXPECT_EQ(parts(model + scene + "  observe energy = mean(u^2)\n  output c\n" + short_run, "s"), nothing());
  EXPECT_EQ(parts(model + scene + short_run, "s"), nothing()) << "without anything observed the states are the result";
}

/// The loss reads only u, and k is only in u's equation: v gets no adjoint from the loss, w none that leads to k.
TEST_F(Unused, AdjointsThatAGradientDoesNotNeed) {
  const std::string text =
      "model m {\n  field u, v, w\n  coefficient q\n  param k\n  dt(w) = lap(w)\n  dt(u) = k*lap(u) + w\n"
      "  dt(v) = q*lap(v) + u\n}\nscene s : m {\n" +
      plane + "  k = 0.1\n  q = 1 + x\n  initial u = sin(2*pi*x)*y\n  initial v = y\n  initial w = x\n" + short_run +
      "task t : s {\n  unknown k from 0.2\n  minimise mean(u^2)\n}\n";
  std::vector<std::string> found = parts(text, "t");
  EXPECT_EQ(found, (std::vector<std::string>{"field v", "adjoint v", "adjoint w", "adjoint q", "history v"}));
}

/// The adjoint of linear diffusion reads no states.
TEST_F(Unused, HistoriesThatNoAdjointReads) {
  const auto text = [](const std::string& rate) {
    return "model m { field u; dt(u) = " + rate + " }\nscene s : m {\n" + plane + "  initial u = sin(2*pi*x)*y\n" +
           short_run + "task t : s {\n  unknown initial u\n  minimise mean(u^2)\n}\n";
  };
  EXPECT_EQ(parts(text("lap(u)"), "t"), std::vector<std::string>{"history u"});
  EXPECT_EQ(parts(text("lap(u) - u^3"), "t"), nothing());
}

/// A field that reacts without diffusion needs no ghost cells; with diffusion along x only, half of them.
TEST_F(Unused, HalosThatNothingReads) {
  const auto text = [](const std::string& rate) {
    return "model m { field u, v; dt(u) = lap(u) - v; dt(v) = " + rate + " }\nscene s : m {\n" + plane +
           "  initial u = sin(2*pi*x)*y\n  initial v = x*y\n" + short_run;
  };
  Json rows;
  EXPECT_EQ(parts(text("u - v"), "s", &rows), std::vector<std::string>{"halo v"});
  EXPECT_NE(rows[0]["reason"].get<std::string>().find("along x and y"), std::string::npos) << rows;
  EXPECT_EQ(parts(text("u - dx(v)"), "s", &rows), std::vector<std::string>{"halo v"});
  EXPECT_NE(rows[0]["reason"].get<std::string>().find("along y:"), std::string::npos) << rows;
  EXPECT_EQ(parts(text("u - dx(v) - dy(v)"), "s"), nothing());
}

/// Reported only if `dpde tune` has verified it by runs, for this text.
TEST_F(Unused, PrecisionIsKnownFromTune) {
  const std::string text =
      "model m { field u; dt(u) = -advect(1, u) }\nscheme k { advect = central(4); time = rk4 }\nscene s : m with k {\n"
      "  grid x = 0 .. 2*pi, cells 32, periodic\n  initial u = sin(x)\n  exact u = sin(x - t)\n  time 0 .. 1, step "
      "1/32\n}\n";
  EXPECT_EQ(parts(text, "s"), nothing());
  const Outcome tune =
      dpde("tune s.dpde s --tolerance 1e-3 --vary real=f32,f64 --samples 1 --sample-seconds 0.001 --json");
  ASSERT_EQ(tune.status, 0) << tune.err;
  const bool is_single = tune.json()["chosen"]["real"] == "f32";
  EXPECT_EQ(parts(text, "s"), is_single ? std::vector<std::string>{"precision f64"} : nothing());
  EXPECT_EQ(parts(text + "# another text\n", "s"), nothing());
}

class IdleAxis : public Unused {
 protected:
  std::vector<std::string> axes(const std::string& rate, const std::string& initial, const std::string& more = "",
                                const std::string& y = ", periodic") const {
    return parts("model m { field u; coefficient q; dt(u) = q*lap(u) + " + rate +
                     " }\nscene s : m {\n  grid x = 0 .. 1, "
                     "cells 8, periodic\n  grid y = 0 .. 1, cells 6" +
                     y + "\n  q = 1 + x^2\n  initial u = " + initial + "\n" + more + short_run,
                 "s");
  }
};

TEST_F(IdleAxis, IsOneAlongWhichNothingVaries) {
  using List = std::vector<std::string>;
  const std::string insulated = "  boundary u: y = zero_gradient\n";
  EXPECT_EQ(axes("0", "x"), (List{"halo q", "axis y"}));
  EXPECT_EQ(axes("dy(u)^2 - u", "sin(2*pi*x)"), (List{"halo q", "axis y"}));
  EXPECT_EQ(axes("0", "x", insulated, ""), (List{"halo q", "axis y"}));
  EXPECT_EQ(axes("0", "x + y"), List{"halo q"}) << "the start varies";
  EXPECT_EQ(axes("y", "x"), List{"halo q"}) << "forcing varies";
  EXPECT_EQ(axes("0", "x", "  boundary u: y = 0\n", ""), List{"halo q"}) << "walls make it vary";
  EXPECT_EQ(axes("0", "x", "  boundary u: y.low = zero_gradient, y.high = gradient(1)\n", ""), List{"halo q"});
}

TEST_F(IdleAxis, SaysHowMuchWorkItIs) {
  write("s.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n" + plane + "  initial u = sin(2*pi*y)\n" + short_run);
  const Outcome check = dpde("check s.dpde --all");
  EXPECT_NE(check.out.find("unused axis x"), std::string::npos) << check.out;
  EXPECT_NE(check.out.find("a grid of y alone is 8 times less work"), std::string::npos) << check.out;
}

/// A jumping condition is reported once: as unused, or because a gradient lacks the jump.
TEST_F(Unused, ASideThatNothingReadsJumpsForNobody) {
  const auto text = [](const std::string& rate, const std::string& low, const std::string& v) {
    return "model m { field u; field v; param k; dt(u) = " + rate +
           "; dt(v) = u }\nscene s : m {\n  grid x = 0 .. 1, "
           "cells 8; k = 0.5\n  boundary u: x.low = " +
           low + ", x.high = zero_gradient\n  boundary v: x = " + v +
           "\n  initial u = 1 + x; initial v = x; time 0 .. 0.01, step 0.001 }\ntask t : s { unknown k; minimise "
           "mean(u^2) }\n";
  };
  for (const std::string jump : {"if(k > 0.2, k, 0)", "k*fraction(3*k)", "if(v > 0.2, k, 0)", "k*sign(k - 0.2)"}) {
    write("read.dpde", text("k*lap(u)", jump, "zero_gradient"));
    EXPECT_EQ(dpde("gradient read.dpde t --json").codes(), std::vector<std::string>{"E0609"}) << jump;
    write("idle.dpde", text("-k*u", jump, "zero_gradient"));
    const Outcome idle = dpde("gradient idle.dpde t --json");
    EXPECT_EQ(idle.codes(), std::vector<std::string>{"W0502"}) << jump << idle.err;
    write("none.dpde", text("-k*u", "zero_gradient", "zero_gradient"));
    EXPECT_EQ(idle.json()["gradient"], dpde("gradient none.dpde t --json").json()["gradient"]) << jump;
  }
}

}  // namespace
}  // namespace dpde::testing
