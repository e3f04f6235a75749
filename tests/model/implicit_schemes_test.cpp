// SPDX-License-Identifier: Apache-2.0
// What implicit time schemes solve for, and what they do not go with.
#include "model/analyse/implicit_part.h"
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// "part | rest" of the equation of u.
std::string split(const std::string& rhs, int axes = 1, const std::string& model_lines = "") {
  const Problem problem =
      problem_of(text_with(rhs, axes, "  initial v = 0\n", "  field v\n  dt(v) = 0\n" + model_lines));
  const LinearPart parts = implicit_part(problem, "u", *problem.find_state("u")->rhs);
  return print(parts.part) + " | " + print(parts.rest);
}

TEST(ImplicitPart, HoldsTermsWithSecondDerivativesOfTheFieldItself) {
  EXPECT_EQ(split("k*lap(u) - advect(c, u)"), "k*d(u, x, 2) | -advect(c, u)");
  EXPECT_EQ(split("div(w*grad(u)) - u^3 + t"), "dx(w*dx(u)) | -u^3 + t");
  EXPECT_EQ(split("-(u - k*lap(u))"), "k*d(u, x, 2) | -u");
  EXPECT_EQ(split("k*(lap(u) + v)"), "k*d(u, x, 2) | k*v");
  EXPECT_EQ(split("-k*lap(lap(u)) - sin(t)*dx(u)"), "-k*d(d(u, x, 2), x, 2) | -(sin(t)*dx(u))");
  EXPECT_EQ(split("lap(u)/(1 + w^2) + mean(u)", 2), "(d(u, x, 2) + d(u, y, 2))/(1 + w^2) | mean(u)");
}

TEST(ImplicitPart, LeavesWhatIsNotLinearOrHoldsOtherFields) {
  for (const char* rhs : {"u*lap(u)", "lap(u^2)", "v*lap(u)", "lap(v)", "lap(w)*u", "div(u*grad(u))", "mean(v)*lap(u)",
                          "lap(advect(c, u))", "if(u > 0, 1, 2)*lap(u)"}) {
    const std::string parts = split(rhs);
    EXPECT_EQ(parts.substr(0, 4), "0 | ") << rhs << ": " << parts;
  }
}

TEST(ImplicitPart, IsWhatTheSchemeSays) {
  const auto split_by = [](Implicit implicit) {
    Problem problem = problem_of(
        text_with("k*lap(u) - 2*advect(c, u) + u^2*v + t", 1, "  initial v = 0\n", "  field v\n  dt(v) = 0\n"));
    problem.scheme.implicit = implicit;
    const LinearPart parts = implicit_part(problem, "u", *problem.find_state("u")->rhs);
    return print(parts.part) + " | " + print(parts.rest);
  };
  EXPECT_EQ(split_by(Implicit::linear), "k*d(u, x, 2) | -(2*advect(c, u)) + u^2*v + t");
  EXPECT_EQ(split_by(Implicit::all_but_advect), "k*d(u, x, 2) + u^2*v + t | -(2*advect(c, u))");
  EXPECT_EQ(split_by(Implicit::all), "k*d(u, x, 2) - 2*advect(c, u) + u^2*v + t | 0");
}

}  // namespace
}  // namespace dpde::model
