// SPDX-License-Identifier: Apache-2.0
// Units in each place of a model, a scene and a task where a formula may stand.
#include <map>
#include <string>

#include "model/model_support.h"

namespace dpde::model {
namespace {

/// In each place where a formula may stand: what fits, and a sum of unlike terms there.
TEST(UnitPlaces, AreAllLookedAt) {
  using Places = std::map<std::string, std::string>;
  const Places fitting{{"body", "q"},
                       {"let", "T0"},
                       {"left", "lap(q)"},
                       {"right", "T/L^2"},
                       {"rate", "k*lap(T)"},
                       {"source", "T0*L/t0"},
                       {"held", "T0"},
                       {"value", "T0"},
                       {"slope", "T0/L"},
                       {"third", "T0"},
                       {"coefficient", "2*c0"},
                       {"control", "T0/t0"},
                       {"mask", "x < 0.5*L"},
                       {"initial", "T0"},
                       {"exact", "T0"},
                       {"every", "0.1*t0"},
                       {"event", "T"},
                       {"observable", "mean(T)"},
                       {"place", "0.3*L"},
                       {"speed", "v0"},
                       {"begin", "1.5*c0"},
                       {"low", "0.1*c0"},
                       {"loss", "mean(T^2)/T0^2"},
                       {"when", "t0"},
                       {"test", "mean(T)"},
                       {"often", "0.5*t0"}};
  const auto text_of = [](Places p) {
    return "function f(q) = " + p["body"] + "\nmodel m {\n  field T, w in K\n  coefficient c in K\n" +
           "  param k = 0.1 in m^2/s, T0 = 1 in K, L = 1 in m, t0 = 1 in s, v0 = 1 in m/s, c0 = 1 in K, c1 = 1 in K\n" +
           "  control field F in K/s\n  mask wall\n  let e0 = " + p["let"] + "\n  solve " + p["left"] +
           " - q/L^2 = " + p["right"] + " for q in K\n  dt(T) = " + p["rate"] +
           " + F + 0*(c1 + c + e0 + q + f(T))/t0 + 0*inject(" + p["source"] + ", at = 0.3*L)\n" +
           "  dt(w) = 0*w/t0\n  w = " + p["held"] + " inside wall\n}\nscene s : m {\n" +
           "  grid x = 0 .. 1 in m, cells 8\n  boundary T: x.low = " + p["value"] + ", x.high = mixed(1, L, " +
           p["third"] + ")\n  boundary w: x.low = gradient(" + p["slope"] + "), x.high = zero_gradient\n" +
           "  boundary q = 0\n  c = " + p["coefficient"] + "\n  F = " + p["control"] + " every " + p["often"] +
           "\n  wall = " + p["mask"] + "\n  initial T = " + p["initial"] + "\n  initial w = T0\n" +
           "  exact T = " + p["exact"] + "\n  every " + p["every"] + ": T = " + p["event"] +
           "\n  observe a = " + p["observable"] + "\n  observe b = sample(T, at = " + p["place"] + ")\n" +
           "  time 0 .. 1 in s, step 0.001, courant 0.5, speed " + p["speed"] + "\n}\ntask t : s {\n" +
           "  unknown c1 from " + p["begin"] + " in " + p["low"] + " .. 3*c0\n  minimise " + p["loss"] +
           " at t = " + p["when"] + "\n  test zz = " + p["test"] + "\n}\n";
  };
  EXPECT_TRUE(outcome_of(text_of(fitting)).diagnostics.empty());
  for (const auto& [place, formula] : fitting) {
    Places other = fitting;
    other[place] = formula + " + v0*" + formula;
    if (place == "mask") other[place] = "x < T0";
    if (place == "body") other[place] = "q + x";  // it knows no parameters
    if (place == "when") other[place] = "L";      // a step ends there
    const Outcome outcome = outcome_of(text_of(other));
    ASSERT_FALSE(outcome.diagnostics.empty()) << place;
    EXPECT_EQ(outcome.diagnostics[0].kind->code, "E0341") << place << " " << outcome.diagnostics[0].message;
  }
}

}  // namespace
}  // namespace dpde::model
