// SPDX-License-Identifier: Apache-2.0
// Charts of speed against accuracy, and the choice of the cheapest method for a tolerance. Errors are compared with
// closed forms; times need only be present.
#include <complex>
#include <numbers>
#include <set>

#include "chart_support.h"

namespace dpde::testing {
namespace {

/// With central(2) the wave of wave number 1 has the speed sin(h)/h: for short steps the relative error after t = 1 is
/// 1 - sin(h)/h, also as a root mean square.
TEST_F(ChartCommand, ErrorsAreThoseOfClosedForms) {
  write("s.dpde", wind(true));
  const Outcome run = dpde("chart s.dpde --vary cells=16,32,64 --vary fraction=0.1 --vary advect=central2" + quick);
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  ASSERT_EQ(json["points"].size(), 3u);
  for (const Json& point : json["points"]) {
    const double h = 2 * std::numbers::pi / point["cells"][0].get<double>();
    EXPECT_NEAR(point["error"].get<double>(), 2 * std::sin(0.5 * (1 - std::sin(h) / h)), 1e-4) << point;
    EXPECT_GT(point["wall_s"].get<double>(), 0);
    EXPECT_TRUE(point["stable"].get<bool>());
    const double steps = 1 / point["step"].get<double>();
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
  }
}

/// Without an exact solution a finer run with another scheme is the reference, and its accuracy is reported.
TEST_F(ChartCommand, AFinerRunTakesThePartOfAnExactSolution) {
  write("exact.dpde", wind(true));
  write("none.dpde", wind(false));
  const std::string rest = " --vary cells=16,32 --vary fraction=0.5 --vary advect=central2,upwind3" + quick;
  const Json exact = dpde("chart exact.dpde" + rest).json(), none = dpde("chart none.dpde" + rest).json();
  ASSERT_EQ(exact["points"].size(), 4u);
  ASSERT_EQ(none["points"].size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const double error = exact["points"][i]["error"];
    EXPECT_NEAR(none["points"][i]["error"].get<double>(), error, 1e-3 * error + 1e-7);
  }
  EXPECT_EQ(exact["reference"]["uncertainty"], 0);
  EXPECT_LT(none["reference"]["uncertainty"].get<double>(), 1e-5);
  EXPECT_NE(none["reference"]["text"].get<std::string>().find("advect=central6"), std::string::npos);
}

TEST_F(ChartCommand, WhatIsUnstableIsNotRunAndWhatDoesNotFitIsLeftOut) {
  write("s.dpde", wind(true));
  for (const std::string step : {"half", "1/0", "/4", "1/", "-1/4", "1/4/2"})
    EXPECT_EQ(dpde("chart s.dpde --vary cells=32 --vary step=0.5," + step + quick).status, 2) << step;
  const Json json = dpde("chart s.dpde --vary cells=64 --vary step=1,1/4 --vary advect=central2,weno77" + quick).json();
  ASSERT_EQ(json["points"].size(), 4u);
  EXPECT_FALSE(json["points"][0]["stable"].get<bool>());  // limit 2.83*0.098 = 0.278
  EXPECT_TRUE(json["points"][0]["error"].is_null());
  EXPECT_TRUE(json["points"][1]["stable"].get<bool>());
  EXPECT_TRUE(json["points"][1]["pareto"].get<bool>());
  EXPECT_FALSE(json["points"][2]["fits"].get<bool>());
  const Json euler = dpde("chart s.dpde --vary cells=32 --vary time=euler" + quick).json();
  EXPECT_EQ(euler["points"][0]["failure"], "unstable at every step");
}

TEST_F(ChartCommand, GoesOnFromWhatItsFolderHolds) {
  write("s.dpde", wind(true));
  const std::string command = "chart s.dpde --vary fraction=0.5 --vary advect=central2 --out o";
  const Json first = dpde(command + " --vary cells=16,32" + quick).json();
  for (const char* name : {"o/ring_chart.csv", "o/ring_chart.json", "o/ring_chart_points.json"})
    EXPECT_TRUE(fs::exists(path(name))) << name;
  const Json second = dpde(command + " --vary cells=16,32,64 --resume" + quick).json();
  ASSERT_EQ(second["points"].size(), 3u);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(second["points"][i]["wall_s"], first["points"][i]["wall_s"]) << "timed once";
  // Other settings give other points: half the wind gives about half the error.
  const Json slow = dpde(command + " --vary cells=16,32 --set c=0.5 --resume" + quick).json();
  EXPECT_NEAR(slow["points"][1]["error"].get<double>() / first["points"][1]["error"].get<double>(), 0.5, 0.05);
  write("o/ring_chart_points.json", "{\"a\": {\"failure\": null}}");
  EXPECT_EQ(dpde(command + " --resume" + quick).codes(), std::vector<std::string>{"E0901"});
  write("o/ring_chart_points.json", "{");
  EXPECT_EQ(dpde(command + " --resume" + quick).codes(), std::vector<std::string>{"E0901"});
}

/// Ctrl-C in the middle: finished runs form a chart, in all its files, and the same command continues with the
/// remaining ones.
TEST_F(ChartCommand, CtrlCLeavesAChartThatGoesOn) {
  write("s.dpde", wind(true));
  const std::string command =
      "chart s.dpde --vary advect=central2 --vary time=rk4 --vary cells=16,24,32,48,64,96 --vary fraction=0.9,0.45 "
      "--samples 3 --sample-seconds 0.1 --out o";
  const Outcome stopped = interrupted(command + " --progress", "0.5", "o/ring_chart_points.json");
  EXPECT_EQ(stopped.status, by_ctrl_c) << stopped.err;
  EXPECT_NE(stopped.err.find("E0807"), std::string::npos) << stopped.err;
  EXPECT_NE(stopped.err.find(" left\n"), std::string::npos) << "progress: " << stopped.err;
  EXPECT_NE(stopped.err.find("--resume goes on from here"), std::string::npos);
  const Json part = parse_json(content(path("o/ring_chart.json"))).value();
  const std::size_t run = part["points"].size();
  ASSERT_GT(run, 0u);
  ASSERT_LT(run, 12u);
  const std::string table = content(path("o/ring_chart.csv"));
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(table, '\n')), 1 + run);
  ASSERT_EQ(std::system("gnuplot --version >/dev/null 2>&1"), 0) << "tools/setup installs gnuplot";
  EXPECT_TRUE(content(path("o/ring_chart.png")).starts_with("\x89PNG"));
  EXPECT_NE(content(path("o/ring_chart.svg")).find("</svg>"), std::string::npos);
  const Json all = dpde(command + " --resume --json").json();
  ASSERT_EQ(all["points"].size(), 12u);
  for (std::size_t i = 0; i < run; ++i)
    EXPECT_EQ(all["points"][i]["wall_s_samples"], part["points"][i]["wall_s_samples"]) << "is not run again";
}

TEST_F(ChartCommand, CtrlCBeforeTheReferenceIsNoFaultOfTheScene) {
  write("s.dpde", wind(false));
  const Outcome stopped = interrupted("chart s.dpde --reference-cells 262144 --out o", "0.3");
  EXPECT_EQ(stopped.status, by_ctrl_c) << stopped.err;
  EXPECT_NE(stopped.err.find("stopped before there was anything to compare with"), std::string::npos) << stopped.err;
  EXPECT_EQ(stopped.err.find("E0916"), std::string::npos) << stopped.err;
}

/// Without --tolerance the scene's accuracy line applies, to the fields that it names.
TEST_F(ChartCommand, TuneTakesTheAccuracyOfTheScene) {
  const auto with = [&](const std::string& line) {
    std::string text = wind(true);
    text.insert(text.find("  time"), "  " + line + "\n");
    write("s.dpde", text);
    return dpde("tune s.dpde" + quick);
  };
  const Outcome run = with("accuracy 2e-3 on u");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.json()["tolerance"].get<double>(), 2e-3);
  EXPECT_LE(run.json()["error"].get<double>(), 2e-3);
  EXPECT_EQ(dpde("tune s.dpde --tolerance 0.1" + quick).json()["tolerance"].get<double>(), 0.1);
  EXPECT_EQ(with("").codes(), std::vector<std::string>{"E0904"}) << "no tolerance";
  EXPECT_EQ(with("accuracy 1e-3 on w").codes(), std::vector<std::string>{"E0301"});
  EXPECT_EQ(with("accuracy 0 on u").codes(), std::vector<std::string>{"E0414"});
  EXPECT_EQ(with("accuracy 1e-3; accuracy 1e-2").codes(), std::vector<std::string>{"E0303"});
}

/// The gradient of the choice, run alone, agrees with the closed form pi sin(1) to the requested accuracy.
TEST_F(ChartCommand, TuneAsksTheSameOfGradients) {
  write("s.dpde", wind(true) +
                      "scene still : wind with plain {\n  grid x = 0 .. 2*pi, cells 32, periodic\n  c = 0\n"
                      "  initial u = sin(x)\n  time 0 .. 1, step 1/32\n}\n"
                      "task speed : ring {\n  data r = u from scene still at t = 0\n  unknown c from 1\n"
                      "  minimise 0.5*integral((u - r)^2)\n}\n");
  const Outcome run =
      dpde("tune s.dpde speed --gradient --tolerance 1e-2 --vary advect=central2,central4 --vary real=f64" + quick);
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  EXPECT_LE(json["error"].get<double>(), 1e-2);
  const std::string set =
      fmt::format(" --set step={} --set cells={} --set advect={} --set real=f64", json["chosen"]["step"].dump(),
                  json["chosen"]["cells"][0].dump(), json["chosen"]["advect"].get<std::string>());
  const Json proof = dpde("gradient s.dpde speed --json" + set).json();
  const double error = proof["gradient"]["c"]["value"].get<double>() / (std::numbers::pi * std::sin(1.0)) - 1;
  EXPECT_NEAR(std::abs(error), json["error"].get<double>(), 2e-4);
  EXPECT_EQ(dpde("tune s.dpde ring --gradient --tolerance 1e-2" + quick).codes(), std::vector<std::string>{"E0904"});
}

TEST_F(ChartCommand, TuneRefusesATaskWithoutItsGradient) {
  write("s.dpde", wind(true) + "task speed : ring { unknown c from 1; minimise integral(u^2) }\n");
  const Outcome run = dpde("tune s.dpde --task speed --tolerance 1e-2" + quick);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0904"});
  EXPECT_NE(run.err.find("add --gradient"), std::string::npos) << run.err;
  EXPECT_NE(dpde("tune --help").out.find("the shortest counts"), std::string::npos);
  EXPECT_NE(dpde("chart --help").out.find("the median counts"), std::string::npos);
}

/// RK4 with central(2) is stable up to a Courant number of 2.83 per substep, whatever their number.
TEST_F(ChartCommand, StepsThatACourantNumberSplitsAreJudged) {
  std::string text = wind(true);
  text.insert(text.find("step 1/32") + 9, ", courant 3, speed c");
  write("s.dpde", text);
  const std::string command = "chart s.dpde --vary cells=32,64 --vary fraction=1 --vary time=rk4 --set end=20";
  const Json points = dpde(command + quick).json()["points"];
  ASSERT_EQ(points.size(), 2u);
  EXPECT_TRUE(points[0]["stable"].get<bool>()) << "one part of 1/32 is short enough";
  // A step of 0.29 is not divided if 3*h is larger, and rk4 allows 2.83*h: on 64 cells there is room in between.
  const std::string split = "chart s.dpde --vary cells=32,64 --vary step=0.29 --vary time=rk4 --set end=29";
  const Json with_parts = dpde(split + quick).json()["points"];
  ASSERT_EQ(with_parts.size(), 2u);
  EXPECT_TRUE(with_parts[0]["stable"].get<bool>()) << with_parts;
  EXPECT_FALSE(with_parts[1]["stable"].get<bool>()) << with_parts;
  text.replace(text.find("courant 3"), 9, "courant 0.5");
  write("s.dpde", text);
  const Json tuned = dpde("tune s.dpde --tolerance 1e-2 --vary time=rk4 --vary real=f64" + quick).json();
  EXPECT_NE(tuned["text"].get<std::string>().find(", courant 0.5, speed c\n"), std::string::npos) << tuned;
}

/// Source terms make a manufactured solution exact, for coupled equations with coefficients, and of second order in
/// time.
TEST_F(ChartCommand, ManufacturedSolutionsShowTheOrder) {
  write("s.dpde",
        "model mix { field u, v; coefficient k; dt(u) = -advect(v, u) + div(k*grad(u)) + u^2*v - exp(-u)\n"
        "  dt(v) = -dx(u*v) + 0.1*lap(v) - max(u, v)*sqrt(v) }\nmodel string { field u; dt(dt(u)) = lap(u) - sin(u) }\n"
        "scheme low { advect = central(2); time = rk4 }\nscene s : mix with low {\n  grid x = -1 .. 1, cells 16, "
        "periodic\n  k = 0.1*(2 + sin(pi*x))\n  initial u = 0\n  initial v = 0\n  time 0 .. 0.5, step 0.01\n}\n"
        "scene w : string with low {\n  grid x = -1 .. 1, cells 16, periodic\n  initial u = 0\n  initial dt(u) = 0\n"
        "  time 0 .. 0.5, step 0.01\n}\n");
  const auto order = [&](const std::string& scene, const std::string& key, const std::string& value) {
    const Outcome run =
        dpde("chart s.dpde " + scene + " --manufactured --vary cells=32,64 --vary fraction=0.1 --vary " + key + "=" +
             value + " --vary time=rk4" + quick);
    EXPECT_EQ(run.status, 0) << run.err;
    const Json json = run.json();
    EXPECT_EQ(json["reference"]["text"], "a manufactured solution");
    return std::log2(json["points"][0]["error"].get<double>() / json["points"][1]["error"].get<double>());
  };
  EXPECT_NEAR(order("s", "dx", "central2"), 2, 0.15);
  EXPECT_NEAR(order("w", "lap", "central2"), 2, 0.15);
  EXPECT_NEAR(order("w", "lap", "central4"), 4, 0.15);
  write("walls.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 16\n  boundary u: "
        "all = 0\n  initial u = 0\n  time 0 .. 0.1, step 1e-3\n}\n");
  const Outcome walls = dpde("chart walls.dpde --manufactured" + quick);
  EXPECT_EQ(walls.codes(), std::vector<std::string>{"E0916"});
  EXPECT_NE(walls.err.find("walls and stretched axes stand in the way"), std::string::npos) << walls.err;
}

/// The chosen method has the reported error, which meets the tolerance.
TEST_F(ChartCommand, TuneProvesWhatItChooses) {
  write("s.dpde", wind(true));
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    const Outcome run = dpde(fmt::format("tune s.dpde --tolerance {}", tolerance) + quick);
    ASSERT_EQ(run.status, 0) << run.err;
    const Json json = run.json();
    EXPECT_LE(json["error"].get<double>(), tolerance);
    EXPECT_GT(json["tried"].get<int>(), 4);
    EXPECT_FALSE(json["runner_up"].empty());
    // The choice, run alone, has that error.
    std::string set =
        " --set step=" + json["chosen"]["step"].dump() + " --set cells=" + json["chosen"]["cells"][0].dump();
    for (const char* key : {"advect", "time", "real"}) {
      if (json["chosen"].contains(key)) set += fmt::format(" --set {}={}", key, json["chosen"][key].get<std::string>());
    }
    const Outcome proof = dpde("run s.dpde --json" + set);
    ASSERT_EQ(proof.status, 0) << proof.err;
    EXPECT_NEAR(proof.json()["error"]["u"]["l2"].get<double>() * std::sqrt(2.0), json["error"].get<double>(),
                1e-6 * tolerance + 1e-9);
  }
  const Outcome none = dpde("tune s.dpde --tolerance 1e-14 --most-cells 1" + quick);
  EXPECT_EQ(none.status, 1);
  EXPECT_EQ(none.codes(), std::vector<std::string>{"E0810"});
  EXPECT_EQ(dpde("tune s.dpde --tolerance 0" + quick).status, 2);
  write("none.dpde", wind(false));
  EXPECT_EQ(dpde("tune none.dpde --tolerance 1e-13 --most-cells 1" + quick).codes(), std::vector<std::string>{"E0916"});
}

TEST_F(ChartCommand, StabilityMeasuresWhatItPredicts) {
  write("s.dpde", wind(true));
  const Json json = dpde("stability s.dpde --json --out o").json();
  EXPECT_NEAR(json["predicted"]["max_courant"].get<double>(), 2.8284, 0.01);
  EXPECT_NEAR(json["ratio"].get<double>(), 1, 0.02);
  EXPECT_TRUE(fs::exists(path("o/stability.csv")));
  for (const Json& point : json["points"]) {
    const double part = point["step"].get<double>() / json["predicted"]["max_step"].get<double>();
    if (std::abs(part - 1) > 5e-4) EXPECT_EQ(point["stable"], part < 1) << point;
    const double predicted = std::log(std::max(1.0, point["predicted_growth"].get<double>()));
    EXPECT_NEAR(std::log(point["growth"].get<double>()), predicted, 0.05 * predicted + 1e-3) << point;
  }
  const Json against = dpde("stability s.dpde --against c=0.5..2 --points 3 --json").json();
  ASSERT_EQ(against["against"]["rows"].size(), 3u);
  for (const Json& row : against["against"]["rows"]) {
    EXPECT_NEAR(row["predicted"].get<double>() * row["c"].get<double>(), 2.8284 * 2 * std::numbers::pi / 32, 2e-3);
    EXPECT_NEAR(row["ratio"].get<double>(), 1, 0.02);
  }
  EXPECT_EQ(dpde("stability s.dpde --against c=2..1 --json").codes(), std::vector<std::string>{"E0904"});
  // Cells are integers without duplicates; 0 cannot be run: it is listed, and the others continue.
  const Json listed = dpde("stability s.dpde --against cells=0.4..32 --points 3 --json").json();
  ASSERT_EQ(listed["against"]["rows"].size(), 3u);
  EXPECT_TRUE(listed["against"]["rows"][0].contains("failure"));
  EXPECT_EQ(listed["against"]["rows"][1]["cells"], 4);
  EXPECT_NEAR(listed["against"]["rows"][2]["ratio"].get<double>(), 1, 0.02);
  EXPECT_EQ(dpde("stability s.dpde --against cells=31..32 --points 3 --json").json()["against"]["rows"].size(), 2u);
  EXPECT_FALSE(listed.contains("diagnostics"));
  EXPECT_EQ(dpde("stability s.dpde --against cells=0.1..0.4 --points 3 --json").status, 2);
  const Json weak = dpde("stability s.dpde --set time=rk2 --json").json();
  EXPECT_TRUE(weak["predicted"]["weak"].get<bool>());
}

/// A chart block replaces options; given options have precedence over its lines.
TEST_F(ChartCommand, ABlockOfTheFileSaysWhatIsRun) {
  write("s.dpde", wind(true) +
                      "scheme windward { advect = upwind(1); time = ssp_rk3 }\n"
                      "chart cost : ring {\n  reference exact\n  vary scheme in plain, windward\n"
                      "  vary cells in 16, 32\n  vary fraction in 1/2\n  error l2(u), linf(u) at t = 0.5\n"
                      "  tolerance 0.02\n}\n");
  const Outcome run = dpde("chart s.dpde --out o" + quick);
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  ASSERT_EQ(json["points"].size(), 4u);
  EXPECT_EQ(json["points"][3]["variant"]["scheme"], "windward");
  for (const Json& point : json["points"]) {
    EXPECT_EQ(point["errors"].size(), 2u);
    EXPECT_EQ(point["error"], point["errors"]["linf(u)"]) << "the largest of them";
    // For a sine the maximum is sqrt(2) times the root mean square.
    EXPECT_NEAR(point["errors"]["linf(u)"].get<double>() / point["errors"]["u"].get<double>(), std::sqrt(2.0), 0.03);
    EXPECT_NEAR(point["step"].get<double>() * point["steps"].get<int>(), 0.5, 1e-12);
  }
  // Half a unit of time with central(2): 1 - sin(h)/h of half the size, by linf in units of the root mean square.
  const double h = 2 * std::numbers::pi / 32, shift = 0.5 * (1 - std::sin(h) / h);
  EXPECT_NEAR(json["points"][1]["error"].get<double>(), std::sqrt(2.0) * 2 * std::sin(shift / 2), 1e-4);
  EXPECT_EQ(json["meets_tolerance"]["variant"]["scheme"], "plain");
  for (const char* name : {"o/cost.csv", "o/cost.json", "o/cost_points.json"}) EXPECT_TRUE(fs::exists(path(name)));
  const Json other = dpde("chart s.dpde cost --vary cells=24 --vary scheme=plain --set end=1" + quick).json();
  ASSERT_EQ(other["points"].size(), 1u);
  EXPECT_EQ(other["points"][0]["cells"][0], 24);
  EXPECT_NEAR(other["points"][0]["step"].get<double>() * other["points"][0]["steps"].get<int>(), 1, 1e-12);
  const Json norm = dpde("chart s.dpde --error 'l1(u)' --tolerance 0.5" + quick).json();
  EXPECT_TRUE(norm["points"][0]["errors"].contains("l1(u)"));
  EXPECT_EQ(norm["points"][0]["errors"].size(), 1u);
  EXPECT_LE(norm["meets_tolerance"]["error"].get<double>(), 0.5);
  EXPECT_EQ(dpde("chart s.dpde --error 'l3(u)'" + quick).codes(), std::vector<std::string>{"E0904"});
  EXPECT_EQ(dpde("chart s.dpde --error 'l2(w)'" + quick).codes(), std::vector<std::string>{"E0301"});
  const Json self = dpde("chart s.dpde cost --reference-cells 128" + quick).json();
  EXPECT_NE(self["reference"]["text"].get<std::string>().find("4 times"), std::string::npos);
  EXPECT_NEAR(self["points"][1]["error"].get<double>(), json["points"][1]["error"].get<double>(), 1e-4);
  EXPECT_EQ(dpde("chart s.dpde cost --reference-cells 32" + quick).codes(), std::vector<std::string>{"E0916"});
  EXPECT_EQ(dpde("chart s.dpde --vary scheme=plane" + quick).codes(), std::vector<std::string>{"E0904"});
}

/// The scene's own method is also among the tried ones: it is listed once.
TEST_F(ChartCommand, TheScenesOwnMethodStandsOnce) {
  write("s.dpde", wind(true));
  const Json all = dpde("chart s.dpde --vary cells=16 --vary fraction=0.5" + quick).json();
  std::set<std::string> methods;
  for (const Json& method : all["methods"]) EXPECT_TRUE(methods.insert(method["name"]).second);
  EXPECT_EQ(methods.size(), 7u);
  EXPECT_FALSE(methods.contains("advect=central2 time=rk4")) << "is the scene's own";
}

/// J = 1/2 int (u(T) - sin x)^2 of a sine advected at speed c: dJ/dc = pi T sin(c T) in the limit. With central(2) the
/// speed is s c, s = sin(h)/h, and dJ/dc = pi T s sin(s c T). The derivative by the initial state is u(T) minus the
/// target, propagated back: the same function on all grids.
TEST_F(ChartCommand, GradientsAreComparedToo) {
  write("s.dpde", wind(true) +
                      "scene still : wind with plain {\n  grid x = 0 .. 2*pi, cells 32, periodic\n  c = 0\n"
                      "  initial u = sin(x)\n  time 0 .. 1, step 1/32\n}\n"
                      "task speed : ring {\n  data r = u from scene still at t = 0\n  unknown c from 1\n"
                      "  unknown initial u\n  minimise 0.5*integral((u - r)^2)\n}\n");
  const Outcome run = dpde(
      "chart s.dpde speed --vary cells=32,64 --vary fraction=0.2 --vary advect=central2 --budget"
      " --out o" +
      quick);
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  EXPECT_EQ(json["gradient"]["task"], "speed");
  EXPECT_LT(json["gradient"]["reference"]["uncertainty"].get<double>(), 1e-5);
  for (const Json& point : json["points"]) {
    const double h = 2 * std::numbers::pi / point["cells"][0].get<double>(), s = std::sin(h) / h;
    const double expected = std::abs(s * std::sin(s) / std::sin(1.0) - 1);
    EXPECT_NEAR(point["gradient_errors"]["c"].get<double>(), expected, 1e-4) << point;
    // By the initial state: sin(x) - sin(x + s) instead of sin(x) - sin(x + 1), both of size 2 sin(s/2), half as far
    // apart.
    const std::complex<double> i(0, 1), is = 1.0 - std::exp(i * s), was = 1.0 - std::exp(i);
    EXPECT_NEAR(point["gradient_errors"]["initial u"].get<double>(), std::abs(is - was) / std::abs(was), 1e-4);
    EXPECT_GT(point["gradient_wall_s"].get<double>(), 0);
    EXPECT_FALSE(point["gradient_error"].is_null());
  }
  EXPECT_NE(content(path("o/ring_chart.csv")).find("gradient_error"), std::string::npos);
  const Outcome text = dpde("chart s.dpde ring --task speed --vary cells=32 --samples 1 --sample-seconds 0");
  EXPECT_NE(text.out.find("task speed: errors of the gradient"), std::string::npos) << text.out << text.err;
  EXPECT_EQ(dpde("chart s.dpde ring --task sped" + quick).codes(), std::vector<std::string>{"E0318"});
}

/// For the data's own scheme and step all differences are 0, where the root has no derivative.
TEST_F(ChartCommand, GradientsThatFailHaveARowAndACross) {
  write("s.dpde", wind(false) +
                      "task same : ring {\n  data r = u from scene ring\n  unknown c from 1\n"
                      "  minimise integral(sqrt((u - r)^2))\n}\n");
  const Outcome run = dpde(
      "chart s.dpde same --vary cells=32 --vary step=1/16,1/32 --vary advect=central2,upwind3 --set step=1/32"
      " --out o --samples 1 --sample-seconds 0");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("the loss or its gradient is not finite"), std::string::npos) << run.out;
  EXPECT_NE(content(path("o/ring_chart.svg")).find("it ran, but its gradient failed"), std::string::npos);
}

/// central(8) on half the reference's cells has an error below the accuracy of the reference of order 6.
TEST_F(ChartCommand, WhatTheReferenceDoesNotResolveIsMarked) {
  write("s.dpde", wind(false));
  const Outcome run = dpde(
      "chart s.dpde --vary advect=central2,central8 --vary cells=32 --vary fraction=0.05 --samples 1"
      " --sample-seconds 0");
  EXPECT_EQ(run.status, 0) << run.err;
  const std::size_t second = run.out.find("advect=central8\n"),
                    mark = run.out.find("(below the error of the reference)");
  EXPECT_NE(mark, std::string::npos) << run.out;
  EXPECT_GT(mark, second) << "central2 is resolved";
}

/// The interval of a speed-up uses the same timings each time; curves without a common error have none.
TEST_F(ChartCommand, SpeedUpsAtEqualAccuracyHaveAnInterval) {
  write("s.dpde", wind(true));
  const std::string command =
      "chart s.dpde --out o --vary time=rk4,ssp_rk3 --vary cells=16,32,64 --vary fraction=0.5"
      " --vary advect=central2,central4 --samples 5 --sample-seconds 0 --json";
  const Json first = dpde(command).json(), again = dpde(command + " --resume").json();
  ASSERT_EQ(first["speed_up"].size(), 3u);
  EXPECT_EQ(first["speed_up"], again["speed_up"]);
  for (const Json& point : first["points"]) EXPECT_EQ(point["wall_s_samples"].size(), 5u);
  const Json& other_time = first["speed_up"][0];  // the same errors of space
  ASSERT_FALSE(other_time["ratio"].is_null()) << first["speed_up"];
  EXPECT_LE(other_time["interval"][0], other_time["ratio"]);
  EXPECT_GE(other_time["interval"][1], other_time["ratio"]);
  const Json& far = first["speed_up"][1];  // central4 on 16 cells is better than central2 on 64
  EXPECT_EQ(far["method"], "advect=central4 time=rk4");
  EXPECT_TRUE(far["ratio"].is_null() && far["interval"].is_null()) << far;
}

TEST_F(ChartCommand, FieldsOfTheTableAreQuoted) {
  write("s.dpde", wind(true));
  ASSERT_EQ(dpde("chart s.dpde --out o --vary cells=64 --vary step=1" + quick).status, 0);
  const std::string table = content(path("o/ring_chart.csv"));
  EXPECT_NE(table.find(",\"the step is above 0.2777, the largest stable one\",,,,\n"), std::string::npos) << table;
}

/// Steps are chosen such that outputs, controls and losses fall on their ends.
TEST_F(ChartCommand, ChosenStepsEndWhereThingsHappen) {
  std::string text = wind(true);
  text.insert(text.find("  time"), "  output u every 1/4\n");
  write("s.dpde", text + "task shape : ring {\n  unknown initial u\n  minimise integral(u^2) at t = 0.375\n}\n");
  const std::string rest = " --vary advect=central2 --vary cells=16,32 --vary fraction=0.9";
  const Json plain = dpde("chart s.dpde ring" + rest + quick).json();
  const Json task = dpde("chart s.dpde shape" + rest + quick).json();
  ASSERT_TRUE(plain.contains("points") && task.contains("points")) << plain << task;
  for (int i = 0; i < 2; ++i) {
    const double step = plain["points"][i]["step"], in_task = task["points"][i]["step"];
    EXPECT_NEAR(0.25 / step, std::round(0.25 / step), 1e-9);
    EXPECT_NEAR(0.125 / in_task, std::round(0.125 / in_task), 1e-9);
    EXPECT_FALSE(task["points"][i]["gradient_error"].is_null()) << task["points"][i];
  }
}

/// Ordinary differential equations have no cells: references and candidates of tune take shorter steps.
TEST_F(ChartCommand, OfAScenesWithoutAGridVariesTheStep) {
  write("decay.dpde",
        "model m { field u; param k = 1; dt(u) = -k*u }\nscheme c { time = rk4 }\n"
        "scene s : m with c { initial u = 1; time 0 .. 1, step 1/8 }\nscene known = s { exact u = exp(-k*t) }\n"
        "chart costs : s { vary time in rk4, ssp_rk3; vary step in 1/4, 1/8 }\n");
  for (const std::string what : {"chart decay.dpde costs", "chart decay.dpde known --vary time=rk4 --vary step=0.25"}) {
    const Outcome run = dpde(what + quick);
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NEAR(run.json()["points"][0]["error"], 4.0e-5, 1e-6) << what;  // R(-1/4)^4 = 0.3678942
  }
  const Outcome tuned = dpde("tune decay.dpde s --tolerance 1e-6 --vary time=rk4" + quick);
  ASSERT_EQ(tuned.status, 0) << tuned.err;
  EXPECT_LT(tuned.json()["error"], 1e-6);
  EXPECT_EQ(std::string(tuned.json()["text"]).find("cells"), std::string::npos);
  for (const std::string what : {"run decay.dpde costs", "run decay.dpde cost"})
    EXPECT_NE(dpde(what).err.find("costs is a chart: dpde chart FILE costs"), std::string::npos) << what;
}

}  // namespace
}  // namespace dpde::testing
