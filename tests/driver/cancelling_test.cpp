// SPDX-License-Identifier: Apache-2.0
// Distinguishing rounding from errors: derivatives with cancelling terms, wrong derivatives, and switching conditions.
#include "adjoint/check/rounding_between.h"
#include "analysis/certificate/quick_certificate.h"
#include "driver_support.h"

namespace dpde::testing {
namespace {

/// Derivatives of a difference of two equal products: the first product is rounded, the second is not.
double cancelled(double a, double b) { return std::fma(a, b, -(a * b)); }

TEST(RoundingBetween, IsWhatIsLeftOfTermsThatCancel) {
  std::mt19937_64 random(1);
  const auto both = [&](double epsilon) {
    double values[] = {0.3, 1.7, 0.7};
    adjoint::nudge(values, epsilon, random);
    return adjoint::TwoWays{cancelled(values[0], values[1]), cancelled(values[1], values[2])};
  };
  const double rounding = adjoint::rounding_between(both, 0x1p-52, 1e-9);
  EXPECT_GT(rounding, std::abs(cancelled(0.3, 1.7) - cancelled(1.7, 0.7)));
  EXPECT_LT(rounding, 1e-14);
}

/// One derivative is exactly 0, the other is the rounding remainder of 1 + 0.1*k, which no rounding of k changes.
TEST(RoundingBetween, IsSeenWhereItIsOfOtherValues) {
  std::mt19937_64 random(1);
  const auto both = [&](double epsilon) {
    double k = 0.63;
    adjoint::nudge({&k, 1}, epsilon, random);
    return adjoint::TwoWays{0, cancelled(1 + 0.1 * k, 0.93)};
  };
  const double rounding = adjoint::rounding_between(both, 0x1p-52, 1e-9);
  EXPECT_GT(rounding, std::abs(cancelled(1 + 0.1 * 0.63, 0.93)));
  EXPECT_LT(rounding, 1e-14);
}

TEST(RoundingBetween, DoesNotExcuseAWrongDerivative) {
  std::mt19937_64 random(1);
  for (const double wrong : {1e-3, 1e-9, 1e-12}) {  // of terms of size 1
    const auto both = [&](double epsilon) {
      double value = 1.3;
      adjoint::nudge({&value, 1}, epsilon, random);
      return adjoint::TwoWays{value, value * (1 + wrong)};
    };
    EXPECT_LT(adjoint::rounding_between(both, 0x1p-52, 1e-9), wrong == 1e-12 ? 1e-13 : 1e-2 * wrong);
  }
}

TEST(RoundingBetween, DoesNotExcuseAChoiceThatChanges) {
  int calls = 0;
  EXPECT_EQ(adjoint::rounding_between(
                [&](double) {
                  return adjoint::TwoWays{++calls % 2 == 0 ? 1.0 : 0.9, 0.9};
                },
                0x1p-52, 1e-9),
            0);
  EXPECT_EQ(adjoint::rounding_between([](double) { return adjoint::TwoWays{NAN, 1}; }, 0x1p-52, 1e-9), 0);
}

struct Cancelling : ::testing::TestWithParam<const char*> {};

/// On a periodic grid these sums, or their derivatives, are 0 up to rounding; on one cell each difference is.
TEST_P(Cancelling, LossesAreCertified) {
  const SourceFile source("cancel.dpde", fmt::format(R"(
model m {{ field u; dt(u) = 0 }}
scheme q {{ }}
scene s : m with q {{
  grid x = 0 .. 3.53, cells 4, periodic
  initial u = 1 + 0.3*sin(1.78*x)
  time 0 .. 0.04, step 0.02
}}
task t : s {{ unknown initial u; minimise {} }}
)",
                                                     GetParam()));
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = options.second = true;
  const auto code = compiled(source, options);
  ASSERT_NE(code, nullptr);
  DiagnosticSink sink;
  EXPECT_TRUE(analysis::certify_quickly(source, code, analysis::Certifying::always, sink).has_value())
      << all_messages(source, sink);
  const auto certificate = analysis::certify(source, code, {}, sink);
  ASSERT_TRUE(certificate.has_value());
  EXPECT_TRUE(certificate->passed()) << certificate->worst() << " " << certificate->note;
}

INSTANTIATE_TEST_SUITE_P(Losses, Cancelling,
                         ::testing::Values("sum(u*dx(u)) over time", "sum(u*dx(u + sin(1.4*x))) at t = 0.04",
                                           "sum(u*0.02*d(u, x, 4)) over time", "sum(dx(u^2))",
                                           "integral((u - (0.02*d(u, x, 4) + (u - 1)))^2)"));

/// On one cell the difference is 0 and its adjoint is the rounding of values independent of a.
TEST(RoundingBetween, ADifferenceOnOneCellIsCertified) {
  const auto certificate = certificate_of(R"(
model m { field u; coefficient k; param a; dt(u) = 0 }
scheme q { }
scene s : m with q {
  grid x = 0 .. 3.93, cells 1, periodic
  grid y = 0 .. 4.60, cells 1
  boundary u: y = zero_gradient
  a = 0.63
  k = 0.93 + 0.31*exp(-(y - 0.781)^2)
  initial u = 1.26 + 0.31*cos(x + 2.04) + 0.2*a
  time 0 .. 0.04, step 0.02
}
task t : s { unknown a; minimise sum(u*k*dx(u)) }
)",
                                          true);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed()) << certificate->worst() << " " << certificate->note;
}

/// A control field is an input as several fields, one per time.
TEST(RoundingBetween, ProgramsThatReadControlFieldsAreCertified) {
  const SourceFile source("control.dpde", R"(
model m { field u; control field G; dt(u) = G*u }
scheme q { }
scene s : m with q {
  grid x = 0 .. 1, cells 3
  boundary u: x = zero_gradient
  G = (1 + t)*x every 0.1
  initial u = 1 + x
  time 0 .. 0.2, step 0.1
}
task t : s { unknown initial u; minimise mean(u^2) }
)");
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  const auto code = compiled(source, options);
  ASSERT_NE(code, nullptr);
  DiagnosticSink sink;
  const auto certificate = analysis::certify_quickly(source, code, analysis::Certifying::always, sink);
  EXPECT_TRUE(certificate.has_value()) << all_messages(source, sink);
}

}  // namespace
}  // namespace dpde::testing
