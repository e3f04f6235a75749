// SPDX-License-Identifier: Apache-2.0
// Each row of the table of time methods, by itself: what it says of order and estimate is what its coefficients do.
#include "model/methods.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace dpde::model {
namespace {

/// u' = stiff*u + rest(t, u), from u = 1 at t = 0.
struct Equation {
  double stiff = 0;
  std::function<double(double t, double u)> rest;
};

const Equation whole_equation{0, [](double t, double u) { return -(1 + 2 * t) * u * u; }};        // u = 1/(1 + t + t^2)
const Equation split_equation{-1, [](double t, double u) { return (1 - (1 + 2 * t) * u) * u; }};  // the same

double exact(double t) { return 1 / (1 + t + t * t); }

/// U of a row, from those before and their rates.
double value_of(const StageRow& row, const std::vector<double>& stages, const Equation& equation, double t, double dt) {
  double sum = 0;
  for (const DifferenceOfStages& one : row.differences) sum += one.weight * (stages[one.more] - stages[one.less]);
  const double rate = equation.rest(t + row.time * dt, stages[row.from]);
  return stages[row.base] + sum / row.divisor + dt * row.weight / row.over * rate;
}

struct Results {
  double own = 0, embedded = 0;
};

Results explicit_step(const TimeMethod& method, double t, double u, double dt) {
  std::vector<double> stages{u};
  for (const StageRow& row : method.stages) stages.push_back(value_of(row, stages, whole_equation, t, dt));
  return {stages.back(), method.embedded ? value_of(*method.embedded, stages, whole_equation, t, dt) : 0};
}

/// What a row adds up, without the stage's own stiff part.
double right_side(const AdditiveRow& row, const std::vector<double>& rests, const std::vector<double>& stiff,
                  double dt) {
  double sum = 0;
  for (std::size_t j = 0; j < rests.size(); ++j) sum += static_cast<double>(row.of_rest[j]) * rests[j];
  for (std::size_t j = 0; j < stiff.size(); ++j) sum += static_cast<double>(row.of_solved[j]) * stiff[j];
  return dt * sum;
}

Results additive_step(const TimeMethod& method, const Equation& equation, double t, double u, double dt) {
  const double own = static_cast<double>(method.additive.own);
  std::vector<double> rests{equation.rest(t, u)}, stiff;
  double stage = u;
  for (const AdditiveRow& row : method.additive.rows) {
    stage = (u + right_side(row, rests, stiff, dt)) / (1 - dt * own * equation.stiff);
    stiff.push_back(equation.stiff * stage);
    rests.push_back(equation.rest(t + static_cast<double>(row.time) * dt, stage));
  }
  rests.pop_back();
  const AdditiveRow* other = method.additive.embedded;
  return {stage, other ? u + right_side(*other, rests, stiff, dt) : 0};
}

Results step(const TimeMethod& method, double t, double u, double dt) {
  return method.stages.empty() ? additive_step(method, split_equation, t, u, dt) : explicit_step(method, t, u, dt);
}

bool is_one_step(const TimeMethod& method) { return !method.stages.empty() || !method.additive.rows.empty(); }

double error_at_1(const TimeMethod& method, int steps) {
  double u = 1;
  for (int n = 0; n < steps; ++n) u = step(method, static_cast<double>(n) / steps, u, 1.0 / steps).own;
  return std::abs(u - exact(1));
}

double estimate(const TimeMethod& method, double dt) {
  const Results results = step(method, 0.2, exact(0.2), dt);
  return std::abs(results.own - results.embedded);
}

TEST(TimeMethods, HaveTheOrdersOfTheirRows) {
  for (const TimeMethod& method : time_methods()) {
    if (!is_one_step(method)) continue;
    const int steps = 32;
    EXPECT_NEAR(std::log2(error_at_1(method, steps) / error_at_1(method, 2 * steps)), method.order, 0.25)
        << method.name;
    EXPECT_EQ(estimates_error(&method), method.embedded != nullptr || method.additive.embedded != nullptr);
    if (!estimates_error(&method)) continue;
    EXPECT_NEAR(std::log2(estimate(method, 0.02) / estimate(method, 0.01)), method.order_of_estimate, 0.15)
        << method.name;
  }
}

/// Solved parts that are stiff without bound are gone behind a step: the limit of the stability function is 0.
TEST(TimeMethods, ThatSolveDampWhatIsStiff) {
  for (const TimeMethod& method : time_methods()) {
    if (method.additive.rows.empty()) continue;
    const Equation stiff{-1e9, [](double, double) { return 0.0; }};
    const Results results = additive_step(method, stiff, 0, 1, 1);
    EXPECT_LT(std::abs(results.own), 1e-6) << method.name;
    if (method.additive.embedded) EXPECT_LT(std::abs(results.embedded), 1e-6) << method.name;
  }
}

/// Of dt(u) = t^k for k below the order: sum of w_j*(-j)^k = 1/(k + 1). Those of the first steps are weights, too.
TEST(TimeMethods, ThatRememberIntegratePolynomials) {
  for (const TimeMethod& method : time_methods()) {
    if (!is_adams_bashforth(&method)) continue;
    for (int k = 0; k < method.order; ++k) {
      double sum = 0;
      for (int j = 0; j < 3; ++j) sum += method.rates.back()[j] * std::pow(-j, k);
      EXPECT_NEAR(sum, 1.0 / (k + 1), 1e-15) << method.name << " " << k;
    }
    for (std::size_t n = 0; n < method.rates.size(); ++n) {
      double sum = 0;
      for (std::size_t j = 0; j < method.rates[n].size(); ++j) {
        sum += method.rates[n][j];
        EXPECT_TRUE(j <= n || method.rates[n][j] == 0) << method.name << ": a rate of before the run";
      }
      EXPECT_NEAR(sum, 1, 1e-15) << method.name;
    }
  }
}

/// Shu and Osher's form: each stage is a mean of Euler steps of earlier ones, none longer than the step over C.
TEST(TimeMethods, OfEulerStepsKeepNumbersBetweenTheirs) {
  for (const TimeMethod& method : time_methods()) {
    if (method.ssp_coefficient == 0) continue;
    const Equation jump{0, [](double, double u) { return u > 0.5 ? -u : 0.0; }};  // an Euler step ends in [0, u]
    for (const double u : {0.4, 0.6, 1.0}) {
      std::vector<double> stages{u};
      for (const StageRow& row : method.stages) {
        stages.push_back(value_of(row, stages, jump, 0, method.ssp_coefficient));
        EXPECT_GE(stages.back(), -1e-15) << method.name;
        EXPECT_LE(stages.back(), u + 1e-15) << method.name;
      }
    }
  }
}

/// What stands between `open` marks: `a`, `b` of "`a`, `b`" for one mark.
std::vector<std::string> between(const std::string& text, char mark) {
  std::vector<std::string> parts;
  std::size_t at = 0;
  for (bool is_inside = false; at != std::string::npos; is_inside = !is_inside) {
    const std::size_t end = text.find(mark, at);
    if (is_inside) parts.push_back(text.substr(at, end - at));
    at = end == std::string::npos ? end : end + 1;
  }
  return parts;
}

std::ifstream page_of_schemes() {
  return std::ifstream(std::filesystem::path(DPDE_SOURCE_DIR) / "dsl-examples/manual/schemes.md");
}

/// The list of "Steps under a tolerance".
TEST(TimeMethods, ThatEstimateTheirErrorAreListedInTheManual) {
  std::ifstream page = page_of_schemes();
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  for (const TimeMethod& method : time_methods()) {
    EXPECT_EQ(text.find(std::string("\n- `time = ") + method.name + "`") != std::string::npos, estimates_error(&method))
        << method.name;
  }
}

TEST(TimeMethods, StandInTheManualWithTheirOrders) {
  std::ifstream page = page_of_schemes();
  std::map<std::string, int> orders;
  bool is_table = false;
  for (std::string line; std::getline(page, line);) {
    is_table = line.starts_with("|") && (is_table || line.starts_with("| `time` | order |"));
    if (!is_table || !line.starts_with("| `") || line.starts_with("| `time`")) continue;
    const std::size_t end = line.find(" | ");
    std::istringstream numbers(line.substr(end + 3));
    int order = 0;
    for (const std::string& name : between(line.substr(0, end), '`')) {
      if (int own = 0; numbers >> own) order = own;  // one for all of a row, or one each
      numbers.ignore();
      orders[name] = order;
    }
  }
  for (const TimeMethod& method : time_methods()) EXPECT_EQ(orders[method.name], method.order) << method.name;
  EXPECT_EQ(orders.size(), time_methods().size());
}

}  // namespace
}  // namespace dpde::model
