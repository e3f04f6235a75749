// SPDX-License-Identifier: Apache-2.0
// Band-pass filters: shells of known waves, derivatives on all small grids, both back ends and the text, and axes
// without shells.
#include <cmath>

#include "command_support.h"

namespace dpde::testing {
namespace {

/// Waves of wavenumber 3, hypot(4, 3) = 5 and 0.
std::string waves(const std::string& field, const std::string& lines, const std::string& extent = "2*pi") {
  const std::string wave = "0.5 + 2*cos(3*x) + cos(4*x - 3*y + 1)";
  const std::string component = field.starts_with("vector") ? "(" + wave + ", 0)" : wave;
  return "model m { " + field + "; param nu = 0\n  dt(u) = nu*lap(u) }\n" + "scene s : m { grid x = 0 .. " + extent +
         ", cells 16, periodic; grid y = 0 .. " + extent + ", cells 12, periodic\n  initial u = " + component +
         "; time 0 .. 1, step 1\n" + lines + "}\n";
}

class BandPass : public Command {
 protected:
  Json observed(const std::string& text, const std::string& more = "") const {
    write("t.dpde", text);
    const Outcome outcome = dpde("run t.dpde s --json --quiet " + more);
    EXPECT_EQ(outcome.status, 0) << text << outcome.err;
    return outcome.json()["observables"];
  }
};

double last_of(const Json& observables, const std::string& name) { return observables[name].get<double>(); }

/// For every placement: the mean square of a cosine is a half.
TEST_F(BandPass, HasTheEnergyOfItsShells) {
  for (const std::string field : {"field u", "field u on nodes", "vector u on faces"}) {
    const std::string u = field.starts_with("vector") ? "u.x" : "u";
    const auto energy = [&](const std::string& shells) { return "mean(band_pass(" + u + ", " + shells + ")^2)"; };
    const Json seen =
        observed(waves(field, "  observe none = " + energy("0") + "\n  observe three = " + energy("3") +
                                  "\n  observe five = " + energy("4, 8") + "\n  observe both = " + energy("1, 5") +
                                  "\n  observe rest = " + energy("6, 100") + "\n  observe left = mean((" + u +
                                  " - band_pass(" + u + ", 0, 9))^2)\n"));
    EXPECT_NEAR(last_of(seen, "none"), 0.25, 1e-13) << field;
    EXPECT_NEAR(last_of(seen, "three"), 2, 1e-13) << field;
    EXPECT_NEAR(last_of(seen, "five"), 0.5, 1e-13) << field;
    EXPECT_NEAR(last_of(seen, "both"), 2.5, 1e-13) << field;
    EXPECT_NEAR(last_of(seen, "rest"), 0, 1e-13) << field;
    EXPECT_NEAR(last_of(seen, "left"), 0, 1e-13) << field;
  }
}

/// The same shells as for spectra: on axes of lengths 1 and 2/3 a wave along the shorter one has wavenumber 1.5, shell
/// 2. Filtering commutes with derivatives.
TEST_F(BandPass, CountsAsSpectraDo) {
  const Json seen = observed(
      "model m { field u; dt(u) = 0*u }\nscheme w { dx = spectral; time = euler }\nscene s : m with w {\n"
      "  grid x = 0 .. 1, cells 9, periodic; grid y = 0 .. 2/3, cells 8, periodic; grid z = 0 .. 1, cells 1, periodic\n"
      "  initial u = cos(3*pi*y) + sin(4*pi*x); time 0 .. 1, step 1\n"
      "  observe one = mean(band_pass(u, 1)^2); observe two = mean(band_pass(u, 2)^2)\n"
      "  observe slope = mean((band_pass(dx(u), 2) - dx(band_pass(u, 2)))^2) }\n");
  EXPECT_NEAR(last_of(seen, "one"), 0, 1e-13);
  EXPECT_NEAR(last_of(seen, "two"), 1, 1e-13);
  EXPECT_NEAR(last_of(seen, "slope"), 0, 1e-11);
}

const std::string closed = R"(
model m { field u; param nu = 0.02, a = 1; dt(u) = -u*dx(u) + nu*lap(u) }
function near(a, b, k) = (average(mean(band_pass(a, k)^2))/average(mean(band_pass(b, k)^2)) - 1)^2
scene s : m { grid x = 0 .. 2*pi, cells 12, periodic; grid y = 0 .. 3, cells 5, periodic
  initial u = a*sin(x) + 0.3*cos(2*x + 2*pi*y/3); time 0 .. 1/2, step 1/32 }
dataset train : s { runs 2; seed 1; vary a in 0.5 .. 1.5; frames every 1/16; file "train.nc" }
task t : s { data r = u from scene s over time; unknown nu from 0.04; unknown initial u from 0.5*sin(x)
  minimise mean(band_pass(u - r, 1, 2)^2*(1 + band_pass(u, 0, 3))) over time
  using lbfgs(), iterations 4 }
task learn : s { data r = trajectories("train.nc", u); unknown nu from 0.04
  minimise near(u, r, 1) over 4 steps
  minimise near(u, r, 1 + 1) over 4 steps
  using lbfgs(), epochs 15 }
)";

/// By tangents, adjoints and Hessian products, on all small grids; also for losses of spectra.
TEST_F(BandPass, HasDerivatives) {
  write("t.dpde", closed);
  const Outcome verify = dpde("verify t.dpde t --json");
  EXPECT_EQ(verify.status, 0) << verify.err;
  EXPECT_LE(verify.json()["dot_product"]["max_relative_error"].get<double>(), 1e-11);
  EXPECT_NEAR(verify.json()["taylor"]["slope"].get<double>(), 2, 0.05);
  ASSERT_EQ(dpde("run t.dpde train --out .").status, 0);
  EXPECT_EQ(dpde("verify t.dpde learn").status, 0);
  const Json learnt = dpde("optimize t.dpde learn --json").json();
  EXPECT_NEAR(learnt["unknowns"]["nu"]["value"].get<double>(), 0.02, 1e-6) << learnt;
}

TEST_F(BandPass, IsTheSameOnEveryBackEndAndReadBack) {
  write("t.dpde", closed);
  const Json one = dpde("gradient t.dpde t --json").json();
  for (const std::string backend : {"interpreter", "cpp"}) {
    const Json other = dpde("gradient t.dpde t --json --backend " + backend).json();
    EXPECT_NEAR(other["loss"].get<double>(), one["loss"].get<double>(), 1e-12 * one["loss"].get<double>()) << backend;
    const double wanted = one["gradient"]["nu"]["value"].get<double>();
    EXPECT_NEAR(other["gradient"]["nu"]["value"].get<double>(), wanted, 1e-10 * std::abs(wanted)) << backend;
  }
  const Outcome text = dpde("emit t.dpde t --stage stencil");
  EXPECT_NE(text.out.find("by heaviside0("), std::string::npos) << text.out;
  write("again.dpde", text.out);
  const Outcome again = dpde("emit again.dpde --stage stencil");
  EXPECT_EQ(again.status, 0) << again.err;
}

}  // namespace
}  // namespace dpde::testing
