// SPDX-License-Identifier: Apache-2.0
// What the command says of a scene, as a host gets it: values with words and JSON, and panels, without the command.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "plot/curve.h"
#include "plot/scene_panels.h"
#include "plot/text_plot.h"
#include "report/scene/formal_order.h"
#include "report/scene/scene.h"
#include "report/scene/step_character.h"
#include "report/scene/verdict.h"
#include "support/opened_scene.h"

namespace dpde::report {
namespace {

constexpr const char* text = R"(
model heat { field u; param k; dt(u) = k*lap(u) }
scheme plain { time = rk4 }
scene rod : heat with plain {
  grid x = 0 .. 1, cells 16, periodic
  k = 0.1
  initial u = 1 + sin(2*pi*x)
  time 0 .. 0.1, step 0.005
}
)";

TEST(Reports, OfAScene) {
  testing::OpenedScene opened(text, "rod");
  ASSERT_NE(opened.session, nullptr);
  SceneOptions options;
  options.shows_waves = true;
  const std::shared_ptr<const driver::Compiled> compiled = opened.session->shared_compiled();
  const Report report = scene_report({opened.source, *compiled, std::move(opened.session)}, options, opened.sink);
  EXPECT_TRUE(report.text().starts_with("scene rod: x = 0 .. 1 in 16 periodic cells, 20 steps of 0.005\n"))
      << report.text();
  // rk4 on the negative real axis is stable to z = -2.785; central2 has eigenvalues down to -4*k/h^2.
  EXPECT_NEAR(report.json["stability"]["max_step"].get<double>(), 2.785 / (4 * 0.1 * 16 * 16), 1e-4);
  EXPECT_EQ(report.json["order"]["space"], 2);
  EXPECT_EQ(report.json["order"]["time"], 4);
  EXPECT_EQ(report.json["types"]["u"].get<std::string>(), "state");
  EXPECT_GT(report.json["waves"].size(), 0u);
  EXPECT_TRUE(report.json["monotone"].contains("kept"));
}

TEST(Reports, AValueHasBothPrinters) {
  testing::OpenedScene opened(text, "rod");
  ASSERT_NE(opened.session, nullptr);
  const FormalOrder order = formal_order(opened.session->problem());
  EXPECT_EQ(order.whole.space, 2);
  EXPECT_EQ(text_of(order), "order: 2 in space, 4 in time\n");
  EXPECT_EQ(json_of(order)["order"]["time"], order.whole.time);
  const FormalOrder jumping = formal_order(opened.session->problem(), {{.name = "k"}});
  EXPECT_EQ(text_of(jumping), "order: 1 in space where k jumps, 2 elsewhere, 4 in time\n");
}

/// Measured errors of the second and third on 8, 16 and 32 cells: 2.8e-2, 7.1e-3, 1.8e-3.
TEST(Reports, ExponentialStepsAreExactInTheTermsOfTheStateItself) {
  for (const auto& [model, order] : std::vector<std::pair<std::string, std::string>>{
           {"field u; dt(u) = lap(u)", "spectral"},
           {"field u; dt(dt(u)) = lap(u)", "2"},
           {"field u, v; dt(u) = -dx(v); dt(v) = -dx(u)", "2"},
           {"field u, v; dt(u) = lap(u) + v; dt(v) = lap(v) - u", "spectral"}}) {
    const std::string own = model.find("dt(dt") != std::string::npos ? "; initial dt(u) = 0" : "";
    const std::string two = model.find("v;") != std::string::npos ? "; initial v = 0" : "";
    testing::OpenedScene opened("model m { " + model +
                                    " }\nscheme e { time = etdrk4 }\nscene s : m with e { grid x = 0 .. "
                                    "1, cells 8, periodic; initial u = sin(2*pi*x)" +
                                    own + two + "; time 0 .. 1, step 1/64 }\n",
                                "s");
    ASSERT_NE(opened.session, nullptr) << model;
    EXPECT_EQ(text_of(formal_order(opened.session->problem())), "order: " + order + " in space, 4 in time\n") << model;
  }
}

TEST(Reports, SayOnWhichCellsAVerdictSolved) {
  testing::OpenedScene opened(text, "rod");
  ASSERT_NE(opened.session, nullptr);
  const model::Problem& problem = opened.session->problem();
  stability::StabilityReport verdict = stability::verdict_of(*opened.session);
  EXPECT_FALSE(verdict_report(problem, verdict, opened.source).json.contains("solution_cells"));
  verdict.solution_cells = {8, 4};
  const Report report = verdict_report(problem, verdict, opened.source);
  EXPECT_EQ(report.json["solution_cells"].dump(), "[8,4]");
  EXPECT_NE(report.text().find("  what it solves for was found on 8 x 4 cells"), std::string::npos) << report.text();
}

TEST(Reports, AreAddedUp) {
  Report report, other;
  report.say("one\n");
  report.json["a"] = 1;
  other.add("t.csv", "x\n1\n");
  other.say("two\n");
  other.json = {{"a", 2}, {"b", 3}};
  report.append(other);
  EXPECT_EQ(report.text(), "one\ntwo\n");
  ASSERT_EQ(report.parts.size(), 3u);
  EXPECT_EQ(std::get<TextFile>(report.parts[1]).text, "x\n1\n");
  EXPECT_EQ(report.json.dump(), R"({"a":2,"b":3})");
  const double none = std::numeric_limits<double>::quiet_NaN();
  report.add_if_drawn("empty", {.curves = {{"u", {1, 2}, {none, none}}}});
  EXPECT_EQ(report.parts.size(), 3u);
  report.add_if_drawn("full", {.curves = {{"u", {1, 2}, {none, 1}}}});
  EXPECT_EQ(std::get<Picture>(report.parts.back()).name, "full");
}

TEST(Plots, OfAScene) {
  testing::OpenedScene opened(text, "rod");
  ASSERT_NE(opened.session, nullptr);
  const std::vector<plot::Panel> panels =
      plot::panels_of(*opened.session, "start", {{"u", opened.session->initial(0), {}, "u"}});
  ASSERT_EQ(panels.size(), 1u);
  const auto& panel = std::get<plot::LinePanel>(panels.front());
  EXPECT_EQ(panel.x_label, "x");
  ASSERT_EQ(panel.curves.front().y.size(), 16u);
  EXPECT_NEAR(panel.curves.front().x[0], 0.5 / 16, 1e-15);
  EXPECT_NEAR(panel.curves.front().y[0], 1 + std::sin(2 * M_PI * 0.5 / 16), 1e-15);
  EXPECT_NE(plot::text_plot(panel, false, 20, 5).find('*'), std::string::npos);
}

TEST(Plots, LongCurvesKeepWhatShows) {
  std::vector<double> values(100'000, 0.0);
  values[77'777] = 1;
  const plot::Curve curve = plot::curve_of("u", values, [](std::size_t i) { return static_cast<double>(i); });
  EXPECT_LT(curve.y.size(), 11'000u);
  EXPECT_NE(std::ranges::find(curve.x, 77'777.0), curve.x.end());
}

}  // namespace
}  // namespace dpde::report
