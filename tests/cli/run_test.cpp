// SPDX-License-Identifier: Apache-2.0
// dpde run and check: numbers against closed forms, files, messages, interruption.
#include <cmath>
#include <cstring>
#include <numbers>

#include "command_support.h"

namespace dpde::testing {
namespace {

/// Values of a float64 .npy file.
std::vector<double> values_of(const fs::path& path) {
  const std::string bytes = content(path);
  if (bytes.size() < 10) return {};
  const std::size_t header = 10 + static_cast<unsigned char>(bytes[8]) + 256 * static_cast<unsigned char>(bytes[9]);
  std::vector<double> values((bytes.size() - header) / 8);
  std::memcpy(values.data(), bytes.data() + header, values.size() * 8);
  return values;
}

double rod_factor(double k) {
  const double h = 2 * std::numbers::pi / 16, s = std::sin(h / 2);
  return 1 - 4 * k / 8 / (h * h) * s * s;
}

using RunCommand = Command;

TEST_F(RunCommand, StepsToTheClosedFormWithEveryBackEnd) {
  write("rod.dpde", rod_text);
  for (const std::string backend : {"jit", "cpp", "interpreter"}) {
    const Outcome run = dpde("run rod.dpde --json --out " + backend + " --backend " + backend);
    ASSERT_EQ(run.status, 0) << run.err;
    const std::vector<double> u = values_of(path(backend + "/u.npy"));
    ASSERT_EQ(u.size(), 16u);
    for (int i = 0; i < 16; ++i) {
      EXPECT_NEAR(u[i], std::pow(rod_factor(0.3), 8) * std::sin((i + 0.5) * std::numbers::pi / 8), 1e-14)
          << backend << i;
    }
  }
}

TEST_F(RunCommand, PrintsOneObjectWithTheKeysOfTheContract) {
  write("rod.dpde", rod_text);
  const Outcome run = dpde("run rod.dpde rod --json");
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  EXPECT_EQ(json["scene"], "rod");
  EXPECT_EQ(json["cells"], Json({16}));
  EXPECT_EQ(json["steps"], 8);
  EXPECT_EQ(json["time"], 1.0);
  EXPECT_GT(json["wall_s"], 0);
  EXPECT_GT(json["compile_s"], 0);
  EXPECT_GT(json["points_per_s"], 0);
  EXPECT_TRUE(json["files"].empty());
  const double size = std::pow(rod_factor(0.3), 16) / 2;
  EXPECT_NEAR(json["observables"]["size"], size, 1e-15);
  const double off = std::abs(std::pow(rod_factor(0.3), 8) - std::exp(-0.3));
  EXPECT_NEAR(json["error"]["u"]["l2"], off / std::sqrt(2), 1e-14);
  EXPECT_NEAR(json["error"]["u"]["linf"], off * std::cos(std::numbers::pi / 16), 1e-14);
  EXPECT_EQ(run.err, "");
}

TEST_F(RunCommand, SaysWhatIsDoneBeforeTheFirstStep) {
  write("rod.dpde", rod_text);
  const std::string told = dpde("run rod.dpde rod --no-cache --progress").err;
  const std::size_t before = told.find("how long a step may be"), behind = told.find("step 1 of");
  EXPECT_NE(before, std::string::npos) << told;
  EXPECT_TRUE(behind == std::string::npos || before < behind) << told;
}

TEST_F(RunCommand, RecordsOnTheWay) {
  write("rod.dpde", rod_text);
  const Outcome run = dpde("run rod.dpde --json --every 4 --out o");
  ASSERT_EQ(run.status, 0) << run.err;
  const Json series = run.json()["observables"]["size"];
  ASSERT_EQ(series.size(), 3u);
  EXPECT_NEAR(series[0], 0.5, 1e-15);
  EXPECT_NEAR(series[1], std::pow(rod_factor(0.3), 8) / 2, 1e-15);
  EXPECT_EQ(values_of(path("o/u_over_time.npy")).size(), 48u);
  EXPECT_EQ(content(path("o/observables.csv")).substr(0, 12), "step,t,size\n");
}

TEST_F(RunCommand, WritesAPictureWhereThereIsGnuplot) {
  ASSERT_EQ(std::system("gnuplot --version >/dev/null 2>&1"), 0) << "tools/setup installs gnuplot";
  write("rod.dpde", rod_text);
  ASSERT_EQ(dpde("run rod.dpde --quiet --out o").status, 0);
  EXPECT_EQ(content(path("o/rod.png")).substr(1, 3), "PNG");
  EXPECT_NE(content(path("o/rod.svg")).find("</svg>"), std::string::npos);
}

TEST_F(RunCommand, ShowsACurve) {
  write("rod.dpde", rod_text);
  const Outcome run = shell("LC_ALL=C $DPDE run rod.dpde");
  EXPECT_EQ(run.status, 0);
  EXPECT_NE(run.out.find("rod: 16 cells, 8 steps to t = 1"), std::string::npos);
  EXPECT_NE(run.out.find('*'), std::string::npos);
  EXPECT_EQ(dpde("run rod.dpde --quiet").out, "");
}

TEST_F(RunCommand, NamesStepFieldCellAndLineOfABlowUp) {
  write("grow.dpde",
        "model m {\n  field u\n  dt(u) = u^3\n}\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  initial u = 1 "
        "+ x\n"
        "  time 0 .. 4, step 1/8\n}\n");
  const Outcome run = dpde("run grow.dpde --json --out o");
  EXPECT_EQ(run.status, 1);
  ASSERT_EQ(run.codes(), std::vector<std::string>{"E0801"});
  const Json diagnostic = run.json()["diagnostics"][0];
  EXPECT_EQ(diagnostic["line"], 3);
  const std::string message = diagnostic["message"];
  // The largest value grows first: the last cell, centre 0.875.
  EXPECT_NE(message.find("u is no longer finite after step"), std::string::npos) << message;
  EXPECT_NE(message.find("first in cell (3) at x = 0.875"), std::string::npos) << message;
  EXPECT_NE(run.err.find("  dt(u) = u^3\n"), std::string::npos) << run.err;
  for (const double value : values_of(path("o/u.npy"))) EXPECT_TRUE(std::isfinite(value));
}

TEST_F(RunCommand, WarnsWhenARunHasGrownBeyondReason) {
  write("rod.dpde", rod_text);
  const Outcome run = dpde("run rod.dpde --set k=300 --force --json");
  EXPECT_EQ(run.status, 0);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"W0801"});
}

TEST_F(RunCommand, StopsAtCtrlCAndWritesWhatThereIs) {
  write("rod.dpde", rod_text);
  for (const std::string wait : {"0", "0.05", "0.5"}) {
    const std::string out = "o" + wait;
    const Outcome run = interrupted("run rod.dpde --set end=1e8 --json --checkpoint-every 1000 --out " + out, wait,
                                    out + "/rod.restart");
    EXPECT_EQ(run.status, by_ctrl_c) << run.err;
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0802"}) << run.err;
    EXPECT_EQ(values_of(path(out + "/u.npy")).size(), 16u);
  }
}

/// A closed terminal, and the signal that ends services: saved, and ended by the signal.
TEST_F(RunCommand, SavesAtOtherSignalsToo) {
  write("rod.dpde", rod_text);
  for (const auto& [signal, status] : {std::pair{"HUP", 129}, {"TERM", 143}}) {
    const std::string out = std::string("o") + signal;
    const Outcome run = shell("$DPDE run rod.dpde --set end=1e8 --json --checkpoint-every 1000 --out " + out +
                              " & run=$!; for i in $(seq 6000); do [ -s " + out +
                              "/rod.restart ] && break; sleep 0.01; done; kill -" + signal + " $run; wait $run");
    EXPECT_EQ(run.status, status) << run.err;
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0802"}) << run.err;
    EXPECT_EQ(values_of(path(out + "/u.npy")).size(), 16u);
  }
}

/// nohup, and background jobs of scripts.
TEST_F(RunCommand, LeavesSignalsThatAreIgnored) {
  write("rod.dpde", rod_text);
  for (const std::string signal : {"INT", "HUP"}) {
    const Outcome run = shell(
        "env --ignore-signal=" + signal + " $DPDE run rod.dpde --set end=2e4 --json --checkpoint-every 1000 --out o" +
        signal + " & run=$!; for i in $(seq 6000); do [ -s o" + signal +
        "/rod.restart ] && break; sleep 0.01; done; { grep -q '^State:.[^Z]' /proc/$run/status && kill -" + signal +
        " $run; } || { wait $run; exit 99; }; wait $run");
    EXPECT_NE(run.status, 99) << "the run was over before the signal: " << run.err;
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(run.json()["time"], 2e4);
  }
}

/// A shell loop ends if one of its programs ends by Ctrl-C. The signal goes to the loop's process group, as from a
/// terminal.
TEST_F(RunCommand, CtrlCEndsTheLoopOfAShell) {
  write("rod.dpde", rod_text);
  write("loop.sh",
        "for i in 1 2 3; do echo run $i; $DPDE run rod.dpde --set end=1e8 -q --checkpoint-every 1000 --out o; done\n");
  const Outcome loop = shell(
      "export DPDE; env --default-signal=INT setsid bash loop.sh & loop=$!; for i in $(seq 6000); do [ -s "
      "o/rod.restart ] && break; sleep 0.01; done; bash -c 'kill -INT -- -$0' $loop; wait $loop");
  EXPECT_EQ(loop.status, by_ctrl_c);
  EXPECT_EQ(loop.out, "run 1\n");
}

TEST_F(RunCommand, RefusesAStartThatIsNotFinite) {
  std::string text = rod_text;
  text.replace(text.find("initial u = sin(x)"), 18, "initial u = log(x-1)");
  write("rod.dpde", text);
  const Outcome run = dpde("run rod.dpde --json");
  EXPECT_EQ(run.status, 1);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0805"});
}

/// Equal numbers up to rounding for each instruction set; a processor without the requested set uses what it has.
TEST_F(RunCommand, CodeForFewerInstructions) {
  write("rod.dpde", rod_text);
  std::vector<double> first;
  for (const std::string isa : {"portable", "avx2", "avx512"}) {
    for (const std::string backend : {"jit", "cpp"}) {
      if (backend == "cpp" && isa != "portable") continue;  // each runs a compiler
      const std::string out = "o" + isa + backend;
      ASSERT_EQ(
          shell("DPDE_ISA=" + isa + " $DPDE run rod.dpde rod --quiet --backend " + backend + " --out " + out).status,
          0);
      const std::vector<double> values = values_of(path(out + "/u.npy"));
      if (first.empty()) first = values;
      ASSERT_EQ(values.size(), first.size());
      for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], first[i], 1e-14) << isa << backend;
    }
  }
  EXPECT_NE(shell("DPDE_ISA=portable $DPDE --version").out.find(", portable\n"), std::string::npos);
  const Outcome unknown = shell("DPDE_ISA=AVX2 $DPDE run rod.dpde rod --quiet");
  EXPECT_EQ(unknown.status, 2);
  EXPECT_NE(unknown.err.find("set it to portable, avx2 or avx512"), std::string::npos) << unknown.err;
}

/// u.npy belongs to the last scene; that of another is stored under its scene's name.
TEST_F(RunCommand, ScenesShareAFolder) {
  write("two.dpde", R"(model m { field u; dt(u) = 0*u }
scene one : m { grid x = 0 .. 1, cells 4, periodic; initial u = 1; observe size = mean(u); time 0 .. 1, step 0.5 }
scene two : m { grid x = 0 .. 1, cells 4, periodic; initial u = 2; observe size = mean(u); time 0 .. 1, step 0.5 }
)");
  const auto first_of = [&](const std::string& file) { return values_of(path("o/" + file)).at(0); };
  for (const std::string scene : {"one", "two", "two"}) {
    const Outcome run = dpde("run two.dpde " + scene + " --every 1 --out o");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_EQ(first_of("u.npy"), scene == "one" ? 1 : 2);
  }
  EXPECT_EQ(first_of("one_u.npy"), 1);
  EXPECT_NE(content(path("o/one_observables.csv")), content(path("o/observables.csv")));
  const Outcome back = dpde("run two.dpde one --out o");
  EXPECT_NE(back.out.find("o/u.npy of two is two_u.npy now\n"), std::string::npos) << back.out;
  EXPECT_EQ(first_of("two_u.npy"), 2);
  EXPECT_EQ(first_of("u.npy"), 1);
}

/// Nothing is lost if two models have scenes of the same name; the same model under another name is one model.
TEST_F(RunCommand, ScenesOfOneNameShareAFolder) {
  const auto model_of = [](const std::string& value) {
    return "model m { field u; dt(u) = 0*u }\nscene s : m { grid x = 0 .. 1, cells 4, periodic; initial u = " + value +
           "; time 0 .. 1, step 0.5 }\n";
  };
  write("a.dpde", model_of("1"));
  write("b.dpde", model_of("2"));
  for (const std::string call : {"a.dpde s", "./a.dpde", "b.dpde s", "a.dpde", "b.dpde s"})
    ASSERT_EQ(dpde("run " + call + " --out o").status, 0) << call;
  const auto first_of = [&](const std::string& file) { return values_of(path("o/" + file)).at(0); };
  EXPECT_EQ(first_of("u.npy"), 2);
  EXPECT_EQ(first_of("s_u.npy"), 1);
  EXPECT_EQ(first_of("b_s_u.npy"), 2);
}

using CheckCommand = Command;

TEST_F(CheckCommand, CountsBytesOrdersAndMemory) {
  write("rod.dpde", rod_text);
  const Outcome check = dpde("check rod.dpde rod --json");
  ASSERT_EQ(check.status, 0) << check.err;
  const Json json = check.json();
  EXPECT_EQ(json["cost"]["bytes_per_point"], 16);  // u read, u_next written
  EXPECT_GE(json["cost"]["flops_per_point"], 4);
  EXPECT_LE(json["cost"]["flops_per_point"], 6);
  EXPECT_GT(json["cost"]["roofline_points_per_s"], 1e6);
  EXPECT_EQ(json["order"]["space"], 2);
  EXPECT_EQ(json["order"]["time"], 1);
  EXPECT_GT(json["memory_bytes"], 5 * 16 * 8);
  // h^2/(2 k)
  EXPECT_NEAR(json["stability"]["max_step"].get<double>(), std::pow(2 * std::numbers::pi / 16, 2) / 0.6, 1e-3);
  EXPECT_EQ(json["types"], Json({{"u", "state"}, {"k", "parameter"}}));
  EXPECT_TRUE(json["diagnostics"].empty());
}

/// The adjoint recomputes less of the first stage than the stage itself.
TEST_F(CheckCommand, KnowsAdjointsThatRecomputePartsOfStages) {
  write("two.dpde",
        "model m { field u, w; dt(u) = u^2; dt(w) = lap(w) }\nscheme e { time = rk2 }\nscene j : m with e {\n"
        "  grid x = 0 .. 1, cells 8, periodic\n  initial u = 0.1\n  initial w = x\n  time 0 .. 0.1, step 1/1000\n}\n");
  const Outcome check = dpde("check two.dpde j --json");
  EXPECT_EQ(check.status, 0) << check.err;
}

TEST_F(CheckCommand, SaysWhatAZeroCoefficientDrops) {
  std::string text = rod_text;
  text.replace(text.find("k = 0.3"), 7, "k = 0");
  text.replace(text.find("dt(u) = k*lap(u)"), 16, "dt(u) = k*lap(u) - u");
  write("rod.dpde", text);
  const Outcome check = dpde("check rod.dpde rod --json");
  ASSERT_EQ(check.status, 0) << check.err;
  EXPECT_EQ(check.json()["dropped"].size(), 1u) << check.out;
}

/// Computed by hand: the step reads u and writes u_next; in full it reads w too. The adjoint of the unknown is a number
/// times the seed; in full it reads u and w and writes w_bar, and needs u of each step.
TEST_F(CheckCommand, SaysWhatIsSaved) {
  const std::string text =
      "model m { field u; coefficient w; param c; dt(u) = -2*u + c*w*u }\n"
      "scheme e { time = euler }\n"
      "scene s : m with e { grid x = 0 .. 1, cells 8, periodic\n  c = 0\n  w = x\n  initial u = x\n  time 0 .. 1, step "
      "0.1 }\n"
      "task t : s { unknown initial u\n  minimise mean(u^2) }\n";
  write("m.dpde", text);
  Json saved = dpde("check m.dpde t --json").json()["saved"];
  EXPECT_EQ(saved, Json({{"step_bytes_per_point", 8}, {"adjoint_bytes_per_point", 24}, {"stored_bytes_per_point", 8}}));
  EXPECT_NE(dpde("check m.dpde --all t")
                .out.find("saved a cell: 8 of 24 bytes of a step, 24 of 40 bytes of an adjoint step, 8 of 8 bytes of "
                          "each state that a gradient stores\n"),
            std::string::npos);
  EXPECT_EQ(dpde("check m.dpde s --json").json()["saved"], Json({{"step_bytes_per_point", 8}}));
  saved = dpde("check m.dpde t --set c=1 --json").json()["saved"];
  EXPECT_EQ(saved["step_bytes_per_point"], 0);
  EXPECT_EQ(saved["stored_bytes_per_point"], 8);
  write("floor.dpde", std::string(text).replace(text.find("c*w*u"), 5, "floor(w)*u"));
  saved = dpde("check floor.dpde t --json").json()["saved"];
  EXPECT_GT(saved["adjoint_bytes_per_point"], 0) << "that by w is 0";
  EXPECT_EQ(saved["step_bytes_per_point"], 0);
  write("all.dpde", std::string(text).replace(text.find("unknown initial u"), 17,
                                              "unknown initial u; unknown w; unknown c from 2"));
  EXPECT_EQ(dpde("check all.dpde --all t").out.find("saved"), std::string::npos) << "nothing is left out";
}

TEST_F(CheckCommand, ShowsSeveralMistakesAtOnce) {
  std::string text = rod_text;
  text.replace(text.find("sin(x)"), 6, "sine(x)");
  text.replace(text.find("mean(u^2)"), 9, "mean(w^2)");
  write("rod.dpde", text);
  const Outcome check = dpde("check rod.dpde rod --json");
  EXPECT_EQ(check.status, 2);
  EXPECT_EQ(check.codes().size(), 2u) << check.err;
}

TEST_F(RunCommand, CellsOfEachAxis) {
  write("plate.dpde", R"(model heat { field u; dt(u) = 0.01*lap(u) }
scene plate : heat { grid x = 0 .. 1, cells 8, periodic; grid y = 0 .. 1, cells 8, periodic
  initial u = sin(2*pi*x); time 0 .. 0.1, step 0.01 }
)");
  EXPECT_EQ(dpde("run plate.dpde --set cells=6,10 --json").json()["cells"], Json::array({6, 10}));
  EXPECT_EQ(dpde("run plate.dpde --set cells=6,10 --set cells.x=7 --json").json()["cells"], Json::array({7, 10}));
  EXPECT_EQ(dpde("run plate.dpde --set 'cells=max(6, 4)' --json").json()["cells"], Json::array({6, 6}));
  for (const std::string wrong : {"6,10,4", "6,", ",", "6,-1", "6,x"})
    EXPECT_EQ(dpde("run plate.dpde --set cells=" + wrong).status, 2) << wrong;
}

/// On one cell: signs of numbers are reported.
TEST_F(RunCommand, NumbersHaveTheirSign) {
  write("d.dpde", R"(model d { field u; dt(u) = -u }
scene s : d { initial u = 1; time 0 .. 1, step 0.1 }
task t : s { unknown initial u from -43; minimise (u - 3)^2 at t = 1; using lbfgs() }
)");
  const Outcome told = dpde("gradient d.dpde t"), json = dpde("gradient d.dpde t --json");
  EXPECT_NE(told.out.find("d loss / d initial u = -"), std::string::npos) << told.out;
  EXPECT_LT(json.json()["gradient"]["u"]["value"].get<double>(), 0);
  const Outcome found = dpde("optimize d.dpde t --json");
  EXPECT_NEAR(found.json()["unknowns"]["u"]["value"].get<double>(), 3 * std::exp(1.0), 1e-3);
}

using CheckCommand = Command;

TEST_F(CheckCommand, TellsOrdersOfOperatorsAsStatedAndAsMeasured) {
  const auto text = [](const std::string& order) {
    return "operator slope(u) order " + order +
           " = (u[+1] - u[-1])/(2*hx)\noperator drift(u) order 4 = u[+1] - mean(u)\n"
           "model m { field u; dt(u) = slope(u) + slope(slope(u)) + drift(u) }\nscene s : m {\n  grid x = 0 .. 1, "
           "cells 8, periodic\n  initial u = x\n"
           "  time 0 .. 1, step 1/8\n}\n";
  };
  write("m.dpde", text("2"));
  const Outcome good = dpde("check m.dpde --json");
  ASSERT_EQ(good.status, 0) << good.err;
  EXPECT_EQ(good.json()["order"]["space"], 2);
  EXPECT_EQ(good.json()["operators"].dump(),
            R"([{"name":"slope","stated":2,"measured":2,"note":null},)"
            R"({"name":"drift","stated":4,"measured":null,"note":"not measured: it holds a reduction"}])");
  EXPECT_NE(dpde("check m.dpde --all")
                .out.find("operator slope: order 2 as stated and measured\noperator drift: order 4 as stated, not "
                          "measured: it holds a reduction\n"),
            std::string::npos);
  write("m.dpde", text("3"));
  const Outcome wrong = dpde("run m.dpde");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_NE(wrong.err.find(
                "m.dpde:1:10: error[E0557]: operator slope is stated to be of order 3, but its error goes as h^2\n"),
            std::string::npos)
      << wrong.err;
  EXPECT_NE(wrong.err.find("help: write order 2, or mend its weights (as fractions: 1/3, not 0.3333)"),
            std::string::npos)
      << wrong.err;
  write("m.dpde", text("1"));
  const Outcome modest = dpde("check m.dpde --json");
  EXPECT_EQ(modest.status, 0);
  EXPECT_EQ(modest.codes(), std::vector<std::string>{"W0501"});
}

/// As measured: coupled equations with different substeps are of order 1 (slow ones use the fast state at the beginning
/// of the step).
TEST_F(CheckCommand, OrderInTimeCountsStepsOfTheirOwn) {
  const auto order = [&](const std::string& rate_of_a, const std::string& rate_of_b, const std::string& parts) {
    write("two.dpde", "model m { field a, b; dt(a) = " + rate_of_a + "; dt(b) = " + rate_of_b +
                          " }\nscheme c { time = rk4 }\nscene s : m with c {\n  grid x = 0 .. 1, cells 4, periodic\n"
                          "  initial a = 1\n  initial b = 1\n  time 0 .. 1, step 0.1\n  " +
                          parts + "\n}\n");
    return int(dpde("check two.dpde --json").json()["order"]["time"]);
  };
  EXPECT_EQ(order("-b", "a", ""), 4);
  EXPECT_EQ(order("-a", "a - b", "subcycle b in 3"), 2);
  EXPECT_EQ(order("-b", "-b", "subcycle b in 3"), 1);
  EXPECT_EQ(order("-b", "a", "subcycle b in 3"), 1);
}

}  // namespace
}  // namespace dpde::testing
