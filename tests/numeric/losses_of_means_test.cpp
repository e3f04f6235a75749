// SPDX-License-Identifier: Apache-2.0
// Losses that are formulas of several means: value and gradient follow by the chain rule from each mean alone, whatever
// the means contain.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// States, coefficients, solutions, results of iterations, outputs of networks, and fields of means.
const std::vector<std::string> fields_of_losses{
    "w",        "k*w",        "psi",         "lap(psi) + w",   "phi", "chi", "psi - dx(chi)",
    "first(w)", "first(psi)", "w - mean(w)", "psi/max(abs(w))"};

/// The formula `of` of A = mean(F^2) and B = mean(G^2), as one loss.
struct LossOfMeans {
  const char* text;  // F and G stand for the fields
  double (*value)(double a, double b);
  double (*by_a)(double a, double b);
  double (*by_b)(double a, double b);
};
const std::vector<LossOfMeans> losses_of_means{
    {"mean((F)^2)/mean((G)^2)", [](double a, double b) { return a / b; }, [](double, double b) { return 1 / b; },
     [](double a, double b) { return -a / (b * b); }},
    {"mean(((F)/mean((G)^2))^2)", [](double a, double b) { return a / (b * b); },
     [](double, double b) { return 1 / (b * b); }, [](double a, double b) { return -2 * a / (b * b * b); }},
    {"mean((F)^2) + mean((G)^2)/(1 + mean((F)^2))", [](double a, double b) { return a + b / (1 + a); },
     [](double a, double b) { return 1 - b / ((1 + a) * (1 + a)); }, [](double a, double) { return 1 / (1 + a); }}};

std::string replaced(std::string text, const std::string& f, const std::string& g) {
  std::string result;
  for (const char c : text) result += c == 'F' ? f : c == 'G' ? g : std::string(1, c);
  return result;
}

std::string text_of_losses(const std::string& f, const std::string& g, const LossOfMeans& loss) {
  const auto task = [](const std::string& name, const std::string& loss) {
    const bool learns = loss.find("first") != std::string::npos || loss.find("psi") != std::string::npos;
    return "task " + name + " : s { unknown initial w; unknown e; " + (learns ? "learn first; " : "") + "minimise " +
           loss + " }\n";
  };
  return "network first(r) -> g { real f64; initial he, seed 1; conv 3, 3; tanh; conv out, 3 }\n"
         "model m {\n  field w; coefficient k; param e = 0.7\n"
         "  solve lap(psi) = -w for psi from first(w) after 2 iterations\n"
         "  solve lap(chi) - e*chi = w for chi from k*w after 1 iterations\n"
         "  solve lap(phi) - k*phi = w for phi\n"
         "  dt(w) = lap(w) - e*w\n}\n"
         "scheme c { time = euler }\nscene s : m with c {\n"
         "  grid x = 0 .. 1, cells 6, periodic\n  grid y = 0 .. 1, cells 5, periodic\n"
         "  k = 1.3 + 0.5*sin(2*pi*x)*cos(2*pi*y)\n"
         "  initial w = sin(2*pi*x)*(1 + 0.3*cos(2*pi*y)) + 0.4*cos(2*pi*y + 1)\n  time 0 .. 0.01, step 0.005\n}\n" +
         task("a", "mean((" + f + ")^2)") + task("b", "mean((" + g + ")^2)") + task("t", replaced(loss.text, f, g));
}

std::vector<double> by_unknown(const TaskResult& task, const std::string& unknown, std::size_t size) {
  const auto found = task.gradient.find(unknown);
  return found == task.gradient.end() ? std::vector<double>(size, 0.0) : found->second;
}

void expect_chain_rule(const std::string& f, const std::string& g, const LossOfMeans& loss) {
  const std::string text = text_of_losses(f, g, loss);
  const TaskResult a = task_gradient(text, "a"), b = task_gradient(text, "b"), both = task_gradient(text, "t");
  EXPECT_NEAR(both.loss, loss.value(a.loss, b.loss), 1e-12 * std::abs(both.loss));
  for (const auto& [unknown, gradient] : both.gradient) {
    const std::vector<double> of_a = by_unknown(a, unknown, gradient.size());
    const std::vector<double> of_b = by_unknown(b, unknown, gradient.size());
    ASSERT_EQ(of_a.size(), gradient.size());
    ASSERT_EQ(of_b.size(), gradient.size());
    const double by_a = loss.by_a(a.loss, b.loss), by_b = loss.by_b(a.loss, b.loss);
    double size = 0;
    for (std::size_t i = 0; i < gradient.size(); ++i)
      size = std::max(size, std::abs(by_a * of_a[i]) + std::abs(by_b * of_b[i]));
    for (std::size_t i = 0; i < gradient.size(); ++i)
      EXPECT_NEAR(gradient[i], by_a * of_a[i] + by_b * of_b[i], 1e-10 * size) << unknown << " " << i;
  }
}

TEST(LossesOfMeans, FollowTheChainRule) {
  std::size_t count = 0;
  for (const LossOfMeans& loss : losses_of_means) {
    for (const std::string& f : fields_of_losses) {
      for (const std::string& g : fields_of_losses) {
        if (!is_tried(count++, 61)) continue;
        SCOPED_TRACE(replaced(loss.text, f, g));
        expect_chain_rule(f, g, loss);
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
