// SPDX-License-Identifier: Apache-2.0
// Every kind of unknown x every kind of boundary x every kind of scheme x every method of gradients: against central
// differences of the losses of the same run. Each test writes its part of the table to gradient_table/ in the build
// folder.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "../driver/driver_support.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// An unknown as named in the table and the task, and to what degree the loss is smooth in it.
struct Unknown {
  std::string kind, line, part;
  double reach;
};
const std::vector<Unknown> unknowns = {
    {"initial state", "unknown initial u", "u", 0.3},
    {"velocity of second order", "unknown initial dt(p)", "p_t", 3},
    {"parameter", "unknown k", "k", 0.1},
    {"coefficient", "unknown c", "c", 3},
    {"boundary value", "unknown b", "b", 0.3},
    {"control", "unknown F", "F", 1},
    {"place of a source", "unknown s", "s", 0.05},
    {"weights of a network", "learn n", "n", 1},
};

struct Ends {
  std::string name, axis, walls, on;
  std::string without;  // the kind of unknown that makes no sense here
};
const std::vector<Ends> all_ends = {
    {"periodic", ", periodic", "", "", "boundary value"},
    {"bounded", "",
     "  boundary u: x.low = b*(1 + t), x.high = zero_gradient\n  boundary p: x.low = b, x.high = mixed(1, 0.3, 0.2)\n",
     "", ""},
    {"stretched", ", stretched tanh(1.5*x)/tanh(1.5)",
     "  boundary u: x.low = b*(1 + t), x.high = zero_gradient\n  boundary p: x.low = b, x.high = mixed(1, 0.3, 0.2)\n",
     "", ""},
    {"staggered", "", "  boundary u: x.low = b*(1 + t), x.high = zero_gradient\n  boundary p = zero_gradient\n",
     " on faces.x", ""},
};
const std::vector<std::string> schemes = {"euler", "rk4", "verlet", "ab2"};

/// Waves p in addition to the advected field u; on faces, the velocity lies between them.
std::string text_of(const Ends& ends, const std::string& scheme, const std::string& time = "0 .. 0.06, step 0.01") {
  const bool has_walls = !ends.walls.empty(), is_staggered = !ends.on.empty();
  std::string text = "network n(a) { initial he, seed 3; conv 3, 3; tanh; conv out, 3 }\nmodel m {\n  field u" +
                     ends.on + "\n  field p\n  coefficient c\n  param k, s" + (has_walls ? ", b" : "") +
                     "\n  control F\n";
  text += is_staggered ? "  dt(dt(p)) = c*lap(p) - 0.1*dt(p) - 0.3*dx(u)\n  dt(u) = k*lap(u) - 0.3*u*dx(u) - 0.2*dx(p) "
                         "+ 0.1*interpolate(n(p)) + inject(F, at = s)\n"
                       : "  dt(dt(p)) = c*lap(p) - 0.1*dt(p) + 0.2*u\n  dt(u) = k*lap(u) - 0.3*u*dx(u) + 0.1*p + "
                         "0.1*n(u) + inject(F, at = s)\n";
  text += "}\nscheme q { time = " + scheme + "; networks = f64 }\nscene g : m with q {\n  grid x = 0 .. 1, cells 7" +
          ends.axis + "\n" + ends.walls + "  k = 0.05\n  s = 0.37\n" + (has_walls ? "  b = 0.4\n" : "") +
          "  F = 0.5 + sin(5*t) every 0.02\n  c = 0.3 + 0.1*x\n"
          "  initial u = 0.7 + 0.2*sin(2*pi*x)\n  initial p = 0.3*cos(2*pi*x)\n  initial dt(p) = 0.1*x\n  time " +
          time + "\n}\ntask t : g {\n";
  for (const Unknown& unknown : unknowns) {
    if (unknown.kind != ends.without) text += "  " + unknown.line + "\n";
  }
  return text + "  minimise mean((u - 0.3)^2) + mean(p^3) over time\n  minimise mean(dx(u)^2 + p^2)\n}\n";
}

/// How a gradient is computed, and its tolerance against differences.
struct Way {
  std::string name;
  driver::SessionOptions options;
  bool single = false;
  double step() const { return single ? 0.1 : 2e-3; }
  double tolerance() const { return single ? 1e-2 : 2e-8; }  // the resolution of losses in floats
};

std::vector<Way> ways() {
  std::vector<Way> result{{"stored"}, {"checkpoints"}, {"threads"}, {"f32", {}, true}};
  result[1].options.slots = 2;
  result[2].options.threads = 3;
  return result;
}

struct Task {
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;
};

Task open(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& code,
          const driver::SessionOptions& options) {
  DiagnosticSink sink;
  Task task{driver::Session::open(source, code, options, sink), nullptr};
  if (task.session) task.inverse = driver::Inverse::open(*task.session, source, sink);
  EXPECT_NE(task.inverse, nullptr) << all_messages(source, sink);
  return task;
}

std::shared_ptr<const driver::Compiled> compile(const SourceFile& source, bool single) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  if (single) options.real = Precision::f32;
  return compiled(source, options);
}

/// Derivative of the loss along a line: central differences with two steps, extrapolated to order 4.
double difference(driver::Inverse& inverse, const Eigen::VectorXd& x, const Eigen::VectorXd& direction, double step) {
  const auto central = [&](double h) {
    return (inverse.value(x + h * direction) - inverse.value(x - h * direction)) / (2 * h);
  };
  return (4 * central(step / 2) - central(step)) / 3;
}

/// Messages from compiling the task.
std::string messages_of(const std::string& text) {
  const SourceFile source("refused.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "t";
  options.adjoint = true;
  DiagnosticSink sink;
  driver::compile(source, options, sink);
  return all_messages(source, sink);
}

using Row = std::map<std::string, double>;  // the largest error, by kind of unknown

/// Records in `row` the deviation of each unknown's gradient from differences.
void compare(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& code, const Way& way, Row& row,
             Eigen::VectorXd& gradient) {
  const Task task = open(source, code, way.options);
  if (!task.inverse) return;
  driver::Inverse& inverse = *task.inverse;
  const Eigen::VectorXd x = inverse.start();
  gradient.resize(inverse.size());
  inverse.value_and_gradient(x, gradient);
  inverse.hold_steps(true);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(1, 0.3);
  for (const driver::Inverse::Part& part : inverse.parts()) {
    const auto unknown = std::ranges::find(unknowns, part.name, &Unknown::part);
    ASSERT_NE(unknown, unknowns.end()) << part.name;
    Eigen::VectorXd direction = Eigen::VectorXd::Zero(inverse.size());
    for (Eigen::Index i = 0; i < part.size; ++i) direction[part.offset + i] = unknown->reach * normal(random);
    const double wanted = difference(inverse, x, direction, way.step()), got = gradient.dot(direction);
    EXPECT_GT(std::abs(wanted), 1e-6) << part.name << ": nothing to compare";
    const double error = std::abs(got - wanted) / std::abs(wanted);
    EXPECT_LT(error, way.tolerance()) << part.name << ": " << got << " for " << wanted;
    row[unknown->kind] = std::max(row[unknown->kind], error);
  }
}

void write_table(const Ends& ends, const std::map<std::string, Row>& rows) {
  const std::filesystem::path folder = std::filesystem::path(DPDE_BINARY_DIR) / "gradient_table";
  std::filesystem::create_directories(folder);
  std::ofstream out(folder / (ends.name + ".md"));
  out << "| " << ends.name << " |";
  for (const auto& [column, row] : rows) out << " " << column << " |";
  out << "\n|---|" << std::string(4 * rows.size(), '-') << "\n";
  for (const Unknown& unknown : unknowns) {
    out << "| " << unknown.kind << " |";
    for (const auto& [column, row] : rows)
      out << (row.contains(unknown.kind) ? fmt::format(" {:.0e} |", row.at(unknown.kind)) : " - |");
    out << "\n";
  }
}

class GradientTableOf : public ::testing::TestWithParam<Ends> {};

TEST_P(GradientTableOf, AgreesWithDifferences) {
  std::map<std::string, Row> rows;
  for (const std::string& scheme : schemes) {
    const SourceFile source("table.dpde", text_of(GetParam(), scheme));
    const auto code = compile(source, false), single = compile(source, true);
    ASSERT_TRUE(code && single) << scheme;
    Eigen::VectorXd stored;
    for (const Way& way : ways()) {
      SCOPED_TRACE(scheme + " " + way.name);
      Eigen::VectorXd gradient;
      compare(source, way.single ? single : code, way, rows[way.single ? scheme + " f32" : scheme], gradient);
      if (way.name == "stored") stored = gradient;
      if (!way.single) {
        EXPECT_EQ(gradient, stored);
      }
    }
  }
  write_table(GetParam(), rows);
}

/// Steps with substeps: from a Courant number, a tolerance, or a subcycle of one field; differences use runs with the
/// same substeps. By day with two kinds of boundaries; at night with all, also with threads and in floats.
TEST(GradientTable, OfSubsteps) {
  struct Parts {
    std::string name, scheme, time, line = "";
  };
  for (const Parts& parts : {Parts{"courant", "rk4", "0 .. 0.06, step 0.02, courant 0.6, speed 20"},
                             Parts{"tolerance", "dopri5", "0 .. 0.06, step 0.02, tolerance 1e-11"},
                             Parts{"subcycle", "rk2", "0 .. 0.06, step 0.02", "\n  subcycle u in 3"}}) {
    for (const Ends& ends : all_ends) {
      if (!is_thorough() && (ends.name == "periodic" || ends.name == "stretched" || parts.name == "subcycle")) continue;
      SCOPED_TRACE(parts.name + " " + ends.name);
      const SourceFile source("parts.dpde", text_of(ends, parts.scheme, parts.time + parts.line));
      const auto code = compile(source, false);
      ASSERT_TRUE(code);
      Eigen::VectorXd stored, other;
      std::map<std::string, Row> rows;
      compare(source, code, {"stored"}, rows[parts.name], stored);
      for (const Way& way : ways()) {
        if (way.name == "stored" || way.single || (!is_thorough() && way.name == "threads")) continue;
        compare(source, code, way, rows[parts.name], other);
        EXPECT_EQ(stored, other) << way.name;
      }
      const Task task = open(source, code, {});
      ASSERT_TRUE(task.inverse);
      if (parts.name != "subcycle") EXPECT_GT(task.session->rollout().run().parts, 3);
    }
  }
}

/// A steady state does not depend on the initial state and has no controls: these unknowns are refused below.
std::string text_of_steady(const Ends& ends, const std::string& scheme, const std::string& time) {
  const bool has_walls = !ends.walls.empty(), is_staggered = !ends.on.empty();
  const std::string net = is_staggered ? "interpolate(n(p))" : "n(u)";
  std::string text = "network n(a) { initial he, seed 3; conv 3, 3; tanh; conv out, 3 }\nmodel m {\n  field u" +
                     ends.on + "\n  field p\n  coefficient c\n  param k, s, f" + (has_walls ? ", b" : "") +
                     "\n  dt(u) = k*lap(u) - 0.3*u*dx(u) - u + 0.2 + 0.2*" + net +
                     " + inject(f, at = s)\n  dt(p) = 0.1*lap(p) - c*p + 0.3*" +
                     (is_staggered ? "interpolate(u)" : "u") + "^2\n}\nscheme q { time = " + scheme +
                     "; networks = f64 }\nscene g : m with q {\n  grid x = 0 .. 1, cells 7" + ends.axis + "\n";
  if (has_walls)
    text += "  boundary u: x.low = b, x.high = zero_gradient\n  boundary p: x.low = b, x.high = mixed(1, 0.3, 0.2)\n";
  return text + "  k = 0.05\n  s = 0.37\n  f = 0.5\n" + (has_walls ? "  b = 0.4\n" : "") +
         "  c = 1.3 + 0.1*x\n  initial u = 0.1\n  initial p = 0.1\n  time " + time + "\n}\ntask t : g {\n";
}

std::string steady_task(const Ends& ends) {
  std::string text;
  for (const Unknown& unknown : unknowns) {
    const bool is_there = unknown.kind != "initial state" && unknown.kind != "velocity of second order" &&
                          unknown.kind != "control" && unknown.kind != ends.without;
    if (is_there) text += "  " + unknown.line + "\n";
  }
  return text + "  minimise mean((u - 0.3)^2) + mean(p^3) + 0.1*mean(n(p))\n}\n";
}

/// The gradient of the steady state, against differences of runs that end there, and against the gradient through all
/// steps. The network is also in the loss.
TEST(GradientTable, OfSteadyStates) {
  for (const Ends& ends : all_ends) {
    std::map<std::string, Row> rows;
    for (const auto& [scheme, step] : {std::pair<std::string, std::string>{"rk4", "0.04"}, {"imex_euler", "0.1"}}) {
      SCOPED_TRACE(ends.name + " " + scheme);
      const std::string until = "0 .. 60, step " + step + ", until steady 1e-13";
      const SourceFile source("steady.dpde", text_of_steady(ends, scheme, until) + steady_task(ends));
      const auto code = compile(source, false);
      ASSERT_TRUE(code);
      Eigen::VectorXd gradient, of_all, other;
      compare(source, code, {"steady"}, rows[scheme], gradient);
      for (const Way& way : ways()) {  // only the last state is stored
        if (way.name == "stored" || way.single || !is_thorough()) continue;
        compare(source, code, way, rows[scheme], other);
        EXPECT_EQ(gradient, other) << way.name;
      }
      const SourceFile long_run("long.dpde", text_of_steady(ends, scheme, "0 .. 40, step " + step) + steady_task(ends));
      const auto all = compile(long_run, false);
      ASSERT_TRUE(all);
      Task task = open(long_run, all, {});
      ASSERT_TRUE(task.inverse);
      of_all.resize(task.inverse->size());
      task.inverse->value_and_gradient(task.inverse->start(), of_all);
      EXPECT_LT((gradient - of_all).norm(), 1e-9 * of_all.norm());
    }
    write_table({"steady " + ends.name, "", "", "", ""}, rows);
  }
}

TEST(GradientTable, OfSteadyStatesSaysWhatMakesNoSense) {
  const Ends& ends = all_ends.front();
  const std::string text = text_of_steady(ends, "euler", "0 .. 60, step 0.02, until steady 1e-13");
  EXPECT_NE(messages_of(text + "  unknown initial u\n  minimise mean(u^2)\n}\n").find("an unknown initial state"),
            std::string::npos);
  EXPECT_NE(messages_of(text + "  unknown k\n  minimise mean(u^2) over time\n}\n").find("a loss at given times"),
            std::string::npos);
  std::string controlled = text + "  unknown k\n  minimise mean(u^2)\n}\n";
  const auto put = [&](const std::string& old, const std::string& now) {
    controlled.replace(controlled.find(old), old.size(), now);
  };
  put("  coefficient c\n", "  coefficient c\n  control F\n");
  put(" - u + 0.2", " - u + F");
  put("  k = 0.05\n", "  k = 0.05\n  F = 0.2 every 0.04\n");
  EXPECT_NE(messages_of(controlled).find("a scene with controls"), std::string::npos) << messages_of(controlled);
}

/// Substeps from a Courant number on the way to a steady state: the state at rest and its gradient are the same, up to
/// the effect of the step on them.
TEST(GradientTable, OfSteadyStatesReachedInParts) {
  const Ends& ends = all_ends[1];
  const auto gradient_of = [&](const std::string& time) {
    const SourceFile source("parts.dpde",
                            text_of_steady(ends, "rk4", time + ", until steady 1e-13") + steady_task(ends));
    Row row;
    Eigen::VectorXd gradient;
    compare(source, compile(source, false), {"steady"}, row, gradient);
    return gradient;
  };
  const Eigen::VectorXd whole = gradient_of("0 .. 60, step 0.04"),
                        parts = gradient_of("0 .. 60, step 0.04, courant 0.2, speed 2");
  ASSERT_EQ(parts.size(), whole.size());
  EXPECT_LT((parts - whole).norm(), 1e-8 * whole.norm());  // the steady state of rk4 is that of the equations
}

/// If steps of a large grid follow one another directly, blocks of them are reversed in one pass over memory.
std::string text_of_blocks(const std::string& scheme, bool has_network = false) {
  std::string text = R"(
network n(a) { initial he, seed 3; conv 2, 3; tanh; conv out, 3 }
model m {
  field u
  field p
  coefficient c
  param k
  control F
  dt(dt(p)) = c*lap(p) - 0.1*dt(p) + 0.2*u
  dt(u) = k*lap(u) - 0.3*u*dx(u) + 0.1*p + F
}
scheme q { time = )" +
                     scheme + R"( }
scene g : m with q {
  grid x = 0 .. 128, cells 1024, periodic
  grid y = 0 .. 80, cells 640, periodic
  k = 0.05
  F = 0.5 + sin(5*t) every 0.02
  c = 0.3 + 0.1*sin(2*pi*x/8)
  initial u = 0.7 + 0.2*sin(2*pi*x/8)
  initial p = 0.3 + 0.3*cos(2*pi*y/5)
  initial dt(p) = 0.1*sin(2*pi*y/5)
  time 0 .. 0.08, step 0.01
}
task t : g {
  unknown initial u
  unknown initial dt(p)
  unknown k
  unknown c
  unknown F
  minimise mean((u - 0.3)^2) + mean(p^3)
}
)";
  const auto put = [&](const std::string& old, const std::string& now) {
    text.replace(text.find(old), old.size(), now);
  };
  if (has_network) put("0.1*p + F\n", "0.1*n(p) + F\n"), put("  unknown F\n", "  unknown F\n  learn n\n");
  if (has_network) put("cells 1024", "cells 128"), put("cells 640", "cells 80");
  if (has_network) put("time = " + scheme, "time = " + scheme + "; networks = f64");
  if (!has_network) text.erase(0, text.find("model m"));
  return text;
}

TEST(GradientTable, OfBlocksOfSteps) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  std::map<std::string, Row> rows;
  for (const std::string scheme : {"euler", "rk4", "ab2"}) {  // verlet steps are not blocked
    SCOPED_TRACE(scheme);
    const SourceFile source("blocks.dpde", text_of_blocks(scheme));
    const auto code = compile(source, false);
    ASSERT_TRUE(code);
    Eigen::VectorXd gradient;
    compare(source, code, {"blocks"}, rows[scheme], gradient);
    const Task task = open(source, code, {});
    ASSERT_TRUE(task.inverse);
    EXPECT_GT(task.session->rollout().gradient_block_steps(), 1);
    Way few{"checkpoints"};
    few.options.slots = 2;
    Eigen::VectorXd checkpoints;
    if (is_thorough()) {
      compare(source, code, few, rows[scheme], checkpoints);
      EXPECT_EQ(checkpoints, gradient);
    }
  }
  write_table({"blocks", "", "", "", ""}, rows);
}

/// A network reads the whole field: its steps and their gradients are not blocked.
TEST(GradientTable, OfStepsWithNetworksIsNotMadeInBlocks) {
  if (!is_thorough()) GTEST_SKIP() << "at night: a network on 10240 cells";
  const SourceFile source("blocks.dpde", text_of_blocks("rk4", true));
  const auto code = compile(source, false);
  ASSERT_TRUE(code);
  Row row;
  Eigen::VectorXd gradient;
  compare(source, code, {"blocks"}, row, gradient);
  const Task task = open(source, code, {});
  ASSERT_TRUE(task.inverse);
  EXPECT_LE(task.session->rollout().gradient_block_steps(), 1);
}

INSTANTIATE_TEST_SUITE_P(, GradientTableOf, ::testing::ValuesIn(all_ends),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dpde::testing
