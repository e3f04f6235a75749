// SPDX-License-Identifier: Apache-2.0
// Each boundary condition at each kind of side with each command: check's verdict, runs of two back ends, a gradient
// against differences and tangents, an optimiser, the certificate, all emitted text, and emitted text read back and
// run. If a condition makes no sense, the table has the code of its refusal. By day every 41st cell, at night all.
#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "analysis/certificate/certificate.h"
#include "codegen/cpp/emit_cpp.h"
#include "codegen/llvm/emit_llvm.h"
#include "dpde/runtime/optimise.h"
#include "driver/scene/scene_text.h"
#include "loop/print_loop.h"
#include "stability/stability_report.h"
#include "stencil/text/print_stencil.h"
#include "support/opened_scene.h"
#include "support/scene_run.h"
#include "support/setting.h"
#include "support/side_conditions.h"

namespace dpde::driver::condition_table {
namespace {

namespace testing = dpde::testing;

/// As written by a user for a field u; empty if not allowed in models, or only for poles. `along`: the coordinate along
/// the side.
std::vector<std::string> written(const SideCondition& condition, const std::string& along) {
  switch (condition.kind) {
    case SideKind::value: return {"0", "0.5", "sin(t)", "0.2*cos(" + along + ")", "q", "q*u", "q*u^2", "g", "F"};
    case SideKind::zero_gradient: return {"zero_gradient"};
    case SideKind::gradient:
      return {"gradient(0.3)",
              "gradient(-q*u)",
              "gradient(-q*u^2)",
              "gradient(cos(t))",
              "gradient(g)",
              "gradient(g*u - q*u^2)",
              "gradient(sin(" + along + "))",
              "gradient(F)"};
    case SideKind::mixed:
      return {"mixed(1, 0.5, 0.2)", "mixed(q, 1, 0)", "mixed(1, q, sin(t))", "mixed(1, 1, g)",
              "mixed(1, 1, q*u^2)", "mixed(1, 1, F)", "mixed(g, 1, 0)"};
    case SideKind::linear: return {"linear"};
    case SideKind::outflow: return {"outflow"};
    case SideKind::radiating:
      return {"radiating(1)", "radiating(q)", "radiating(1 + g)", "radiating(1 + u^2)", "radiating(1 + q*t)"};
    case SideKind::pole:
    case SideKind::opposite_pole:
    case SideKind::gradient_at_cell:
    case SideKind::line: return {};  // written for poles (below), otherwise only by the compiler
  }
  return {};
}

bool has_word(const std::string& text, const std::string& word) {
  return std::regex_search(text, std::regex("\\b" + word + "\\b"));
}

/// The field u: a wave or an advected field at centres, or an advected field on the faces that lie on the side.
enum class Lies { wave, carried, on_faces };

/// A grid, one of its sides, and the conditions of the other sides.
struct Place {
  std::string grid, side, others, along;
};
const std::string box = "  grid x = 0 .. 1, cells 6\n  grid y = 0 .. 1, cells 5\n";
const std::string disc =
    "  coordinates polar\n  grid r = 0 .. 1, cells 5\n  grid theta = 0 .. 2*pi, cells 6, periodic\n";
const std::string ring = "  grid x = 0 .. 1, cells 6\n  grid y = 0 .. 1, cells 5, periodic\n";
const std::vector<Place> places = {
    {"  grid x = 0 .. 1, cells 9\n", "x.high", "x.low = 0.1", "t"},
    {box, "x.low", "x.high = 0.1, y.low = 0.1, y.high = zero_gradient", "y"},
    {box, "x.high", "x.low = 0.1, y.low = 0.1, y.high = zero_gradient", "y"},
    {box, "y.low", "x.low = 0.1, x.high = gradient(0.2), y.high = 0.1", "x"},
    {box, "y.high", "x.low = 0.1, x.high = gradient(0.2), y.low = 0.1", "x"},
    {ring, "x.low", "x.high = mixed(1, 0.5, 0.2)", "y"},
    {disc, "r.high", "r.low = pole", "theta"},
};

struct Cell {
  Place place;
  Lies lies;
  std::string condition;
};

bool is_on_a_disc(const Cell& cell) { return cell.place.side.front() == 'r'; }

std::string scene_of(const Cell& cell) {
  const auto [place, lies, condition] = cell;
  const bool has_g = has_word(condition, "g"), has_f = has_word(condition, "F"), has_q = has_word(condition, "q");
  const bool has_two = place.grid.find("grid y") != std::string::npos;
  const std::string x = is_on_a_disc(cell) ? "r" : "x", y = is_on_a_disc(cell) ? "cos(theta)" : has_two ? "y" : "0.3";
  const std::string carried = is_on_a_disc(cell) ? "" : has_two ? " - 0.3*dx(u) - 0.2*dy(u)" : " - 0.3*dx(u)";
  std::string text =
      "model m { field u" + (lies == Lies::on_faces ? " on faces." + place.side.substr(0, 1) : "") + "; param k" +
      (has_q ? ", q" : "") + (has_g ? "; coefficient g" : "") + (has_f ? "; control F" : "") +
      (lies == Lies::wave ? "; dt(dt(u)) = k*lap(u) - 0.1*dt(u) }\n" : "; dt(u) = 0.1*k*lap(u)" + carried + " }\n");
  text += "scheme s { time = rk4 }\nscene z : m with s {\n" + place.grid + "  k = 1" + (has_q ? "; q = 0.8" : "") +
          (has_g ? "; g = 0.3 + 0.1*" + x + " + 0.05*" + y : "") + (has_f ? "; F = 0.5 + sin(5*t) every 0.02" : "") +
          "\n  boundary u: " + place.side + " = " + condition + ", " + place.others + "\n  initial u = exp(-9*(" + x +
          " - 0.6)^2) + 0.2*" + y + "\n" + (lies == Lies::wave ? "  initial dt(u) = 0.1\n" : "") +
          "  time 0 .. 0.04, step 0.01\n  observe o = mean(u^2)\n}\n";
  return text + "task find : z { unknown k from 1.1; " + (has_q ? "unknown q from 0.7; " : "") +
         (has_g ? "unknown g; " : "") + (has_f ? "unknown F; " : "") +
         "unknown initial u; minimise mean((u - 0.2)^2) at t = 0.04 }\n";
}

/// The code of its refusal; "" if it is allowed.
std::string refusal_of(const Cell& cell) {
  const std::string& condition = cell.condition;
  const bool radiates = condition.starts_with("radiating"), is_low = cell.place.side.ends_with(".low");
  if (radiates && cell.lies != Lies::wave) return "E0311";                      // requires an equation dt(dt(u)) = ...
  if (has_word(condition, "u") && cell.lies == Lies::on_faces) return "E0311";  // a formula of fields
  if (condition == "outflow" && cell.lies == Lies::on_faces && is_low) return "E0311";
  if (condition == "mixed(g, 1, 0)") return "E0605";  // weights are numbers
  return "";
}

std::vector<Cell> cells() {
  std::vector<Cell> all;
  for (const Place& place : places) {
    for (const Lies lies : {Lies::wave, Lies::carried, Lies::on_faces}) {
      if (place.side.front() == 'r' && lies == Lies::on_faces) continue;  // numeric/coordinates_test
      for (const SideCondition& condition : side_condition_table()) {
        for (std::string& text : written(condition, place.along)) all.push_back({place, lies, std::move(text)});
      }
    }
  }
  std::vector<Cell> some;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (testing::is_tried(i, 41)) some.push_back(std::move(all[i]));
  }
  return some;
}

void expect_right_gradient(Inverse& inverse) {
  const Eigen::VectorXd x = inverse.start();
  Eigen::VectorXd gradient(x.size());
  inverse.value_and_gradient(x, gradient);
  const Eigen::VectorXd direction = Eigen::VectorXd::LinSpaced(x.size(), -1, 1);
  constexpr double h = 1e-4;
  const double difference = (inverse.value(x + h * direction) - inverse.value(x - h * direction)) / (2 * h);
  EXPECT_NEAR(difference, gradient.dot(direction), 1e-6 * gradient.norm() * direction.norm());
  EXPECT_NEAR(inverse.rate_along(x, direction), gradient.dot(direction), 1e-11 * gradient.norm() * direction.norm());
}

void expect_lower_loss(Inverse& inverse) {
  const Objective objective = [&](const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
    return inverse.value_and_gradient(x, gradient);
  };
  const OptimiseResult result = minimise(Lbfgs{}, objective, inverse.start(), 2);
  EXPECT_LT(result.loss, result.losses.front());
}

void expect_certified(const testing::OpenedScene& scene) {
  CompileOptions options = scene.session->compiled().options;
  options.second = true;
  DiagnosticSink sink;
  auto compiled = compile(scene.source, options, sink);
  ASSERT_TRUE(compiled.has_value());
  const auto certificate =
      analysis::certify(scene.source, std::make_shared<const Compiled>(std::move(*compiled)), {}, sink);
  ASSERT_TRUE(certificate.has_value() && !sink.has_errors());
  EXPECT_TRUE(certificate->passed()) << certificate->worst() << " " << certificate->slope.value_or(0) << " "
                                     << certificate->note;
  EXPECT_TRUE(!certificate->second || certificate->second->passed());
}

void expect_verdict(Session& session) {
  const stability::StabilityReport verdict = stability::verdict_of(session);
  EXPECT_EQ(verdict.why, "");
  DiagnosticSink sink;
  EXPECT_TRUE(stability::check_step(session, false, sink));
}

/// Each stage can be printed; the printed scene and programs, if runnable, give bit-identical results.
void expect_same_read_back(const testing::OpenedScene& scene, const testing::SceneResult& wanted) {
  const Compiled& compiled = scene.session->compiled();
  EXPECT_FALSE(loop::print(compiled.loop).empty());
  EXPECT_FALSE(codegen::emit_cpp(compiled.loop, &scene.source).empty());
  if (testing::is_thorough()) EXPECT_FALSE(codegen::emit_llvm(compiled.loop, false).empty());
  const std::string rest = scene_text(compiled);
  if (rest.starts_with("# scene")) return;  // fields on faces, controls and poles cannot be expressed in it
  const std::string text = stencil::print(extract(compiled.stencil, compiled.primal_programs)) + "\n" + rest;
  const testing::SceneResult again = testing::run_scene(text, "z", {}, Backend::interpreter);
  EXPECT_EQ(again.state, wanted.state) << text;
}

std::string code_of_refusal(const std::string& text) {
  const SourceFile source("test.dpde", text);
  CompileOptions options;
  options.selection.name = "find";
  options.adjoint = options.tangent = true;
  DiagnosticSink sink;
  compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity == Severity::error) return std::string(d.kind->code);
  }
  return "";
}

class Conditions : public ::testing::TestWithParam<Cell> {};

TEST_P(Conditions, ByEveryVerb) {
  const Cell& cell = GetParam();
  const std::string text = scene_of(cell);
  SCOPED_TRACE(text);
  ASSERT_EQ(code_of_refusal(text), refusal_of(cell));
  if (!refusal_of(cell).empty()) return;
  testing::OpenedScene scene(text, "find", {.adjoint = true, .tangent = true});
  ASSERT_NE(scene.session, nullptr);
  const auto inverse = scene.inverse();
  ASSERT_NE(inverse, nullptr);
  expect_right_gradient(*inverse);
  expect_lower_loss(*inverse);
  expect_certified(scene);
  const testing::SceneResult compiled = testing::run_scene(text, "z"),
                             interpreted = testing::run_scene(text, "z", {}, Backend::interpreter);
  for (std::size_t i = 0; i < compiled.state.at("u").size(); ++i)
    EXPECT_NEAR(compiled.state.at("u")[i], interpreted.state.at("u")[i], 1e-12);
  testing::OpenedScene alone(text, "z");
  ASSERT_NE(alone.session, nullptr);
  expect_verdict(*alone.session);
  expect_same_read_back(alone, interpreted);
}

/// A speed given by a formula of fields that has a constant value equals that number.
TEST(ConditionsOfWaves, WithSpeedsOfTheFields) {
  for (const Place& place : places) {
    const auto end_of = [&](const std::string& condition) {
      return testing::run_scene(scene_of({place, Lies::wave, condition}), "z").state.at("u");
    };
    const std::vector<double> number = end_of("radiating(1.3)"), made = end_of("radiating(if(u < 9, 1.3, 1))");
    for (std::size_t i = 0; i < number.size(); ++i) EXPECT_NEAR(made[i], number[i], 1e-14) << place.side;
  }
}

std::string name_of(const ::testing::TestParamInfo<Cell>& info) {
  static const char* const lies[] = {"wave", "carried", "on_faces"};
  std::string name = info.param.place.side + "_" + lies[static_cast<int>(info.param.lies)] + "_" +
                     info.param.condition + "_" + std::to_string(info.index);
  return std::regex_replace(name, std::regex("[^A-Za-z0-9]+"), "_");
}

INSTANTIATE_TEST_SUITE_P(OfTheTable, Conditions, ::testing::ValuesIn(cells()), name_of);

}  // namespace
}  // namespace dpde::driver::condition_table
