// SPDX-License-Identifier: Apache-2.0
// dpde gradient, optimize, verify and bench.
#include <cmath>
#include <numbers>
#include <tuple>

#include "command_support.h"
#include "dpde/runtime/npy.h"

namespace dpde::testing {
namespace {

const double h = 2 * std::numbers::pi / 16;
const double rate = 4.0 / 8 / (h * h) * std::sin(h / 2) * std::sin(h / 2);  // factor of a step: 1 - rate*k

using GradientCommand = Command;

TEST_F(GradientCommand, IsTheClosedForm) {
  write("rod.dpde", rod_text);
  const Outcome run = dpde("gradient rod.dpde find --json");
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  const double factor = 1 - rate * 0.25;
  EXPECT_NEAR(json["loss"], std::pow(factor, 16) / 2, 1e-15);
  EXPECT_NEAR(json["gradient"]["k"]["value"], -8 * rate * std::pow(factor, 15), 1e-14);
  EXPECT_NEAR(json["gradient"]["k"]["norm"], 8 * rate * std::pow(factor, 15), 1e-14);
  EXPECT_EQ(json["checkpoints"]["recomputed_steps"], 0);
  EXPECT_GT(json["ratio"], 0);
}

TEST_F(GradientCommand, IsTheSameWithLittleMemory) {
  write("rod.dpde", rod_text);
  const Json all = dpde("gradient rod.dpde find --json").json();
  const Outcome run = dpde("gradient rod.dpde find --json --memory 2K");
  ASSERT_EQ(run.status, 0) << run.err;
  const Json few = run.json();
  EXPECT_EQ(few["gradient"], all["gradient"]);
  EXPECT_GT(few["checkpoints"]["recomputed_steps"], 0);
  EXPECT_LT(few["checkpoints"]["bytes"], all["checkpoints"]["bytes"]);
}

TEST_F(GradientCommand, IsTheSameWithCheckpointsInAFile) {
  write("rod.dpde", rod_text);
  fs::create_directories(path("disk"));
  const Json in_memory = dpde("gradient rod.dpde find --json").json();
  for (const std::string memory : {"", " --memory 2K"}) {
    const Outcome run = dpde("gradient rod.dpde find --json --checkpoints-in disk" + memory);
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.json()["gradient"], in_memory["gradient"]);
    EXPECT_TRUE(fs::is_empty(path("disk")));
  }
  const Outcome nowhere = dpde("gradient rod.dpde find --json --checkpoints-in none");
  EXPECT_EQ(nowhere.status, 3);
  EXPECT_NE(nowhere.err.find("the folder none cannot hold checkpoints"), std::string::npos) << nowhere.err;
  if (fs::exists("/dev/full")) {
    EXPECT_EQ(dpde("gradient rod.dpde find --json --checkpoints-in /dev/full").status, 3);
  }
}

TEST_F(GradientCommand, ReachesAParameterThroughTheInitialState) {
  std::string text = rod_text;
  text.replace(text.find("initial u = sin(x)"), 18, "initial u = k*sin(x)");
  write("rod.dpde", text);
  const Outcome run = dpde("gradient rod.dpde find --json");
  ASSERT_EQ(run.status, 0) << run.err;
  const double k = 0.25, factor = 1 - rate * k;  // loss = k^2 factor^16 / 2
  EXPECT_NEAR(run.json()["gradient"]["k"]["value"], k * std::pow(factor, 16) - 8 * rate * k * k * std::pow(factor, 15),
              1e-14);
}

TEST_F(GradientCommand, SumsAndMeansOverTime) {
  for (const auto& [loss, weight] : {std::pair{"mean(u^2)", 1.0 / 9}, std::pair{"sum(u^2)", 16.0},
                                     std::pair{"integral(u^2)", 2 * std::numbers::pi / 8}}) {
    std::string text = rod_text;
    text.replace(text.find("mean(u^2) at t = 1"), 18, std::string(loss) + " over time\n  minimise k");
    write("rod.dpde", text);
    const Outcome run = dpde("gradient rod.dpde find --json");
    ASSERT_EQ(run.status, 0) << run.err;
    const double ends = std::string(loss).starts_with("integral") ? 0.5 : 1;
    double sum = 0;
    for (int n = 0; n <= 8; ++n) sum += (n % 8 == 0 ? ends : 1) * std::pow(1 - rate * 0.25, 2 * n) / 2;
    EXPECT_NEAR(run.json()["loss"], weight * sum + 0.25, 1e-13) << loss;
  }
}

/// The line determines how states are counted, for any kind of number.
TEST_F(GradientCommand, CountsStatesAsTheLineSays) {
  const double pi = std::numbers::pi;
  for (const auto& [loss, power, weight] :
       {std::tuple{"mean(u^2), sum over time", 1, 1.0}, std::tuple{"sum(u^2), mean over time", 1, 16.0 / 9},
        std::tuple{"-mean(u^2), integral over time", 1, -1.0 / 8},
        std::tuple{"3*integral(u^2)^2, sum over time", 2, 3 * 4 * pi * pi},
        std::tuple{"exp(2*log(mean(u^2))), mean over time", 2, 1.0 / 9}}) {
    std::string text = rod_text;
    text.replace(text.find("mean(u^2) at t = 1"), 18, loss);
    write("rod.dpde", text);
    const Outcome run = dpde("gradient rod.dpde find --json");
    ASSERT_EQ(run.status, 0) << run.err;
    const double ends = std::string(loss).ends_with("integral over time") ? 0.5 : 1;
    double sum = 0;
    for (int n = 0; n <= 8; ++n) sum += (n % 8 == 0 ? ends : 1) * std::pow(std::pow(1 - rate * 0.25, 2 * n) / 2, power);
    EXPECT_NEAR(run.json()["loss"], weight * sum, 1e-12) << loss;
  }
}

/// Trapezoidal rule: exact for functions linear in t, and of order 2, wherever the run begins.
TEST_F(GradientCommand, IntegratesOverTime) {
  const auto loss = [&](const std::string& rate, const std::string& time, const std::string& integrand) {
    write("line.dpde", "model m { field u; param k = 1; dt(u) = " + rate + " }\nscheme r { time = rk4 }\n" +
                           "scene s : m with r { initial u = 1; time " + time + " }\n" +
                           "task t : s { unknown k; unknown initial u; minimise " + integrand +
                           ", integral over time }\n");
    const Outcome run = dpde("gradient line.dpde t --json");
    EXPECT_EQ(run.status, 0) << run.err;
    return run.json()["loss"].get<double>();
  };
  for (const char* time : {"0 .. 1, step 0.1", "0 .. 1, step 1", "2 .. 3, step 1/3"})
    EXPECT_NEAR(loss("0*k", time, "u"), 1, 1e-14) << time;
  EXPECT_NEAR(loss("k", "0 .. 1, step 0.1", "u"), 1.5, 1e-14);
  EXPECT_NEAR(loss("k", "0 .. 1, step 0.1", "2*mean(u)"), 3, 1e-14);
  EXPECT_NEAR(loss("-k*u", "0 .. 1, step 0.1", "u"), 1 - std::exp(-1), 1e-3);
}

/// The weights of weno have derivatives of seeds over 1e-30 there, which f32 does not hold.
TEST_F(GradientCommand, BeyondSinglePrecisionSaysSo) {
  write("large.dpde",
        "model m { field u; dt(u) = -advect(1, u) }\nscheme w { advect = weno(5); time = ssp_rk3; real = f32 }\n"
        "scene s : m with w { grid x = 0 .. 1, cells 32, periodic; initial u = 1e30*sin(2*pi*x)\n"
        "  time 0 .. 0.1, step 0.01 }\ntask t : s { unknown initial u; minimise mean(u) }\n");
  const Outcome run = dpde("gradient large.dpde t");
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("a derivative leaves the range of f32: --set real=f64"), std::string::npos) << run.err;
  EXPECT_EQ(dpde("gradient large.dpde t --set real=f64").status, 0);
}

TEST_F(GradientCommand, OfALossThatIsNotFiniteFails) {
  write("grow.dpde",
        "model m {\n  field u\n  param k\n  dt(u) = k*u^3\n}\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  k "
        "= 2\n"
        "  initial u = 1 + x\n  time 0 .. 4, step 1/8\n}\ntask t : s {\n  unknown k from 2\n  minimise mean(u^2)\n}\n");
  const Outcome run = dpde("gradient grow.dpde t --json");
  EXPECT_EQ(run.status, 1);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0803"});
  EXPECT_TRUE(run.json()["loss"].is_string()) << run.out;
  EXPECT_NE(dpde("gradient grow.dpde t").err.find("grow.dpde:14:3: error[E0803]"), std::string::npos);
  EXPECT_EQ(dpde("optimize grow.dpde t --json").status, 1);
  EXPECT_NE(dpde("optimize grow.dpde t").err.find("grow.dpde:14:3: error[E0803]"), std::string::npos);
}

using OptimizeCommand = Command;

const char* recover_text = R"(model heat {
  field u
  param k
  dt(u) = k*lap(u)
}
scene rod : heat {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  initial u = sin(x) + cos(2*x)
  time 0 .. 1, step 1/8
}
task find : rod {
  data target = u from scene rod at t = 1
  unknown k from 0.1
  minimise mean((u - target)^2) at t = 1
  using lbfgs(), iterations 30
}
task start : rod {
  data target = u from scene rod at t = 0.5
  unknown initial u from 0
  minimise mean((u - target)^2) at t = 0.5
  using adam(rate = 0.05), iterations 40
  test off = mean(abs(u - target)) at t = 0.5
}
)";

TEST_F(OptimizeCommand, FindsTheParameterOfTheData) {
  write("rod.dpde", recover_text);
  const Outcome run = dpde("optimize rod.dpde find --json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NEAR(run.json()["unknowns"]["k"]["value"], 0.3, 1e-7);
  EXPECT_LT(run.json()["loss"].back(), 1e-14);
}

TEST_F(OptimizeCommand, WritesLossesUnknownsAndTests) {
  write("rod.dpde", recover_text);
  const Outcome run = dpde("optimize rod.dpde start --json --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  ASSERT_EQ(json["loss"].size(), 41u);
  EXPECT_LT(json["loss"].back(), 0.01 * json["loss"].front().get<double>());
  EXPECT_EQ(json["iterations"], 40);
  EXPECT_GT(json["test"]["off"], 0);
  EXPECT_TRUE(fs::exists(path("o/u_initial.npy")));
  std::istringstream table(content(path("o/loss.csv")));
  std::string line;
  int lines = 0;
  while (std::getline(table, line)) ++lines;
  EXPECT_EQ(lines, 42);
}

TEST_F(OptimizeCommand, ResumesToTheSameResult) {
  write("rod.dpde", recover_text);
  for (const std::string task : {"find", "start"}) {
    const Json whole = dpde("optimize rod.dpde " + task + " --json --iterations 9 --out whole" + task).json();
    ASSERT_EQ(dpde("optimize rod.dpde " + task + " --json --iterations 4 --out cut" + task).status, 0);
    // A process killed while writing leaves half a record.
    const fs::path log = path("cut" + task + "/optimiser.log");
    fs::resize_file(log, fs::file_size(log) - 5);
    const Outcome resumed = dpde("optimize rod.dpde " + task + " --json --iterations 9 --resume --out cut" + task);
    ASSERT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_EQ(resumed.json()["loss"], whole["loss"]);
    EXPECT_EQ(resumed.json()["unknowns"], whole["unknowns"]);
    EXPECT_GE(resumed.json()["resumed_evaluations"], 4);
    EXPECT_LT(resumed.json()["resumed_evaluations"], resumed.json()["evaluations"]);
  }
  EXPECT_EQ(dpde("optimize rod.dpde find --resume --out cutstart").status, 2);
  EXPECT_EQ(dpde("optimize rod.dpde find --resume").status, 2);
}

using VerifyCommand = Command;

TEST_F(VerifyCommand, CertifiesScenesTasksAndPrograms) {
  write("rod.dpde", recover_text);
  ASSERT_EQ(dpde("emit rod.dpde rod --stage adjoint -o adjoint.dpde").status, 0);
  for (const std::string what : {"rod.dpde rod", "rod.dpde find", "rod.dpde start", "adjoint.dpde"}) {
    const Outcome verify = dpde("verify " + what + " --json");
    ASSERT_EQ(verify.status, 0) << what << verify.err;
    const Json json = verify.json();
    EXPECT_EQ(json["passed"], true);
    EXPECT_LE(json["dot_product"]["max_relative_error"], 1e-11) << what;
    EXPECT_GE(json["dot_product"]["cases"], 8) << what;
    EXPECT_NEAR(json["taylor"]["slope"], 2.0, 0.05) << what;
  }
}

using BenchCommand = Command;

TEST_F(BenchCommand, HasTheKeysOfTheContract) {
  write("rod.dpde", rod_text);
  const Outcome bench = dpde("bench rod.dpde rod --json --repeats 3 --threads 1");
  ASSERT_EQ(bench.status, 0) << bench.err;
  const Json json = bench.json();
  for (const char* key : {"points_per_s", "bytes_per_point", "achieved_bytes_per_s", "stream_bytes_per_s",
                          "roofline_fraction", "adjoint_ratio", "compile_s"}) {
    EXPECT_GT(json[key], 0) << key;
  }
  EXPECT_EQ(json["bytes_per_point"], 16);
}

TEST_F(BenchCommand, SaysWhatBytesPredictOfTheAdjoint) {
  write("b.dpde",
        "model m { field u; dt(u) = -u*dx(u) }\nscheme s { time = euler }\nscene b : m with s {\n  grid x = 0 .. 1, "
        "cells 32, periodic\n  initial u = 1\n  time 0 .. 1, step 1/64\n}\n");
  const Outcome bench = dpde("bench b.dpde --repeats 1 --threads 1");
  ASSERT_EQ(bench.status, 0) << bench.err;
  EXPECT_NE(bench.out.find("(1.50 times the bytes)"), std::string::npos)
      << bench.out;  // u, u_next_bar and u_bar over u and u_next
}

/// Without a name: all tasks of the file.
TEST_F(VerifyCommand, CertifiesAllTasksOfAFile) {
  write("two.dpde",
        "model m { field u; param k = 1; dt(u) = -k*u }\n"
        "scene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = x; time 0 .. 1, step 1/4 }\n"
        "task a : s { unknown k; minimise mean(u^2) }\ntask b : s { unknown initial u; minimise mean(u^4) }\n");
  const Outcome verified = dpde("verify two.dpde --json"), checked = dpde("check two.dpde --json");
  ASSERT_EQ(verified.status, 0) << verified.err;
  ASSERT_EQ(checked.status, 0) << checked.err;
  for (const char* task : {"a", "b"}) {
    EXPECT_EQ(verified.json()["tasks"][task]["passed"], true);
    EXPECT_TRUE(checked.json()["tasks"].contains(task));
  }
  EXPECT_EQ(dpde("verify two.dpde b --json").json()["passed"], true);
}

/// Data for a scene without a grid, and for numbers of a scene with one: both accept the same shapes.
TEST_F(GradientCommand, DataOfNumbersMayHaveAnAxisOfOne) {
  write("d.dpde", R"(model d { field u; param k = 1; dt(u) = -k*u }
scene s : d { initial u = 1; time 0 .. 2, step 0.1 }
task t : s { data seen = load("seen.npy") at t = 0, 1, 2; unknown k; minimise (u - seen)^2 at t = 0, 1, 2; using lbfgs() }
)");
  const std::vector<double> seen{1, 0.5, 0.25};
  std::string first;
  for (const std::vector<std::int64_t>& shape : std::vector<std::vector<std::int64_t>>{{3}, {3, 1}, {3, 1, 1}}) {
    write_npy(path("seen.npy"), shape, seen);
    EXPECT_EQ(dpde("check d.dpde --all").status, 0);
    const Outcome gradient = dpde("gradient d.dpde t --json");
    ASSERT_EQ(gradient.status, 0) << gradient.err;
    const std::string loss = gradient.json()["loss"].dump();
    if (first.empty()) first = loss;
    EXPECT_EQ(loss, first);
  }
  for (const std::vector<std::int64_t>& shape : std::vector<std::vector<std::int64_t>>{{2}, {4}, {3, 2}}) {
    std::int64_t size = 1;
    for (const std::int64_t n : shape) size *= n;
    write_npy(path("seen.npy"), shape, std::vector<double>(static_cast<std::size_t>(size), 1.0));
    for (const char* verb : {"check d.dpde", "gradient d.dpde t"})
      EXPECT_EQ(dpde(verb + std::string(" --json")).codes(), std::vector<std::string>{"E0905"}) << verb;
  }
}

}  // namespace
}  // namespace dpde::testing
