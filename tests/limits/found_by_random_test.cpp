// SPDX-License-Identifier: Apache-2.0
// Limits that were wrong in random scenes, a row for each kind, compared with closed forms and runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "limits/check_limit.h"
#include "stability/stability_report.h"
#include "stability/stability_support.h"

namespace dpde::testing {
namespace {

struct Found {
  std::string name, model, scheme, scene;
  double limit;
};

const std::string line = "grid x = 0 .. 4, cells 4; ";

const std::vector<Found> all_found{
    // By Euler's method exp(l t) of l = -a +- i w has the limit 2a/(a^2 + w^2). Up to 0.027 it grows by less than a
    // ten-thousandth a step.
    {"slow growth beside what grows by right",
     "field a, u, v; dt(a) = 0.3*a + 1e-3*u; dt(u) = v + 1e-3*a; dt(v) = -u - 0.02*v", "time = euler",
     line + "boundary a: x = zero_gradient; boundary u: x = zero_gradient; boundary v: x = zero_gradient; "
            "initial a = 1; initial u = 1; initial v = 0; ",
     0.02},
    // The same beside a rate of -40: of that, 0.01 is little.
    {"slow growth beside fast decay",
     "field a, u, v, w; dt(a) = 0.3*a + 1e-3*u + 1e-3*w; dt(u) = v + 1e-3*a; dt(v) = -u - 0.02*v; "
     "dt(w) = -40*w + 1e-3*a",
     "time = euler",
     line + "boundary a: x = zero_gradient; boundary u: x = zero_gradient; boundary v: x = zero_gradient; "
            "boundary w: x = zero_gradient; initial a = 1; initial u = 1; initial v = 0; initial w = 0; ",
     0.02},
    // By ab2 nearly (4a)^(1/3), exactly by the roots of z^2 - (1 + 3l/2)z + l/2. The rate -5 has the limit 0.2.
    {"slow growth beside fast decay, with a memory",
     "field a, u, v, w; dt(a) = 0.3*a + 1e-3*u + 1e-3*w; dt(u) = v + 1e-3*a; dt(v) = -u - 2e-3*v; "
     "dt(w) = -5*w + 1e-3*a",
     "time = ab2",
     line + "boundary a: x = zero_gradient; boundary u: x = zero_gradient; boundary v: x = zero_gradient; "
            "boundary w: x = zero_gradient; initial a = 1; initial u = 1; initial v = 0; initial w = 0; ",
     0.157746},
    // The other rate, -1.88539, has the limit 6/11 by ab3. It is in all cells: four equal eigenvalues.
    {"equal eigenvalues next to physical growth", "field u, v; dt(u) = -0.24*v; dt(v) = -1.8*v - 0.67*u", "time = ab3",
     line + "boundary u: x = zero_gradient; boundary v: x = zero_gradient; initial u = 1; initial v = 1; ", 0.289306},
};

TEST(FoundByRandom, LimitsAreThoseOfClosedFormsAndRuns) {
  for (const Found& found : all_found) {
    const std::string text = fmt::format(
        "model m {{ {} }}\nscheme q {{ {} }}\nscene s : m with q {{ {} time 0 .. 2, step "
        "0.01 }}\n",
        found.model, found.scheme, found.scene);
    const stability::StabilityReport verdict = stability::verdict_of(*stability::open_scene(text));
    EXPECT_EQ(verdict.limit.kind, stability::StepLimit::Kind::limit) << found.name;
    EXPECT_NEAR(verdict.limit.step, found.limit, 5e-3 * found.limit) << found.name;
    const LimitCheck check = check_limit(text);
    const bool agrees = check.kind == LimitCheck::Kind::agrees || check.kind == LimitCheck::Kind::near_estimate;
    EXPECT_TRUE(agrees) << found.name << ": " << name_of(check.kind) << " " << check.detail;
  }
}

}  // namespace
}  // namespace dpde::testing
