// SPDX-License-Identifier: Apache-2.0
// Every kind of unknown, between every kind of end, by every kind of scheme, in every way to make a gradient: against
// central differences of the losses of the same run. Each test writes its part of the table to gradient_table/ in the
// build folder.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "../driver/driver_support.h"
#include "driver/inverse.h"
#include "driver/session.h"

namespace dpde::testing {
namespace {

/// What is unknown, as the table and the task call it, and how far the loss is smooth in it.
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
  std::string without;  // the kind of unknown that makes no sense
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

/// Waves p beside what is carried, u; on faces what carries lies between them.
std::string text_of(const Ends& ends, const std::string& scheme) {
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
          "  initial u = 0.7 + 0.2*sin(2*pi*x)\n  initial p = 0.3*cos(2*pi*x)\n  initial dt(p) = 0.1*x\n  time 0 .. "
          "0.06, step 0.01\n}\ntask t : g {\n";
  for (const Unknown& unknown : unknowns) {
    if (unknown.kind != ends.without) text += "  " + unknown.line + "\n";
  }
  return text + "  minimise mean((u - 0.3)^2) + mean(p^3) over time\n  minimise mean(dx(u)^2 + p^2)\n}\n";
}

/// How a gradient is made, and how far it may be from differences.
struct Way {
  std::string name;
  driver::SessionOptions options;
  bool single = false;
  double step() const { return single ? 0.1 : 2e-3; }
  double tolerance() const { return single ? 1e-2 : 2e-8; }  // losses in floats resolve no more
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

/// Of losses along a line: from both sides, of two steps, extrapolated to order 4.
double difference(driver::Inverse& inverse, const Eigen::VectorXd& x, const Eigen::VectorXd& direction, double step) {
  const auto central = [&](double h) {
    return (inverse.value(x + h * direction) - inverse.value(x - h * direction)) / (2 * h);
  };
  return (4 * central(step / 2) - central(step)) / 3;
}

using Row = std::map<std::string, double>;  // the largest error, by kind of unknown

/// Adds to `row` how far each unknown's gradient is from differences.
void compare(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& code, const Way& way, Row& row,
             Eigen::VectorXd& gradient) {
  const Task task = open(source, code, way.options);
  if (!task.inverse) return;
  driver::Inverse& inverse = *task.inverse;
  const Eigen::VectorXd x = inverse.start();
  gradient.resize(inverse.size());
  inverse.value_and_gradient(x, gradient);
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

/// Where nothing stands between the steps of a large grid, blocks of them are reversed in one pass over memory.
std::string text_of_blocks(const std::string& scheme) {
  return R"(
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
}

TEST(GradientTable, OfBlocksOfSteps) {
  std::map<std::string, Row> rows;
  for (const std::string scheme : {"euler", "rk4", "ab2"}) {  // no blocks are made of steps of verlet
    SCOPED_TRACE(scheme);
    const SourceFile source("blocks.dpde", text_of_blocks(scheme));
    const auto code = compile(source, false);
    ASSERT_TRUE(code);
    Eigen::VectorXd gradient;
    compare(source, code, {"blocks"}, rows[scheme], gradient);
    const Task task = open(source, code, {});
    ASSERT_TRUE(task.inverse);
    EXPECT_GT(task.session->rollout().gradient_block_steps(), 1);
  }
  write_table({"blocks", "", "", "", ""}, rows);
}

INSTANTIATE_TEST_SUITE_P(, GradientTableOf, ::testing::ValuesIn(all_ends),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dpde::testing
