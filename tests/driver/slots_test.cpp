// SPDX-License-Identifier: Apache-2.0
// Allowed contents of each kind of formula: gradients against differences, back ends against one another, or a refusal
// at the right position with the code of the table. By day every ninth cell, at night all.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>

#include "source/render.h"
#include "support/opened_scene.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::driver::slot_table {
namespace {

namespace testing = dpde::testing;

/// Contents of a formula, in the order of where they are known. Values are near 1.
enum class Made { of_numbers, of_places, of_noise, of_time, of_values, of_neighbours, of_all };
struct Feature {
  const char *name, *formula;
  Made made;
};
const Feature features[] = {
    {"number", "0.8", Made::of_numbers},
    {"parameter", "q", Made::of_numbers},
    {"arithmetic", "q^2/(0.4 + q) + 2*q - 1.2", Made::of_numbers},
    {"time", "1 + 0.3*sin(3*t)", Made::of_time},
    {"coordinate", "1 + 0.3*sin(2*pi*x)", Made::of_places},
    {"noise", "1 + 0.1*noise(3)", Made::of_noise},
    {"choice_of_place", "if(x < 0.5, q, 2*q)", Made::of_places},
    {"state", "0.5 + u", Made::of_values},
    {"product", "0.5 + q*u*w", Made::of_values},
    {"function", "bump(u)", Made::of_values},
    {"choice_that_meets", "1 + if(u > 0.65, 2*(u - 0.65), u - 0.65)", Made::of_values},
    {"coefficient", "0.7 + c", Made::of_values},
    {"control", "F", Made::of_time},
    {"derivative", "1 + 0.1*dx(u)", Made::of_neighbours},
    {"laplacian", "1 + 0.02*lap(u)", Made::of_neighbours},
    {"advection", "1 + 0.1*advect(q, u)", Made::of_neighbours},
    {"operator", "1 + 0.1*op(u)", Made::of_neighbours},
    {"mean", "0.5 + mean(u*w)", Made::of_all},
    {"network", "1 + 0.2*n(u)", Made::of_all},
    {"solve", "1 + phi", Made::of_all},
    {"nested", "sin(1 + cos(sin(cos(u))))", Made::of_values},
};

enum class Slot {
  equation,
  let,
  held_value,
  after_step,
  at_time,
  every,
  speed,
  observable,
  loss,
  wall_value,
  wall_slope,
  wall_mixed,
  coefficient,
  initial,
  exact,
  output
};
const std::pair<const char*, Slot> slots[] = {
    {"equation", Slot::equation},
    {"let", Slot::let},
    {"held_value", Slot::held_value},
    {"after_step", Slot::after_step},
    {"at_time", Slot::at_time},
    {"every", Slot::every},
    {"speed", Slot::speed},
    {"observable", Slot::observable},
    {"loss", Slot::loss},
    {"wall_value", Slot::wall_value},
    {"wall_slope", Slot::wall_slope},
    {"wall_mixed", Slot::wall_mixed},
    {"coefficient", Slot::coefficient},
    {"initial", Slot::initial},
    {"exact", Slot::exact},
    {"output", Slot::output},
};

bool has_word(const std::string& text, const std::string& word) {
  return std::regex_search(text, std::regex("\\b" + word + "\\b"));
}

/// The formula in the slot, numbers elsewhere.
std::string text_of(const Feature& feature, Slot slot) {
  const std::string formula = feature.formula;
  const auto at = [&](Slot here, const std::string& otherwise) { return here == slot ? formula : otherwise; };
  const auto line = [&](Slot here, const std::string& before, const std::string& after = "") {
    return here == slot ? "  " + before + formula + after + "\n" : std::string();
  };
  const auto uses = [&](const char* word, const std::string& text) { return has_word(formula, word) ? text : ""; };
  std::string text = uses("n", "network n(a) { initial he, seed 3; conv 2, 3; tanh; conv out, 3 }\n") +
                     uses("bump", "function bump(z) = 0.5 + z/(1 + z^2)\n") +
                     uses("op", "operator op(g) order 1 = (g[+1] - g)/hx\n");
  text += "model m {\n  field u, w\n  param k = 0.05, q\n" + uses("c", "  coefficient c\n") +
          (slot == Slot::coefficient ? "  coefficient d\n" : "") + uses("F", "  control F\n") +
          uses("phi", "  solve 0.1*lap(phi) - phi = -u*q for phi\n") +
          (slot == Slot::held_value ? "  mask solid\n  w = " + formula + " inside solid\n" : "") +
          line(Slot::let, "let l = ") + line(Slot::output, "let shown = ") +
          "  dt(u) = k*lap(u) - 0.2*w*dx(u) + 0.3*w\n  dt(w) = 0.02*lap(w) + 0.5*(" + at(Slot::equation, "0.8") +
          ")*u" + (slot == Slot::let ? " + l*w" : "") + (slot == Slot::coefficient ? " + d*w" : "") + " - w\n}\n";
  text +=
      "scheme s { time = rk2; networks = f64; solve = cg(1e-13, 200) }\nscene z : m with s {\n"
      "  grid x = 0 .. 1, cells 7\n  q = 0.8\n" +
      uses("c", "  c = 0.3 + 0.1*x\n") + uses("F", "  F = 0.8 + 0.3*sin(5*t) every 0.02\n") +
      line(Slot::coefficient, "d = ") + (slot == Slot::held_value ? "  solid = x < 0.4\n" : "") +
      "  boundary u: x.low = " + at(Slot::wall_value, "0.4") + ", x.high = " +
      (slot == Slot::wall_mixed ? "mixed(1, 0.3, " + formula + ")" : "gradient(" + at(Slot::wall_slope, "0.1") + ")") +
      "\n  boundary w: x = zero_gradient\n" + uses("phi", "  boundary phi: x = 0.2\n") +
      "  initial u = " + at(Slot::initial, "0.7 + 0.2*sin(2*pi*x)") + "\n  initial w = 0.9 + 0.1*x\n" +
      line(Slot::exact, "exact u = ") + "  time 0 .. 0.1, step 0.02" +
      (slot == Slot::speed ? ", courant 0.1, speed " + formula : "") + "\n" +
      line(Slot::after_step, "after step: w = 0.9*w + 0.05*(", ")") +
      line(Slot::at_time, "at t = 0.04: w += 0.2*(", ")") + line(Slot::every, "every 0.04: w = w*(", ")") +
      line(Slot::observable, "observe o = mean((", ")^2)") + (slot == Slot::output ? "  output shown\n" : "") + "}\n";
  return text + "task t : z {\n  unknown q\n  unknown initial u\n" + uses("c", "  unknown c\n") +
         uses("F", "  unknown F\n") + uses("n", "  learn n\n") + "  minimise mean((u - 0.3)^2) + mean(w^3)" +
         (slot == Slot::loss ? " + mean((" + formula + ")^2)" : "") + "\n}\n";
}

/// The code of its refusal; "" if it is allowed. E0607: the length of steps has no derivative, and q, c, F and the
/// network's weights occur nowhere else.
std::string refusal_of(const Feature& feature, Slot slot) {
  const bool is_noise = feature.made == Made::of_noise;
  switch (slot) {
    case Slot::equation:
    case Slot::let:
    case Slot::held_value:
    case Slot::after_step:
    case Slot::at_time:
    case Slot::every:
    case Slot::observable:
    case Slot::loss:
    case Slot::output: return is_noise ? "E0311" : "";
    case Slot::speed: {
      const bool has_unknown = std::ranges::any_of(std::array{"q", "c", "F", "n", "phi"},
                                                   [&](const char* name) { return has_word(feature.formula, name); });
      return is_noise ? "E0311" : has_unknown ? "E0607" : "";
    }
    case Slot::wall_value:
    case Slot::wall_slope:
    case Slot::wall_mixed: return is_noise || feature.made > Made::of_values ? "E0311" : "";
    case Slot::coefficient:
    case Slot::initial: return feature.made > Made::of_noise ? "E0311" : "";
    case Slot::exact: return is_noise || feature.made > Made::of_time ? "E0311" : "";
  }
  return "";
}

struct Cell {
  std::string name;
  const Feature* feature;
  Slot slot;
};

std::vector<Cell> cells() {
  std::vector<Cell> some;
  std::size_t count = 0;
  for (const Feature& feature : features) {
    for (const auto& [name, slot] : slots) {
      if (testing::is_tried(count++, 9)) some.push_back({std::string(feature.name) + "_in_" + name, &feature, slot});
    }
  }
  return some;
}

/// The code of the first error; it must have a position in the text.
std::string code_of_refusal(const std::string& text) {
  const SourceFile source("test.dpde", text);
  CompileOptions options;
  options.selection.name = "t";
  options.adjoint = options.tangent = options.verify = true;
  DiagnosticSink sink;
  compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity != Severity::error) continue;
    EXPECT_TRUE(d.range.is_known()) << render_text(source, d);
    return std::string(d.kind->code);
  }
  return "";
}

class Slots : public ::testing::TestWithParam<Cell> {};

TEST_P(Slots, AreRightOrRefused) {
  const std::string text = text_of(*GetParam().feature, GetParam().slot);
  SCOPED_TRACE(text);
  const std::string wanted = refusal_of(*GetParam().feature, GetParam().slot);
  ASSERT_EQ(code_of_refusal(text), wanted);
  if (!wanted.empty()) return;
  testing::OpenedScene scene(text, "t", {.adjoint = true, .tangent = true});
  ASSERT_NE(scene.session, nullptr);
  const auto inverse = scene.inverse();
  ASSERT_NE(inverse, nullptr);
  const Eigen::VectorXd x = inverse->start();
  Eigen::VectorXd gradient(x.size()), again(x.size());
  const double loss = inverse->value_and_gradient(x, gradient);
  inverse->hold_steps(true);
  for (const Inverse::Part& part : inverse->parts()) {
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(x.size());
    direction.segment(part.offset, part.size) = Eigen::VectorXd::LinSpaced(part.size, 0.6, 1);
    const auto central = [&](double h) {
      return (inverse->value(x + h * direction) - inverse->value(x - h * direction)) / (2 * h);
    };
    const double difference = (4 * central(5e-4) - central(1e-3)) / 3, got = gradient.dot(direction);
    EXPECT_NEAR(got, difference, 1e-7 * (std::abs(difference) + std::abs(loss))) << part.name;
    EXPECT_NEAR(inverse->rate_along(x, direction), got, 1e-10 * (std::abs(got) + std::abs(loss))) << part.name;
  }
  inverse->hold_steps(false);
  testing::OpenedScene slow(text, "t", {.backend = Backend::interpreter, .adjoint = true});
  ASSERT_NE(slow.session, nullptr);
  EXPECT_NEAR(slow.inverse()->value_and_gradient(x, again), loss, 1e-12 * std::abs(loss));
  EXPECT_LT((again - gradient).norm(), 1e-10 * (gradient.norm() + std::abs(loss)));
}

INSTANTIATE_TEST_SUITE_P(OfTheTable, Slots, ::testing::ValuesIn(cells()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dpde::driver::slot_table
