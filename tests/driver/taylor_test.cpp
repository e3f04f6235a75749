// SPDX-License-Identifier: Apache-2.0
// The rule that separates right from wrong derivatives, on functions with known derivatives.
#include "analysis/certificate/taylor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace dpde::testing {
namespace {

using namespace analysis;

std::vector<double> steps() {
  std::vector<double> result;
  for (int k = 0; k < 22; ++k) result.push_back(1e-2 * std::exp2(-k));
  return result;
}

QuotientEvidence evidence_for(const Line& f, double derivative) {
  return judge(quotients_of(f, steps(), rounding_of(f, 1e-8, 0x1p-52)), {derivative, 1e-13 * std::abs(derivative)});
}

bool proves(const Line& f, double derivative) { return evidence_for(f, derivative).proves(largest_quotient_error); }

double smooth(double s) { return std::exp(s) + std::sin(3 * s); }

/// A hundred kinks on each side of 0, the nearest at 1e-4, whose jumps do not cancel.
double kinked(double s) {
  double sum = smooth(s);
  for (int i = 1; i <= 100; ++i) sum += 0.02 * std::max(s - 1e-4 * i, 0.0) + 0.01 * std::abs(s + 1.1e-4 * i);
  return sum;
}
constexpr double derivative_of_smooth = 4, derivative_of_kinked = 4 + 100 * 0.01;

TEST(Quotients, ProveADerivativeWithAndWithoutKinks) {
  EXPECT_TRUE(proves(smooth, derivative_of_smooth));
  EXPECT_TRUE(proves(kinked, derivative_of_kinked));
  EXPECT_LT(*evidence_for(kinked, derivative_of_kinked).error, 1e-8);
}

TEST(Quotients, FindAWrongDerivativeHoweverLittleOfItIsWrong) {
  for (const double wrong : {1.0, 1e-2, 1e-4, 1e-6, 1e-7}) {
    EXPECT_FALSE(proves(smooth, derivative_of_smooth * (1 + wrong))) << wrong;
    EXPECT_FALSE(proves(kinked, derivative_of_kinked * (1 - wrong))) << wrong;
    EXPECT_TRUE(evidence_for(kinked, derivative_of_kinked * (1 + wrong)).is_elsewhere) << wrong;
  }
}

TEST(Quotients, FindADerivativeThatIsMissing) {
  EXPECT_TRUE(evidence_for([](double s) { return 1 + 1e-3 * s; }, 0).is_elsewhere);
  EXPECT_TRUE(evidence_for([](double s) { return 1 + s * s; }, 1e-3).is_elsewhere);
}

/// A one-sided derivative is refused, though one-sided quotients converge to it.
TEST(Quotients, AreFromBothSides) {
  const Line kink = [](double s) { return std::max(s, 2 * s); };
  EXPECT_FALSE(proves(kink, 2));
  EXPECT_FALSE(proves(kink, 1));
}

TEST(Quotients, ThatAreAllRoundingProveNothing) {
  const Line flat = [](double s) { return 1 + 1e-16 * s; };
  EXPECT_FALSE(evidence_for(flat, 1e-16).is_resolved(largest_quotient_error));
  EXPECT_FALSE(proves(flat, 1e-16));
  EXPECT_FALSE(evidence_for(flat, 1e-16).is_elsewhere);
}

/// Jumps closer together than any step: the quotients do not converge.
TEST(Quotients, OfJumpsProveNothing) {
  EXPECT_FALSE(proves([](double s) { return s + (std::sin(1e9 * s) > 0 ? 1e-2 : 0); }, 1));
}

TEST(Quotients, MeasureRounding) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-10);
  double mean = 0;
  for (int i = 0; i < 200; ++i)
    mean += rounding_of([&](double s) { return smooth(s) + noise(random); }, 1e-8, 0x1p-52) / 200;
  EXPECT_NEAR(mean, 1e-10, 1e-11);
  EXPECT_LT(rounding_of(smooth, 1e-8, 0x1p-52), 4e-16);
  EXPECT_GE(rounding_of([](double) { return 3.0; }, 1e-8, 0x1p-52), 6e-16);
}

}  // namespace
}  // namespace dpde::testing
