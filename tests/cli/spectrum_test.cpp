// SPDX-License-Identifier: Apache-2.0
// Spectra and correlations of roll-outs, break-even of a training, and residuals of data sets: against exact results of
// the schemes.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

/// Learned in one update that changes nothing: the tests see the initial values.
std::string untrained_with_spectra(const std::string& unknown, const std::string& steps, const std::string& tests,
                                   const std::string& field = "u") {
  return "task t : tried { data r = trajectories(\"truth.nc\", " + field + "); " + unknown + "; minimise mean((" +
         field + " - r)^2) over " + steps + " steps; using adam(rate = 1e-300), epochs 1\n  " + tests + " }\n";
}

class Spectra : public Command {
 protected:
  Outcome made(const std::string& text, const std::string& arguments = "--json") const {
    write("t.dpde", text);
    const Outcome data = dpde("run t.dpde truths --out . --json");
    EXPECT_EQ(data.status, 0) << data.out << data.err;
    return dpde("optimize t.dpde t --beside-named-only " + arguments);
  }
};

// ---- spectra --------------------------------------------------------------------------------------------------------

/// Every wave is an eigenvector of the differences.
std::string heat(const std::string& name, const std::string& nu, int cells) {
  const std::string n = std::to_string(cells);
  return "scene " + name + " : heat with plain { grid x = 0 .. 2*pi, cells " + n +
         ", periodic; grid y = 0 .. 2*pi, cells " + n + ", periodic; nu = " + nu + "; a = 1\n" +
         "  initial u = (a*cos(x), 0.5*a*cos(3*y) + 0.25*cos(3*x + 4*y)); time 0 .. 1, step 1/16 }\n";
}
const std::string three =
    "model heat { vector u; param nu; param a; dt(u) = nu*lap(u) }\nscheme plain { time = euler }\n" +
    heat("truth", "0.1", 16) + heat("tried", "0.2", 16) + heat("finer", "0.15", 32) +
    "dataset truths : truth { runs 2; vary a from 1; frames every 1/4; file \"truth.nc\" }\n";

double factor(double nu, int cells, int k) {
  return -nu * std::pow(2 * std::sin(M_PI * k / cells) * cells / (2 * M_PI), 2);
}

/// Mean over the frames at steps 4, 8, 12 and 16 of the factor of a wave's energy.
double mean_decay(double rate) {
  double sum = 0;
  for (int step = 4; step <= 16; step += 4) sum += std::pow(1 + rate / 16, 2 * step) / 4;
  return sum;
}

class SpectraOfWaves : public Spectra, public ::testing::WithParamInterface<const char*> {};

/// Placement on faces only shifts the phase of waves.
INSTANTIATE_TEST_SUITE_P(Placements, SpectraOfWaves, ::testing::Values("vector u", "vector u on faces"));

TEST_P(SpectraOfWaves, AreThoseOfTheScheme) {
  std::string text = three;
  text.replace(text.find("vector u"), 8, GetParam());
  const std::string data =
      "dataset fine_truths : finer { runs 2; vary a from 1; frames every 1/4; file \"finer.nc\" }\n";
  write("d.dpde", text + data);
  ASSERT_EQ(dpde("run d.dpde fine_truths --out . --json").status, 0);
  const Outcome outcome =
      made(text + untrained_with_spectra("unknown nu from 0.2", "4",
                                         "spectrum energy = u on trajectories(\"truth.nc\") for 16 steps beside "
                                         "finer on trajectories(\"finer.nc\")",
                                         "u.x"),
           "--json --out o");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json energy = outcome.json()["spectrum"]["energy"];
  // cos(x) in shell 1, cos(3y) in shell 3, cos(3x + 4y) in shell 5; a is 1 and 2, in the mean a^2 = 2.5.
  const auto check = [&](const Json& one, const char* key, double nu, int cells) {
    const double waves[] = {0, 2.5 / 4 * mean_decay(factor(nu, cells, 1)),
                            0, 2.5 / 16 * mean_decay(factor(nu, cells, 3)),
                            0, 1.0 / 64 * mean_decay(factor(nu, cells, 3) + factor(nu, cells, 4))};
    for (std::size_t s = 0; s < one[key].size(); ++s)
      EXPECT_NEAR(one[key][s].get<double>(), s < 6 ? waves[s] : 0, 1e-13) << key << s;
  };
  check(energy, "energy", 0.2, 16);
  check(energy["start"], "energy", 0.2, 16);
  check(energy, "data", 0.1, 16);
  check(energy["beside"]["finer"], "energy", 0.15, 32);
  check(energy["beside"]["finer"], "data", 0.15, 32);
  EXPECT_EQ(energy["last_shell"], 7);
  EXPECT_EQ(energy["unit"], 1.0);
  double distance = 0;
  for (const auto& [a, b] : {std::pair{factor(0.2, 16, 1), factor(0.1, 16, 1)},
                             {factor(0.2, 16, 3), factor(0.1, 16, 3)},
                             {factor(0.2, 16, 3) + factor(0.2, 16, 4), factor(0.1, 16, 3) + factor(0.1, 16, 4)}}) {
    distance += std::abs(std::log10(mean_decay(a) / mean_decay(b))) / 3;
  }
  EXPECT_NEAR(energy["distance"]["mean"].get<double>(), distance, 1e-9) << "over the three shells that hold anything";
  EXPECT_EQ(energy["distance"]["runs"].size(), 2U);
  EXPECT_NEAR(energy["beside"]["finer"]["distance"]["mean"].get<double>(), 0, 1e-13) << "what made its data";
  const std::string table = content(path("o/energy.csv"));
  EXPECT_EQ(table.substr(0, table.find('\n')),
            "shell,wave_number,energy_of_data,energy,energy_at_start,energy_of_finer,energy_of_data_of_finer");
  EXPECT_EQ(std::ranges::count(content(path("o/energy_beside.csv")), '\n'), 3);
}

TEST_F(Spectra, AreDrawnWithBothAxesLogarithmic) {
  if (shell("command -v gnuplot").status != 0) GTEST_SKIP() << "gnuplot is not there";
  const Outcome outcome =
      made(three + untrained_with_spectra("unknown nu from 0.2", "4",
                                          "spectrum energy = u on trajectories(\"truth.nc\") for 16 steps", "u.x"),
           "--out o");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_NE(outcome.out.find("spectrum energy over 2 runs to t = 1: mean of |log10| of the ratio to the data's, over "
                             "shells 1 to 7\n  tried: 0."),
            std::string::npos)
      << outcome.out;
  const std::string picture = content(path("o/energy.svg"));
  EXPECT_NE(picture.find("waves along the longest axis"), std::string::npos);
  EXPECT_NE(picture.find("energy of the shell"), std::string::npos);
  EXPECT_NE(picture.find(">-2</tspan>"), std::string::npos) << "powers of ten";
}

// ---- correlation ----------------------------------------------------------------------------------------------------

/// A moving wave: u = sin(x - c*t). The correlation of two is the cosine of their phase difference.
TEST_F(Spectra, CorrelationIsLostAsWavesDriftApart) {
  const auto scene = [](const std::string& name, const std::string& c) {
    return "scene " + name + " : wave with plain { grid x = 0 .. 2*pi, cells 12, periodic; c = " + c +
           "; a = 1; initial u = a*sin(x) + 7; initial v = a*cos(x); time 0 .. 4, step 1/64 }\n";
  };
  const std::string text =
      "model wave { field u; field v; param c; param a; dt(u) = -c*v; dt(v) = c*(u - 7) }\nscheme plain { time = rk4 "
      "}\n" +
      scene("truth", "1") + scene("tried", "1.5") + scene("near", "0.9") + scene("far", "-1") +
      "dataset truths : truth { runs 3; vary a from 1; frames every 1/4; file \"truth.nc\" }\n";
  const std::string rest = " on trajectories(\"truth.nc\") for 256 steps beside near, far";
  const Outcome outcome = made(text + untrained_with_spectra("unknown c from 1.5", "16",
                                                             "correlation usual = 2*u" + rest +
                                                                 "\n  correlation high = (u, v).x above 0.95" + rest),
                               "--json --out o");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const auto expected = [](double apart, double threshold) {
    for (int k = 1; k <= 16; ++k) {
      const double t = 0.25 * k, before = std::cos(apart * (t - 0.25)), now = std::cos(apart * t);
      if (now < threshold) return t - 0.25 + 0.25 * (before - threshold) / (before - now);
    }
    return 4.0;
  };
  for (const auto& [name, threshold] : {std::pair{"usual", 0.8}, {"high", 0.95}}) {
    const Json found = outcome.json()["correlation"][name];
    EXPECT_EQ(found["threshold"], threshold);
    for (int k = 1; k <= 16; ++k)
      EXPECT_NEAR(found["course"][static_cast<std::size_t>(k - 1)].get<double>(), std::cos(0.5 * 0.25 * k), 1e-7) << k;
    EXPECT_NEAR(found["time"]["mean"].get<double>(), expected(0.5, threshold), 1e-6);
    EXPECT_NEAR(found["time"]["spread"].get<double>(), 0, 1e-6);
    EXPECT_NEAR(found["start"]["time"]["mean"].get<double>(), expected(0.5, threshold), 1e-6);
    EXPECT_NEAR(found["beside"]["near"]["time"]["mean"].get<double>(), expected(0.1, threshold), 1e-6);
    EXPECT_NEAR(found["beside"]["far"]["time"]["mean"].get<double>(), expected(2, threshold), 1e-6);
    EXPECT_EQ(found["staying"], 0);
  }
  EXPECT_EQ(outcome.json()["correlation"]["usual"]["beside"]["near"]["staying"], 3) << "cos 0.4 is above 0.8";
  EXPECT_EQ(content(path("o/usual.csv")).substr(0, 2), "t,");
  const Outcome words = dpde("optimize t.dpde t --beside-named-only");
  EXPECT_NE(
      words.out.find(
          "  near: 4 +- 0 on truth.nc; 3 of 3 runs stay above it to the end, t = 4, which is taken for their time, "),
      std::string::npos)
      << words.out;
}

/// A run that blows up has no correlation left.
TEST_F(Spectra, NothingIsLeftOfWhatBlowsUp) {
  const std::string text =
      "model grown { field u; param c; dt(u) = c*u^3 }\nscheme plain { time = euler }\nscene truth : grown with plain "
      "{ grid x = 0 .. 2*pi, cells 8, periodic; c = 0; initial u = sin(x); time 0 .. 2, step 1/8 }\n"
      "scene tried : grown with plain { grid x = 0 .. 2*pi, cells 8, periodic; c = 0; initial u = sin(x); time 0 .. 2, "
      "step 1/8 }\n"
      "scene lost : grown with plain { grid x = 0 .. 2*pi, cells 8, periodic; c = 1e100; initial u = sin(x); time 0 .. "
      "2, step 1/8 }\ndataset truths : truth { frames every 1/4; file \"truth.nc\" }\n";
  const std::string rest = " on trajectories(\"truth.nc\") for 16 steps beside lost";
  const Json json = made(text + untrained_with_spectra("unknown c from 0", "2",
                                                       "correlation w = u" + rest + "; spectrum s = u" + rest))
                        .json();
  EXPECT_EQ(json["correlation"]["w"]["beside"]["lost"]["course"][1], 0.0);
  EXPECT_LT(json["correlation"]["w"]["beside"]["lost"]["time"]["mean"].get<double>(), 0.25);
  EXPECT_EQ(json["spectrum"]["s"]["beside"]["lost"]["distance"]["mean"], "inf");
  EXPECT_EQ(json["spectrum"]["s"]["distance"]["mean"], 0.0);
}

// ---- cost of a training ---------------------------------------------------------------------------------------------

const std::string burgers_spectrum_text = R"(
model burgers { field u; param nu; param a; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain { grid x = 0 .. 2*pi, cells 64, periodic; nu = 0.3; a = 1; initial u = a*sin(x) + 0.3*cos(2*x); time 0 .. 2, step 1/64 }
scene middle : burgers with plain { grid x = 0 .. 2*pi, cells 32, periodic; nu = 0.3; a = 1; initial u = a*sin(x); time 0 .. 2, step 1/32 }
scene coarse : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; initial u = a*sin(x); time 0 .. 2, step 1/16 }
dataset truths : fine { runs 2; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4; file "truth.nc" }
dataset finer : fine { runs 2; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 2; file "finer.nc" }
network corrector(u) { initial he, seed 5; conv 4, 5; tanh; conv out, 5, gain = 0.01 }
scene hybrid : burgers with plain { grid x = 0 .. 2*pi, cells 16, periodic; nu = 0.3; a = 1; initial u = a*sin(x); time 0 .. 2, step 1/16; after step: u += corrector(u) }
task t : hybrid { data r = trajectories("truth.nc", u); learn corrector; minimise mean((u - r)^2) over 2 steps; using adam(rate = 1e-2), batch 8, epochs 4, trials 2
  test err = mean(abs(u - r)) on trajectories("truth.nc") for 32 steps beside coarse, middle on trajectories("finer.nc") }
)";

TEST_F(Spectra, ATrainingIsEarnedByWhatItsRunsSave) {
  write("t.dpde", burgers_spectrum_text);
  ASSERT_EQ(dpde("run t.dpde finer --out . --json").status, 0);
  const Json made_data = dpde("run t.dpde truths --out . --json").json();
  const Outcome outcome = dpde("optimize t.dpde t --beside-named-only --out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const Json test = outcome.json()["test"]["err"], even = test["break_even"];
  EXPECT_EQ(even["data_s"], made_data["cpu_s"]);
  EXPECT_GT(even["training_s"].get<double>(), 0);
  EXPECT_EQ(even["length"], 2.0);
  if (test["equal_error"].is_null()) {
    EXPECT_TRUE(even["runs"].is_null());
    EXPECT_EQ(even["never"], false);
  } else {
    const double saved = 2 * (test["equal_error"]["cost_s"].get<double>() - test["cost_s"].get<double>());
    EXPECT_EQ(even["never"], !(saved > 0));
    if (saved > 0) {
      EXPECT_EQ(even["runs"].get<double>(),
                std::ceil((even["data_s"].get<double>() + even["training_s"].get<double>()) / saved));
    }
  }
  // Its time is stored for a resumed training, and files of other data are rejected.
  const Json again =
      dpde("optimize t.dpde t --beside-named-only --out o --resume --json").json()["test"]["err"]["break_even"];
  EXPECT_EQ(again["training_s"], even["training_s"]);
  std::string cost = content(path("truth.nc.cost"));
  cost[5] = cost[5] == '0' ? '1' : '0';
  write("truth.nc.cost", cost);
  EXPECT_TRUE(
      dpde("optimize t.dpde t --beside-named-only --json").json()["test"]["err"]["break_even"]["data_s"].is_null());
}

TEST_F(Spectra, TrialsThatAreNotWantedAreKept) {
  write("t.dpde", burgers_spectrum_text);
  for (const char* set : {"finer", "truths"})
    ASSERT_EQ(dpde(std::string("run t.dpde ") + set + " --out . --json").status, 0);
  const Json both = dpde("optimize t.dpde t --beside-named-only --out o --json").json();
  std::string text = burgers_spectrum_text;
  text.replace(text.find("trials 2"), 8, "trials 1");
  write("one.dpde", text);
  const Outcome one = dpde("optimize one.dpde t --beside-named-only --out o --resume");
  EXPECT_NE(one.out.find("goes on after 32 updates, with all 4 epochs made\n"), std::string::npos) << one.out;
  text.replace(text.find("epochs 4"), 8, "epochs 5");
  write("more.dpde", text);
  EXPECT_EQ(dpde("optimize more.dpde t --beside-named-only --out o --resume --json").json()["iterations"], 40);
  const Outcome again = dpde("optimize t.dpde t --beside-named-only --out o --resume --epochs 5 --json");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(again.json()["resumed_iterations"], 40 + 32);
  auto losses = again.json()["trials"][1]["loss"].get<std::vector<double>>();
  losses.resize(32);
  EXPECT_EQ(losses, both["trials"][1]["loss"]);
}

TEST_F(Spectra, ChecksLookAtTheScenesBeside) {
  write("t.dpde", burgers_spectrum_text);
  for (const char* set : {"finer", "truths"})
    ASSERT_EQ(dpde(std::string("run t.dpde ") + set + " --out . --json").status, 0);
  EXPECT_EQ(dpde("check t.dpde t --json").status, 0);
  std::string text = burgers_spectrum_text;
  text.replace(text.find("middle on trajectories(\"finer.nc\")"), 34, "heated");
  write("u.dpde", text +
                      "model heat { field w; dt(w) = lap(w) }\nscene heated : heat { grid x = 0 .. 2*pi, cells 16, "
                      "periodic; initial w = 0; time 0 .. 1, step 1/16 }\n");
  const Outcome other = dpde("check u.dpde --all t");
  EXPECT_EQ(other.status, 2) << other.out;
  EXPECT_NE(other.err.find("scene heated, beside a test"), std::string::npos) << other.err;
  text = burgers_spectrum_text;
  text.replace(text.find("middle on trajectories(\"finer.nc\")"), 34, "middle");
  write("v.dpde", text);
  const Outcome grid = dpde("check v.dpde --all t");
  EXPECT_EQ(grid.status, 2) << grid.out;
  EXPECT_NE(grid.err.find("it is of another grid: u has 16 cells along x, the scene has 32"), std::string::npos)
      << grid.err;
}

TEST_F(Spectra, StatisticsOfNothingHaveNoPercentage) {
  const std::string text =
      "model m { field u; param c; dt(u) = c }\nscheme plain { time = euler }\nscene truth : m with plain { grid x = 0 "
      ".. 1, cells 3, periodic; c = 0; initial u = 0; time 0 .. 2, step 1/8 }\n"
      "scene tried : m with plain { grid x = 0 .. 1, cells 3, periodic; c = 0; initial u = 0; time 0 .. 2, step 1/8 "
      "}\ndataset truths : truth { frames every 1; file \"truth.nc\" }\n";
  const std::string test = untrained_with_spectra(
      "unknown c from 0.25", "8", "statistic level = mean(u) on trajectories(\"truth.nc\") for 16 steps");
  const Outcome words = made(text + test, "");
  EXPECT_NE(
      words.out.find("  tried: mean 0.375 (+0.38 more), deviation 0.1768 (+0.18 more); the data of truth.nc: 0, 0\n"),
      std::string::npos)
      << words.out;
  const Json level = dpde("optimize t.dpde t --beside-named-only --json").json()["statistic"]["level"];
  EXPECT_TRUE(level["mean_difference"].is_null());
  EXPECT_TRUE(level["deviation_difference"].is_null());
}

// ---- residuals of data sets -----------------------------------------------------------------------------------------

/// Unmodified stored frames equal the scene's own steps, bit for bit: also with events, controls and multistep schemes.
TEST_F(Spectra, FramesOfTheSceneItselfHaveNoResidual) {
  for (const auto& [time, events] :
       {std::pair<std::string, std::string>{"rk4", "every 1/4: v = 0.5*v; after step: u += 0.01*cos(x + t)"},
        {"ab2", ""}}) {
    write("t.dpde",
          "model m { field u; field v; control f; param a; dt(u) = -u*dx(u) + 0.1*lap(u) + f; dt(v) = u - v }\nscheme "
          "plain { time = " +
              time +
              " }\n"
              "scene truth : m with plain { grid x = 0 .. 2*pi, cells 16, periodic; a = 1; f = sin(t) every 1/16; "
              "initial u = a*sin(x); initial v = 0; time 1 .. 3, step 1/32\n" +
              events +
              " }\ndataset truths : truth { runs 3; vary a in 0.2 .. 0.5; frames every 3/32 from 1 + 1/16 to 2.5; file "
              "\"truth.nc\" }\n");
    const Outcome outcome = dpde("run t.dpde truths --out . --json");
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    for (const char* field : {"u", "v"}) {
      EXPECT_EQ(outcome.json()["residuals"][field]["relative"], 0.0) << time << field;
      EXPECT_EQ(outcome.json()["residuals"][field]["rate"], 0.0) << time << field;
    }
    NetcdfFile file(path("truth.nc").string());
    EXPECT_EQ(file.dimensions("u_residual"), std::vector<std::string>{"run"});
    EXPECT_EQ(file.values("u_relative_residual"), (std::vector<double>{0, 0, 0}));
  }
}

/// A sine is an eigenvector on both grids; its averages are a sine.
TEST_F(Spectra, WhatCoarseningTakesAwayIsTheResidual) {
  write("t.dpde",
        "model heat { field u; param nu; param a; dt(u) = nu*lap(u) }\nscheme plain { time = euler }\n"
        "scene truth : heat with plain { grid x = 0 .. 2*pi, cells 32, periodic; nu = 0.1; a = 1; initial u = "
        "a*sin(3*x); time 0 .. 2, step 1/32 }\n"
        "dataset truths : truth { runs 2; vary a from 1; frames every 1/8 from 1/4 to 1; coarsen 4; file \"truth.nc\" "
        "}\n");
  const Outcome outcome = dpde("run t.dpde truths --out . --json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  const double fine = std::pow(1 + factor(0.1, 32, 3) / 32, 4),
               coarse = std::pow(1 + factor(0.1, 8, 3) / 32, 4);  // over an interval of 4 steps
  const double relative = std::abs(coarse - fine) / std::abs(fine - 1);
  NetcdfFile file(path("truth.nc").string());
  const std::vector<double> found = file.values("u_relative_residual"), rates = file.values("u_residual");
  ASSERT_EQ(found.size(), 2U);
  // Averages over 4 of 32 cells: the sine times sin(4*d)/(4*sin(d)), d half the angle between cells.
  const double d = 3 * M_PI / 32, mean = std::sin(4 * d) / (4 * std::sin(d));
  double squares = 0;
  for (int k = 0; k < 6; ++k) squares += std::pow(fine, 2 * (2 + k)) / 6 / 2;
  for (int run = 0; run < 2; ++run) {
    EXPECT_NEAR(found[static_cast<std::size_t>(run)], relative, 1e-11 * relative);
    EXPECT_NEAR(rates[static_cast<std::size_t>(run)],
                (run + 1) * mean * std::sqrt(squares) * std::abs(coarse - fine) * 8, 1e-11);
  }
  EXPECT_NEAR(outcome.json()["residuals"]["u"]["relative"].get<double>(), relative, 1e-11 * relative);
  const Outcome words = dpde("run t.dpde truths --out .");
  EXPECT_NE(words.out.find("u: the scene's steps from a frame miss the next one by at most "), std::string::npos)
      << words.out;
}

TEST_F(Spectra, WithoutASceneOnTheGridOfTheFramesThereIsNoResidual) {
  write("t.dpde",
        "model heat { field u; param nu; param a; dt(u) = nu*lap(u) }\nscheme plain { time = euler }\n"
        "scene start : heat with plain { grid x = 0 .. 2*pi, cells 32, periodic; nu = 0.1; a = 1; initial u = "
        "a*sin(x); time 0 .. 1, step 1/32 }\n"
        "scene truth : heat with plain { grid x = 0 .. 2*pi, cells 32, periodic; nu = 0.1; a = 1; initial u = "
        "load(\"start.nc\", u); time 0 .. 1, step 1/32 }\n"
        "dataset truths : truth { frames every 1/8; coarsen 4; file \"truth.nc\" }\n");
  ASSERT_EQ(dpde("run t.dpde start --out . --json").status, 0);
  const Outcome outcome = dpde("run t.dpde truths --out . --json");
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
  EXPECT_TRUE(outcome.json()["residuals"]["u"].is_null());
  EXPECT_EQ(content(path("truth.nc")).find("u_residual"), std::string::npos);
}

}  // namespace
}  // namespace dpde::testing
