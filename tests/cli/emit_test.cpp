// SPDX-License-Identifier: Apache-2.0
// dpde emit, fmt and plot: text and pictures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <regex>

#include "command_support.h"
#include "support/examples_by_day.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using EmitCommand = Command;

TEST_F(EmitCommand, StencilTextIsAFileThatRunsToTheSameResult) {
  write("rod.dpde", rod_text);
  ASSERT_EQ(dpde("emit rod.dpde rod --stage stencil -o step.dpde").status, 0);
  ASSERT_EQ(dpde("run rod.dpde rod --quiet --out a").status, 0);
  const Outcome run = dpde("run step.dpde --json --out b");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(content(path("a/u.npy")), content(path("b/u.npy")));
  EXPECT_EQ(run.json()["error"], dpde("run rod.dpde rod --json").json()["error"]);
  EXPECT_EQ(dpde("emit step.dpde --stage stencil").out, content(path("step.dpde")));
}

/// A stage reads back, or the command reports that it does not.
TEST_F(EmitCommand, WhatIsNotReadBackIsToldSo) {
  write("rod.dpde", rod_text);
  const std::string told = "dpde reads ast, stencil, tangent and adjoint back";
  EXPECT_NE(dpde("emit --help").out.find("dpde reads ast, stencil, tangent and"), std::string::npos);
  for (const std::string stage : {"ast", "model", "stencil", "tangent", "adjoint", "loop", "adjoint-loop"}) {
    const Outcome emitted = dpde("emit rod.dpde find --stage " + stage + " -o again.dpde");
    ASSERT_EQ(emitted.status, 0) << emitted.err;
    const bool is_read = dpde("emit again.dpde --stage ast").status == 0;
    EXPECT_EQ(emitted.err.find(told) == std::string::npos, is_read) << stage << emitted.err;
    EXPECT_EQ(dpde("emit rod.dpde find --quiet --stage " + stage).err, "") << stage;
  }
}

/// Blocks of a text without comments, and without the trailing empty lines that these leave.
std::string without_comments(const std::string& text) {
  std::string kept = std::regex_replace(text, std::regex("#[^\n]*\n"), "");
  return kept.erase(kept.find_last_not_of('\n') + 1);
}

/// Each task and scene of a file, including programs of initial states, losses and tests, of steps and of adjoints.
class EmitsExample : public EmitCommand, public ::testing::WithParamInterface<fs::path> {};

TEST_P(EmitsExample, ReadsBackAsItWas) {
  const std::vector<std::string> names = targets_by_day(content(GetParam()));
  EXPECT_FALSE(names.empty());
  for (const std::string& name : names) {
    for (const std::string stage : {"stencil", "adjoint"}) {
      const Outcome first = dpde("emit " + GetParam().string() + " " + name + " --stage " + stage);
      ASSERT_EQ(first.status, 0) << first.err;
      if (first.out.empty() && stage == "adjoint") continue;  // no task, no adjoint
      ASSERT_NE(first.out, "") << name;
      write("again.dpde", first.out);
      const Outcome again = dpde("emit again.dpde --stage stencil");
      ASSERT_EQ(again.status, 0) << name << "\n" << again.err;
      EXPECT_EQ(without_comments(again.out), without_comments(first.out)) << name << " " << stage;
    }
  }
}

/// By day every second file.
std::vector<fs::path> files_that_are_emitted() {
  const std::vector<fs::path> files = example_files();
  std::vector<fs::path> some;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (is_tried(i, 6)) some.push_back(files[i]);
  }
  return some;
}

INSTANTIATE_TEST_SUITE_P(Examples, EmitsExample, ::testing::ValuesIn(files_that_are_emitted()),
                         [](const auto& info) { return info.param.stem().string(); });

/// Copies of a symmetric network with shared weights; outputs without names in initial states.
TEST_F(EmitCommand, StencilTextWithNetworksRunsToTheSameResult) {
  if (!is_thorough()) GTEST_SKIP() << "at night: nine seconds";
  write("n.dpde", R"(
network push(u: vector, s) -> vector { initial he, seed 3; symmetric flips, rotations, galilean; repeat 2 shared { conv in, 3; tanh }; conv out, 3 }
network start(a) -> p, q { initial he, seed 5; symmetric flip x; conv 3, 3; gelu; conv out, 3 }
model m { vector u; field s; dt(u) = push(u, s) - u; dt(s) = 0.1*lap(s) }
scene r : m {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 6, periodic
  initial u = (start(x).q, y); initial s = start(x*y).p
  time 0 .. 0.2, step 0.1
})");
  ASSERT_EQ(dpde("emit n.dpde r --stage stencil -o step.dpde").status, 0);
  ASSERT_EQ(dpde("run n.dpde r --quiet --backend interpreter --out a").status, 0);
  const Outcome run = dpde("run step.dpde --quiet --backend interpreter --out b");
  ASSERT_EQ(run.status, 0) << run.err;
  for (const std::string field : {"u.x", "u.y", "s"})
    EXPECT_EQ(content(path("a/" + field + ".npy")), content(path("b/" + field + ".npy"))) << field;
  EXPECT_EQ(dpde("emit step.dpde --stage stencil").out, content(path("step.dpde")));
}

/// The value at the wall is then a field that the program computes.
TEST_F(EmitCommand, ScenesWithCoefficientsAtWallsReadBack) {
  write("wall.dpde", R"(model m { field u; coefficient g; param k, a; dt(u) = k*lap(u) }
scene s : m {
  grid x = 0 .. 1, cells 4
  grid y = 0 .. 1, cells 5
  boundary u: x.low = g, x.high = mixed(1, 2, g*g), y.low = gradient(a), y.high = sin(x)
  initial u = x
  g = 1 + y
  k = 0.1
  a = 0.3
  time 0 .. 1/16, step 1/64
})");
  ASSERT_EQ(dpde("emit wall.dpde s --stage stencil -o step.dpde").status, 0);
  EXPECT_EQ(dpde("emit step.dpde --stage stencil").out, content(path("step.dpde")));
  ASSERT_EQ(dpde("run wall.dpde s --quiet --out a").status, 0);
  const Outcome run = dpde("run step.dpde --quiet --out b");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(content(path("a/u.npy")), content(path("b/u.npy")));
}

/// Contents of a .npy file.
struct Array {
  explicit Array(const fs::path& path) : bytes(content(path)) {}
  bool operator==(const Array&) const = default;
  std::string bytes;
};

std::vector<double> numbers_of(const Array& array) {
  const std::string& bytes = array.bytes;
  const std::size_t begin =
      10 + static_cast<unsigned char>(bytes.at(8)) + 256 * static_cast<unsigned char>(bytes.at(9));
  std::vector<double> numbers((bytes.size() - begin) / sizeof(double));
  std::memcpy(numbers.data(), bytes.data() + begin, numbers.size() * sizeof(double));
  return numbers;
}

std::vector<double> numbers_of(const Json& observables) {
  if (observables.is_number()) return {observables.get<double>()};
  std::vector<double> numbers;
  const auto add = [&](const Json& part) { std::ranges::copy(numbers_of(part), std::back_inserter(numbers)); };
  if (observables.is_array()) std::ranges::for_each(observables, add);
  if (observables.is_object()) {
    for (const auto& [name, value] : observables.items()) add(value);
  }
  return numbers;
}

/// Runs a scene and its emitted text for three steps: states and observables are bit-identical. In the text of a task,
/// its unknowns are parameters; in a scene they are numbers, with which terms may be dropped: then equal up to
/// rounding.
class EmittedScene : public EmitCommand {
 protected:
  /// The scene in the text, if it has one.
  void expect_same(const std::string& file, const std::string& scene, const std::string& text) {
    const double rounding = text.find("\n# task ") == std::string::npos ? 0 : 1e-13;
    const auto expect_equal = [&](const auto& got, const auto& wanted, const std::string& what) {
      if (rounding == 0) {
        EXPECT_EQ(got, wanted) << what;
        return;
      }
      const std::vector<double> one = numbers_of(got), other = numbers_of(wanted);
      ASSERT_EQ(one.size(), other.size()) << what;
      double size = 0;
      for (const double value : other) size = std::max(size, std::abs(value));
      for (std::size_t i = 0; i < one.size(); ++i) EXPECT_NEAR(one[i], other[i], rounding * size) << what;
    };
    std::smatch time;
    ASSERT_TRUE(std::regex_search(text, time, std::regex("time (\\S+) \\.\\. \\S+, step ([^,\\s]+)"))) << text;
    const std::string end = fmt::format(" --set end={}", std::stod(time[1]) + 3 * std::stod(time[2]));
    write("step.dpde", text);
    const Outcome made = dpde("run " + file + " " + scene + " --json --out a" + end);
    const Outcome again = dpde("run step.dpde " + scene + " --json --out b" + end);
    ASSERT_EQ(made.status, again.status) << made.err << again.err;
    if (made.status != 0) return;
    expect_equal(again.json()["observables"], made.json()["observables"], scene);
    int fields = 0;
    for (const auto& entry : fs::directory_iterator(path("a"))) {
      if (entry.path().extension() != ".npy") continue;
      const fs::path other = path("b") / entry.path().filename();
      EXPECT_EQ(content(other).size(), content(entry.path()).size()) << entry.path();
      expect_equal(Array(other), Array(entry.path()), scene + " " + entry.path().string());
      ++fields;
    }
    EXPECT_GT(fields, 0) << scene;
    for (const char* folder : {"a", "b"}) fs::remove_all(path(folder));
  }
};

TEST_F(EmittedScene, KeepsParametersOfAllPrograms) {
  write("all.dpde", R"(model m { field u; coefficient c, e; param k = 0.7, a = 0.3, b = 2, w = 0.1
  let q = a*u^2; dt(u) = c*u }
scheme q { time = euler }
scene s : m with q {
  grid x = 0 .. 2, cells 5
  boundary u: all = 0
  initial u = 1 + w*x
  c = 1 + k*x
  e = b*x
  time 0 .. 0.3, step 0.1
  observe o = mean(q)*b
  observe p = mean(e*u)
  exact u = 1 + a*sin(x)
}
task t : s { unknown k; minimise a*mean(u^2) }
)");
  const Outcome emit = dpde("emit all.dpde s --stage stencil");
  ASSERT_EQ(emit.status, 0) << emit.err;
  expect_same("all.dpde", "s", emit.out);
  EXPECT_EQ(dpde("emit step.dpde --stage stencil").out, emit.out);

  write("task.dpde", dpde("emit all.dpde t --stage stencil").out + "task t : s { unknown k; minimise a*mean(u^2) }\n");
  const Outcome made = dpde("gradient all.dpde t --json"), again = dpde("gradient task.dpde t --json");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(made.json()["loss"], again.json()["loss"]);
  EXPECT_EQ(made.json()["gradients"], again.json()["gradients"]);
  EXPECT_EQ(dpde("run task.dpde s --quiet --set a=0.4").status, 0);
}

TEST_F(EmittedScene, KeepsUntilSteady) {
  write("still.dpde", R"(model m { field u; param k = 0.7; dt(u) = 0.3*lap(u) - u + k*sin(x) }
scheme q { time = rk2 }
scene s : m with q { grid x = 0 .. 2, cells 5; time 0 .. 3, step 0.1, until steady 0.05; boundary u: all = 0; initial u = 0; accuracy 1e-3 on u }
)");
  write("step.dpde", dpde("emit still.dpde s --stage stencil").out);
  ASSERT_EQ(dpde("run still.dpde s --quiet --out a").status, 0);
  ASSERT_EQ(dpde("run step.dpde s --quiet --out b").status, 0);
  EXPECT_EQ(content(path("a/u.npy")), content(path("b/u.npy")));
  EXPECT_NE(content(path("step.dpde")).find("accuracy 0.001 on u"), std::string::npos);
}

/// Each scene of the examples that the text can express; all of them at night.
class RunsExample : public EmittedScene, public ::testing::WithParamInterface<fs::path> {};

TEST_P(RunsExample, AsEmitted) {
  std::vector<std::string> names = targets_of(content(GetParam()));
  if (!is_thorough() && names.size() > 1) names.resize(1);
  for (const std::string& name : names) {
    const Outcome emit = dpde("emit " + GetParam().string() + " " + name + " --stage stencil");
    ASSERT_EQ(emit.status, 0) << emit.err;
    std::smatch scene;
    if (!std::regex_search(emit.out, scene, std::regex("\nscene (\\w+) :"))) continue;
    expect_same(GetParam().string(), scene[1], emit.out);
  }
}

/// A few by day.
std::vector<fs::path> files_that_run() {
  std::vector<fs::path> files = example_files();
  if (is_thorough()) return files;
  std::vector<fs::path> some;
  for (std::size_t i = 0; i < files.size(); i += 8) some.push_back(files[i]);
  return some;
}

INSTANTIATE_TEST_SUITE_P(Examples, RunsExample, ::testing::ValuesIn(files_that_run()),
                         [](const auto& info) { return info.param.stem().string(); });

TEST_F(EmitCommand, SettingsAreInTheText) {
  write("rod.dpde", rod_text);
  const std::string text = dpde("emit rod.dpde rod --stage stencil --set cells=7 --set k=1").out;
  EXPECT_NE(text.find("cells 7, periodic"), std::string::npos) << text;
  EXPECT_NE(text.find("  k = 1\n"), std::string::npos) << text;
}

/// The rest of the text reads back without it.
TEST_F(EmitCommand, SaysWhatASceneOfAProgramCannotSay) {
  const auto changed = [](std::string text, const std::string& a, const std::string& b) {
    return text.replace(text.find(a), a.size(), b);
  };
  const std::string head = "# scene rod is left out: that of a program has no words for ";
  const std::pair<std::string, std::string> cases[] = {
      {changed(rod_text, "  observe", "  after step: u = 0.9*u\n  observe"), "events"},
      {changed(rod_text, "step 1/8", "step 1/8, courant 0.5, speed 1"), "steps that a Courant number splits"},
      {changed(rod_text, "time = euler", "time = euler; real = f32"), "real = f32"},
      {changed(rod_text, "cells 16, periodic", "cells 16, periodic, stretched x + 0.3*sin(x)"), "the stretched axis x"},
      {"operator f(u) order 1 = u[-1] + u\n" + changed(rod_text, "mean(u^2)", "mean(f(u))"), "the operator in size"}};
  for (const auto& [text, words] : cases) {
    write("rod.dpde", text);
    const Outcome emit = dpde("emit rod.dpde rod --stage stencil -o step.dpde");
    EXPECT_EQ(emit.status, 0) << emit.err;
    EXPECT_NE(content(path("step.dpde")).find(head + words + "\n"), std::string::npos) << words << "\n"
                                                                                       << content(path("step.dpde"));
    EXPECT_EQ(dpde("check step.dpde --all").status, 0) << words;
  }
}

TEST_F(EmitCommand, DerivativesReadBack) {
  write("rod.dpde", rod_text);
  for (const std::string stage : {"tangent", "adjoint"}) {
    const Outcome emit = dpde("emit rod.dpde find --stage " + stage + " -o d.dpde");
    ASSERT_EQ(emit.status, 0) << emit.err;
    EXPECT_EQ(dpde("emit d.dpde --stage stencil").out, content(path("d.dpde")));
    EXPECT_EQ(dpde("check d.dpde --all").status, 0);
    EXPECT_EQ(dpde("emit d.dpde rod_step_" + stage + " --stage " + stage).status, 0);
  }
}

TEST_F(EmitCommand, HasEveryStage) {
  write("rod.dpde", rod_text);
  for (const std::string stage :
       {"ast", "model", "stencil", "tangent", "adjoint", "loop", "cpp", "adjoint-cpp", "llvm", "adjoint-llvm", "asm"}) {
    const Outcome emit = dpde("emit rod.dpde find --quiet --stage " + stage);
    EXPECT_EQ(emit.status, 0) << stage << emit.err;
    EXPECT_GT(emit.out.size(), 100u) << stage;
    EXPECT_EQ(emit.err, "") << stage;
  }
  EXPECT_EQ(dpde("emit rod.dpde find --stage parsed").status, 2);
}

using FmtCommand = Command;

TEST_F(FmtCommand, FormatsInPlaceOnce) {
  write("rod.dpde", "model  heat{field u\n param k\n dt(u)=k*lap( u )}\n");
  EXPECT_EQ(dpde("fmt rod.dpde --check").status, 1);
  EXPECT_EQ(dpde("fmt rod.dpde").status, 0);
  const std::string once = content(path("rod.dpde"));
  EXPECT_NE(once.find("dt(u) = k*lap(u)"), std::string::npos) << once;
  EXPECT_EQ(dpde("fmt rod.dpde --check").status, 0);
  EXPECT_EQ(dpde("fmt rod.dpde --json").json()["changed"], false);
  EXPECT_EQ(content(path("rod.dpde")), once);
}

TEST_F(FmtCommand, LeavesAFileWithErrorsAlone) {
  const std::string wrong = "model  heat{field u\n dt(u)=k*(lap( u )}\n";
  write("rod.dpde", wrong);
  EXPECT_EQ(dpde("fmt rod.dpde").status, 2);
  EXPECT_EQ(content(path("rod.dpde")), wrong);
}

using PlotCommand = Command;

TEST_F(PlotCommand, DrawsAStoredField) {
  write("rod.dpde", rod_text);
  ASSERT_EQ(dpde("run rod.dpde rod --quiet --out o").status, 0);
  const Outcome plot = shell("LC_ALL=C $DPDE plot o/u.npy --out pictures");
  EXPECT_EQ(plot.status, 0) << plot.err;
  EXPECT_NE(plot.out.find('*'), std::string::npos);
  const bool gnuplot = std::system("gnuplot --version >/dev/null 2>&1") == 0;
  EXPECT_EQ(fs::exists(path("pictures/u.png")), gnuplot);
}

TEST_F(PlotCommand, WithoutGnuplotDrawsText) {
  write("rod.dpde", rod_text);
  ASSERT_EQ(dpde("run rod.dpde rod --quiet --out o").status, 0);
  const Outcome plot = shell("PATH=/nowhere LC_ALL=C $DPDE plot o/u.npy");
  EXPECT_EQ(plot.status, 0);
  EXPECT_NE(plot.out.find('*'), std::string::npos);
  EXPECT_NE(plot.err.find("gnuplot is not installed"), std::string::npos);
}

}  // namespace
}  // namespace dpde::testing
