// SPDX-License-Identifier: Apache-2.0
// Output fields other than states: names of the model and solutions, compared with values computed by hand from the
// states in the same file.
#include <cmath>
#include <numbers>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

class Shown : public Command {};

constexpr int columns = 8, rows = 6;

const std::string swirl = R"(
model swirl {
  vector u on faces
  field c
  param nu = 0.01
  let w = curl(u)
  let g = grad(c)
  let heavy = c*c
  let is_fast = u.x > 1
  dt(u) = nu*lap(u)
  dt(c) = -div(interpolate(c)*u)
}
scheme plain { dx = central(2); lap = central(2); time = rk2 }
scene s : swirl with plain {
  grid x = 0 .. 8, cells 8, periodic
  grid y = 0 .. 6, cells 6, periodic
  initial u = (sin(2*pi*y/6), cos(2*pi*x/8))
  initial c = 2 + cos(2*pi*x/8)*sin(2*pi*y/6)
  time 0 .. 1, step 0.25
  output w, g every 0.5
  output u, c every 0.5
  output heavy
}
)";

/// Of state `k`, periodic.
struct Plane {
  std::vector<double> values;
  int k;
  double operator()(int x, int y) const {
    const int i = (x + columns) % columns, j = (y + rows) % rows;
    return values[static_cast<std::size_t>((k * rows + j) * columns + i)];
  }
};

TEST_F(Shown, LetsLieWhereTheirFormulasDo) {
  write("s.dpde", swirl);
  const Outcome outcome = dpde("run s.dpde s --out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const NetcdfFile file(path("o/s.nc").string());
  EXPECT_EQ(file.dimensions("w"), (std::vector<std::string>{"time", "y_faces", "x_faces"}));
  EXPECT_EQ(file.dimensions("g_x"), (std::vector<std::string>{"time", "y", "x_faces"}));
  ASSERT_EQ(file.values("time").size(), 3u);
  ASSERT_EQ(file.values("heavy").size(), std::size_t{2 * columns * rows});
  for (int k = 0; k < 3; ++k) {  // cells have length 1
    const Plane ux{file.values("u_x"), k}, uy{file.values("u_y"), k}, c{file.values("c"), k};
    const Plane w{file.values("w"), k}, gx{file.values("g_x"), k}, gy{file.values("g_y"), k};
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        EXPECT_NEAR(w(x, y), uy(x + 1, y) - uy(x, y) - (ux(x, y + 1) - ux(x, y)), 1e-14);
        EXPECT_NEAR(gx(x, y), c(x + 1, y) - c(x, y), 1e-14);
        EXPECT_NEAR(gy(x, y), c(x, y + 1) - c(x, y), 1e-14);
      }
    }
  }
  const std::vector<double> heavy = file.values("heavy"), c = file.values("c");
  for (std::size_t i = 0; i < columns * rows; ++i) EXPECT_NEAR(heavy[i], c[i] * c[i], 1e-14);
  EXPECT_EQ(read_npy(path("o/w.npy")).values.size(), std::size_t{columns * rows});
}

const std::string poisson = R"(
model gravity { field rho; solve lap(phi) = rho for phi; dt(rho) = -rho }
scheme plain { lap = central(2); time = rk4 }
scene s : gravity with plain {
  grid x = 0 .. 1, cells 64
  boundary rho: x = 0
  boundary phi: x = 0
  initial rho = -pi^2*sin(pi*x)
  time 0 .. 0.5, step 1/16
  output phi every 1/4
}
)";

/// phi = sin(pi*x)*exp(-t) by a difference of second order with a known factor.
TEST_F(Shown, WhatIsSolvedForIsThatOfTheState) {
  write("s.dpde", poisson);
  ASSERT_EQ(dpde("run s.dpde --quiet --out o").status, 0);
  const NetcdfFile file(path("o/s.nc").string());
  const std::vector<double> phi = file.values("phi"), x = file.values("x"), t = file.values("time");
  ASSERT_EQ(phi.size(), 3u * 64u);
  const double h = 1.0 / 64, factor = std::pow(std::numbers::pi * h / 2 / std::sin(std::numbers::pi * h / 2), 2);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 64; ++i)
      EXPECT_NEAR(phi[k * 64 + i], factor * std::sin(std::numbers::pi * x[i]) * std::exp(-t[k]), 2e-6) << k << " " << i;
  }
}

/// A stopped and resumed run writes the same file.
TEST_F(Shown, RestartsGoOnWithThem) {
  write("s.dpde", poisson);
  ASSERT_EQ(dpde("run s.dpde --quiet --out whole").status, 0);
  ASSERT_EQ(dpde("run s.dpde --quiet --out parts --checkpoint-every 2 --set end=0.25").status, 0);
  ASSERT_EQ(dpde("run s.dpde --quiet --out parts --resume").status, 0);
  EXPECT_EQ(NetcdfFile(path("parts/s.nc").string()).values("phi"),
            NetcdfFile(path("whole/s.nc").string()).values("phi"));
}

TEST_F(Shown, ConditionsAndParametersAreNone) {
  std::string text = swirl;
  text.replace(text.find("output heavy"), 12, "output is_fast, nu, w");
  write("s.dpde", text);
  EXPECT_EQ(dpde("check s.dpde s --json").codes(), (std::vector<std::string>{"E0313", "E0313", "E0303"}));
}

/// Without fields on faces: values at the centres; an output changes nothing else of the scene.
TEST_F(Shown, OutputsChangeNothingElse) {
  const auto text = [](const std::string& output) {
    return "model m { field u; let d = dx(u); let g = grad(u); let q = max(u); let r = dx(u - mean(u, x))\n"
           "  dt(u) = dx(u)*mean(dx(u)^2) }\n"
           "scheme c { dx = central(2); time = rk4 }\n"
           "scene s : m with c {\n  grid x = 0 .. 1, cells 16, periodic\n  grid y = 0 .. 1, cells 5, periodic\n"
           "  initial u = sin(2*pi*x)*cos(2*pi*y)\n  observe e = integral(dx(u)^2)\n  time 0 .. 0.01, step 0.005\n" +
           output + "}\n";
  };
  write("without.dpde", text(""));
  write("with.dpde", text("  output d, g, q, r, u\n"));
  const Outcome without = dpde("run without.dpde s --json"), with = dpde("run with.dpde s --json --out o");
  ASSERT_EQ(with.status, 0) << with.err;
  EXPECT_EQ(with.json()["observables"], without.json()["observables"]);
  const NetcdfFile file(path("o/s.nc").string());
  EXPECT_EQ(file.dimensions("d"), (std::vector<std::string>{"time", "y", "x"}));
  const std::vector<double> d = file.values("d"), gx = file.values("g_x"), u = file.values("u"), q = file.values("q");
  const std::vector<double> r = file.values("r");
  double most = 0;
  for (std::size_t i = 80; i < 160; ++i) most = std::max(most, u[i]);
  for (std::size_t i = 80; i < 160; ++i) {  // the last state, cells of length 1/16
    const std::size_t row = i / 16 * 16;
    const double slope = (u[row + (i + 1) % 16] - u[row + (i + 15) % 16]) * 8;
    EXPECT_NEAR(d[i], slope, 1e-13);
    EXPECT_NEAR(gx[i], slope, 1e-13);
    EXPECT_NEAR(r[i], slope, 1e-12);
    EXPECT_EQ(q[i], most);
  }
}

/// On the sphere, with poles: the fields named in the example are written.
TEST_F(Shown, OfTheFilteredSphere) {
  write("s.dpde", "import \"" DPDE_SOURCE_DIR
                  "/dsl-examples/sphere/filtered.dpde\"\n"
                  "scene seen = wholly_filtered_rotation { output q, turn_east, flux, h }\n");
  const Outcome run = dpde("run s.dpde seen --force --quiet --out o --set cells.x=16 --set cells.y=8 --set end=960");
  ASSERT_EQ(run.status, 0) << run.err;
  const NetcdfFile file(path("o/seen.nc").string());
  for (const double value : file.values("q")) EXPECT_LT(std::abs(value), 1e-6);
  EXPECT_EQ(file.values("flux_x").size(), 2u * 16 * 8);
}

/// For a control, the interval at the end of a shorter run differs from the one where the run continues.
TEST_F(Shown, AreRenewedWhereARunGoesOn) {
  write("s.dpde", R"(
model m { field u; control F; let pushed = u + F; dt(u) = F }
scene s : m {
  grid x = 0 .. 1, cells 4, periodic
  F = t every 0.2
  initial u = 0
  time 0 .. 0.8, step 0.1
  output pushed every 0.2
})");
  ASSERT_EQ(dpde("run s.dpde --quiet --out whole").status, 0);
  ASSERT_EQ(dpde("run s.dpde --quiet --out parts --checkpoint-every 2 --set end=0.4").status, 0);
  ASSERT_EQ(dpde("run s.dpde --quiet --out parts --checkpoint-every 2 --resume --set end=0.6").status, 0);
  ASSERT_EQ(dpde("run s.dpde --quiet --out parts --resume").status, 0);
  EXPECT_EQ(NetcdfFile(path("parts/s.nc").string()).values("pushed"),
            NetcdfFile(path("whole/s.nc").string()).values("pushed"));
}

TEST_F(Shown, ComponentsAndUnits) {
  write("s.dpde", R"(
model m { field c in kg; param k = 1 in m^2/s; let g = grad(c); let broken = c + g; dt(c) = k*lap(c) }
scene s : m {
  grid x = 0 .. 1 in m, cells 8, periodic
  grid y = 0 .. 1 in m, cells 8, periodic
  initial c = 1
  time 0 .. 0.001 in s, step 0.001
  output g.y
})");
  EXPECT_EQ(dpde("check s.dpde s --json").codes().size(), 1u);  // only of `broken`
  std::string text = swirl;
  text.replace(text.find("output heavy"), 12, "output heavy, is_slow");
  text.replace(text.find("let is_fast = u.x > 1"), 21, "let is_slow = u.x + nothing");
  write("t.dpde", text);
  EXPECT_EQ(dpde("check t.dpde s --json").codes(), std::vector<std::string>{"E0301"});
}

/// A field used only through a let counts as used.
TEST_F(Shown, AreReasonsForFields) {
  const auto unused = [&](const std::string& output) {
    write("s.dpde",
          "model m { field u, v; let w = v*v; dt(u) = -u; dt(v) = -v }\nscene s : m {\n"
          "  grid x = 0 .. 1, cells 8, periodic\n  initial u = 1\n  initial v = 1\n  time 0 .. 1, step 0.1\n"
          "  output " +
              output + "\n}\n");
    return dpde("check s.dpde s --json").json()["unused"].size();
  };
  EXPECT_EQ(unused("u"), 1u);
  EXPECT_EQ(unused("u, w"), 0u);
}

}  // namespace
}  // namespace dpde::testing
