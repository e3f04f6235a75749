// SPDX-License-Identifier: Apache-2.0
// Physical growth of waves by reactions and diffusion, compared with the largest eigenvalue of J - k^2 diag(D) of the
// continuous equations (numerics.md, section 7): on fine grids within 0.1 %.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "driver/compile/pipeline.h"
#include "stability/step_limit.h"

namespace dpde::stability {
namespace {

struct Mixture {
  std::string name, equations;
  double u, v;       // the state at rest
  double growth, k;  // of the wave that grows fastest
  double spacing;
};
std::ostream& operator<<(std::ostream& out, const Mixture& m) { return out << m.name; }

class GrowthOfMixtures : public ::testing::TestWithParam<Mixture> {};

TEST_P(GrowthOfMixtures, IsThatOfTheEquations) {
  const Mixture& mixture = GetParam();
  const std::string text =
      "model m { field u, v; " + mixture.equations + " }\nscheme c { lap = central(4); time = rk4 }\n" +
      "scene s : m with c {\n  grid x = 0 .. 1, cells 8, periodic\n  initial u = 1\n  initial v = 1\n" +
      "  time 0 .. 1, step 0.01\n}\n";
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  const std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message << "\n" << text;
  std::string why;
  const LinearStep linear = LinearStep::make(compiled.value().stencil, compiled->step_name(), why).value();
  const FrozenPoint point{{{"u", mixture.u}, {"v", mixture.v}}, {}, {{"hx", mixture.spacing}, {"t", 0}}};
  const FrozenAnalysis analysis =
      FrozenAnalysis::make(linear, point, 1, 0.01 * mixture.spacing * mixture.spacing).value();
  EXPECT_NEAR(analysis.growth_rate(), mixture.growth, 1e-3 * std::abs(mixture.growth));
  if (mixture.k > 0) {
    EXPECT_NEAR(analysis.growth_rate_of({mixture.k * mixture.spacing, 0, 0}), mixture.growth, 1e-3 * mixture.growth);
  }
}

std::string brusselator(double a, double b, double du, double dv) {
  return fmt::format("dt(u) = {0} - ({1} + 1)*u + u^2*v + {2}*lap(u); dt(v) = {1}*u - u^2*v + {3}*lap(v)", a, b, du,
                     dv);
}
std::string schnakenberg(double a, double b, double du, double dv) {
  return fmt::format("dt(u) = {} - u + u^2*v + {}*lap(u); dt(v) = {} - u^2*v + {}*lap(v)", a, du, b, dv);
}
std::string gray_scott(double f, double k) {
  return fmt::format("dt(u) = -u*v^2 + {0}*(1 - u) + 2e-5*lap(u); dt(v) = u*v^2 - ({0} + {1})*v + 1e-5*lap(v)", f, k);
}

INSTANTIATE_TEST_SUITE_P(
    Stability, GrowthOfMixtures,
    ::testing::Values(
        Mixture{"brusselator_1", brusselator(3, 9, 5, 12), 3, 3, 0.2246570620, 0.62700, 0.1},
        Mixture{"brusselator_2", brusselator(4.5, 7.5, 2, 16), 4.5, 7.5 / 4.5, 0.3623285298, 0.94350, 0.1},
        Mixture{"brusselator_3", brusselator(2, 3, 0.1, 1), 2, 1.5, 0.2323441889, 2.59270, 0.05},
        Mixture{"schnakenberg_1", schnakenberg(0.1, 0.9, 1, 40), 1, 0.9, 0.4110112051, 0.42050, 0.2},
        Mixture{"schnakenberg_2", schnakenberg(0.2, 1.3, 0.01, 1), 1.5, 1.3 / 2.25, 0.3645100810, 4.13930, 0.02},
        Mixture{"fitzhugh_nagumo", "dt(u) = u - u^3 - 0.005 - v + 1e-3*lap(u); dt(v) = u - v + 5e-3*lap(v)",
                -0.1709975947, -0.1709975947, 0.2723153461, 13.88350, 0.01},
        Mixture{"gray_scott", gray_scott(0.03, 0.055), 0.4042572892, 0.2102621332, 0.00539492, 0.0, 0.01}));

}  // namespace
}  // namespace dpde::stability
