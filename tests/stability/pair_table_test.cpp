// SPDX-License-Identifier: Apache-2.0
// Every pair of a difference and an explicit time scheme: those of tables 1.1 and 1.2 of numerics.md, and what dpde
// adds. What is predicted is within 0.5 % of a scan that shares no code with the analysis (symbols and stability
// polynomials written out, 1600 angles), runs are within 2 % of what is predicted, and where no step is stable the
// growth that runs measure is the one of the scan, weak growth too. `--gtest_output=xml` has the numbers.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <map>
#include <numbers>

#include "stability/stability_report.h"
#include "stability/trial.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

using Complex = std::complex<double>;
using std::numbers::pi;

constexpr int angles = 1600;
constexpr double most_steps = 1e5;  // of a run

/// Weights from Taylor series, by hand.
const std::map<std::string, Difference> slopes{{"upwind(1)", {-1, {-1, 1}, 1}},
                                               {"upwind(3)", {-2, {1, -6, 3, 2}, 6}},
                                               {"upwind(5)", {-3, {-2, 15, -60, 20, 30, -3}, 60}},
                                               {"upwind(7)", {-4, {3, -28, 126, -420, 105, 252, -42, 4}, 420}},
                                               {"central(2)", {-1, {-1, 0, 1}, 2}},
                                               {"central(4)", {-2, {1, -8, 0, 8, -1}, 12}},
                                               {"central(6)", {-3, {-1, 9, -45, 0, 45, -9, 1}, 60}},
                                               {"central(8)", {-4, {3, -32, 168, -672, 0, 672, -168, 32, -3}, 840}}};
const std::map<std::string, Difference> curvatures{
    {"central(2)", {-1, {1, -2, 1}, 1}},
    {"central(4)", {-2, {-1, 16, -30, 16, -1}, 12}},
    {"central(6)", {-3, {2, -27, 270, -490, 270, -27, 2}, 180}},
    {"central(8)", {-4, {-9, 128, -1008, 8064, -14350, 8064, -1008, 128, -9}, 5040}}};

Complex rate(const std::string& operation, const std::string& space, double angle) {
  const bool is_slope = operation == "advect";
  if (space == "spectral") return is_slope ? Complex(0, -angle) : Complex(-angle * angle);
  return is_slope ? -slopes.at(space).of(angle) : curvatures.at(space).of(angle);
}

/// The largest root of a polynomial with the leading coefficient 1, by iteration on all (Durand and Kerner).
template <std::size_t n>
double largest_root(const std::array<Complex, n>& lower) {
  std::array<Complex, n> x;
  for (std::size_t k = 0; k < n; ++k) x[k] = std::pow(Complex(0.4, 0.9), static_cast<double>(k));
  for (int i = 0; i < 60; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      Complex value = 1, distance = 1;
      for (std::size_t j = n; j-- > 0;) value = value * x[k] + lower[j];
      for (std::size_t j = 0; j < n; ++j) distance *= j == k ? 1.0 : x[k] - x[j];
      x[k] -= value / distance;
    }
  }
  double largest = 0;
  for (const Complex& root : x) largest = std::max(largest, std::abs(root));
  return largest;
}

/// |1 + z + z^2/2 + ...|, with these coefficients in place of 1/k! behind the ones given by the order.
double polynomial(Complex z, int order, double last = 0) {
  Complex sum = 1, term = 1;
  for (int k = 1; k <= order; ++k) sum += term *= z / static_cast<double>(k);
  return std::abs(sum + last * std::pow(z, order + 1));
}

const std::map<std::string, std::function<double(Complex)>> factors{
    {"euler", [](Complex z) { return polynomial(z, 1); }},
    {"rk2", [](Complex z) { return polynomial(z, 2); }},
    {"ssp_rk3", [](Complex z) { return polynomial(z, 3); }},
    {"bs32", [](Complex z) { return polynomial(z, 3); }},
    {"rk4", [](Complex z) { return polynomial(z, 4); }},
    {"dopri5", [](Complex z) { return polynomial(z, 5, 1.0 / 600); }},
    {"ab2",
     [](Complex z) {
       return largest_root<2>({z / 2.0, -1.0 - 1.5 * z});
     }},
    {"ab3",
     [](Complex z) {
       return largest_root<3>({-5.0 / 12 * z, 16.0 / 12 * z, -1.0 - 23.0 / 12 * z});
     }},
    {"leapfrog", [](Complex z) {
       return largest_root<2>({-1, -2.0 * z});
     }}};

struct Pair {
  std::string operation, space, time;
};
std::ostream& operator<<(std::ostream& out, const Pair& p) { return out << p.operation << p.space << p.time; }

double growth(const Pair& p, double step, int count = angles) {
  double largest = 0;
  for (int i = 1; i <= count; ++i) {
    if (p.operation == "advect" && p.space == "spectral" && i == count) continue;  // a wave of two cells has no slope
    largest = std::max(largest, factors.at(p.time)(step * rate(p.operation, p.space, pi * i / count)));
  }
  return largest;
}

/// Double roots, which leapfrog has at its limit, are found to the root of rounding.
bool is_stable(const Pair& p, double step) { return growth(p, step) <= 1 + (p.time == "leapfrog" ? 1e-8 : 1e-12); }

/// The limit; 0 if no small step is stable.
double scanned_limit(const Pair& p) {
  double low = 0.015, high = 4;
  if (!is_stable(p, low)) return 0;
  while (high - low > 1e-4 * low) (is_stable(p, (low + high) / 2) ? low : high) = (low + high) / 2;
  return low;
}

/// The number of steps in which errors grow by e^2.
double steps_to_grow(double factor) { return 2 / std::log(factor); }

/// A series has no wave of two cells to advect: on many cells the shortest one is near it.
int cells_of(const Pair& p) { return p.operation == "advect" && p.space == "spectral" ? 128 : 64; }

std::unique_ptr<driver::Session> session_of(const Pair& p) {
  const std::string equation = p.operation == "advect" ? "-advect(1, u)" : "lap(u)";
  return open_scene(
      fmt::format("model m {{ field u; dt(u) = {0} }}\nscheme c {{ {1} = {2}; time = {3} }}\n"
                  "scene s : m with c {{\n  grid x = 0 .. {4}, cells {4}, periodic\n"
                  "  initial u = sin(2*pi*x/{4})\n  time 0 .. 0.1, step 0.1\n}}\n",
                  equation, p.operation, p.space, p.time, cells_of(p)));
}

class PairTable : public ::testing::TestWithParam<Pair> {
 protected:
  void record(const std::string& name, double value) { RecordProperty(name, fmt::format("{:.6g}", value)); }
};

void expect_limit(driver::Session& session, double limit, double steps, double& measured) {
  const Search found = search_limit(session, limit, 8e-3, 3, {.steps = std::max(1000, static_cast<int>(steps))});
  EXPECT_NEAR(found.largest, limit, 0.02 * limit);
  EXPECT_NEAR(found.smallest_unstable, limit, 0.02 * limit);
  measured = found.largest;
}

void expect_growth(driver::Session& session, const StabilityReport& verdict, const Pair& pair, double step,
                   double& measured) {
  const double scanned = std::log(growth(pair, step));
  EXPECT_NEAR(std::log(growths_at(session, verdict, {step}).front()), scanned, 0.01 * scanned);
  const double of_grid = growth(pair, step, cells_of(pair) / 2);  // the waves that there are
  const int steps = std::max(500, static_cast<int>(6 * steps_to_grow(of_grid)));
  const Trial trial = try_step(session, step, {.steps = steps}).value();
  EXPECT_FALSE(trial.is_stable);
  EXPECT_NEAR(std::log(trial.growth), std::log(of_grid), 0.1 * std::log(of_grid));
  measured = trial.growth;
}

TEST_P(PairTable, IsPredictedAndMeasured) {
  const Pair& pair = GetParam();
  const auto session = session_of(pair);
  const StabilityReport verdict = verdict_of(*session);
  ASSERT_EQ(verdict.why, "");
  EXPECT_TRUE(verdict.is_exact);
  const double expected = scanned_limit(pair);
  const double steps = expected > 0 ? steps_to_grow(growth(pair, 1.02 * expected)) : 0;
  // Of long waves by upwind(5) and upwind(7) the second order in time lets more grow than the difference damps, but so
  // little that where it begins is a matter of rounding.
  const bool is_rounding = steps > 1e9;
  EXPECT_EQ(verdict.limit.kind, expected > 0 ? StepLimit::Kind::limit : StepLimit::Kind::never);
  double measured = 0, step = expected > 0 ? 1.2 * expected : pair.operation == "advect" ? 0.25 : 0.05;
  if (expected > 0 && !is_rounding) {
    EXPECT_NEAR(verdict.limit.step, expected, 0.005 * expected);
    record("scan", expected);
    record("predicted", verdict.limit.step);
    if (steps < most_steps) {
      expect_limit(*session, verdict.limit.step, steps, measured);
      return record("measured", measured);
    }
  }
  if (is_rounding) step = 0.5;
  expect_growth(*session, verdict, pair, step, measured);
  record("step", step);
  record("growth", growth(pair, step));
  record("growth_measured", measured);
  RecordProperty("weak", verdict.limit.is_weak() ? "yes" : "no");
}

std::vector<Pair> pairs() {
  std::vector<Pair> result;
  for (const auto& [time, factor] : factors) {
    for (const auto& [space, symbol] : slopes) result.push_back({"advect", space, time});
    for (const auto& [space, symbol] : curvatures) result.push_back({"lap", space, time});
    for (const std::string operation : {"advect", "lap"}) result.push_back({operation, "spectral", time});
  }
  return result;
}
INSTANTIATE_TEST_SUITE_P(Stability, PairTable, ::testing::ValuesIn(pairs()));

/// The scan itself against tables 1.1 and 1.2 of numerics.md.
TEST(PairTableScan, IsThatOfTheTables) {
  const auto expect = [](const std::string& operation, const std::string& space, const std::string& time,
                         double expected) {
    EXPECT_NEAR(scanned_limit({operation, space, time}), expected, 0.001 * expected) << operation << space << time;
  };
  const std::vector<std::string> times{"euler", "rk2", "ssp_rk3", "rk4", "ab2", "ab3", "leapfrog"};
  const std::map<std::string, std::vector<double>> of_slopes{
      {"upwind(1)", {1, 1, 1.2564, 1.3926, 0.5, 0.2727, 0}},
      {"central(2)", {0, 0, 1.7321, 2.8284, 0, 0.7236, 1}},
      {"central(4)", {0, 0, 1.2622, 2.0612, 0, 0.5274, 0.7288}},
      {"upwind(3)", {0, 0.8738, 1.6259, 1.7453, 0.5802, 0.3965, 0}}};
  const std::map<std::string, std::vector<double>> of_curvatures{
      {"central(2)", {0.5, 0.5, 0.62819, 0.69632, 0.25, 0.13636, 0}},
      {"central(4)", {0.375, 0.375, 0.47114, 0.52224, 0.1875, 0.10227, 0}},
      {"spectral", {0.20264, 0.20264, 0.25459, 0.28221, 0.10132, 0.05527, 0}}};
  for (std::size_t i = 0; i < times.size(); ++i) {
    for (const auto& [space, limits] : of_slopes) expect("advect", space, times[i], limits[i]);
    for (const auto& [space, limits] : of_curvatures) expect("lap", space, times[i], limits[i]);
  }
}

}  // namespace
}  // namespace dpde::stability
