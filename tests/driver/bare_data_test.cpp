// SPDX-License-Identifier: Apache-2.0
// Data in formulas of losses and tests, for each source and position of the data, with and without a grid. A datum is
// one number per state if it is an observable or, outside of reductions, a file; a field of a scene is a field on its
// grid, which without a grid is one number too. Gradients are compared with differences, values with the same task with
// numbers.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <regex>
#include <vector>

#include "dpde/runtime/npy.h"
#include "driver_support.h"
#include "support/opened_scene.h"
#include "support/setting.h"

namespace dpde::driver::bare_data {
namespace {

namespace testing = dpde::testing;
namespace fs = std::filesystem;

enum class From { field, observable, file };
constexpr From origins[] = {From::field, From::observable, From::file};

/// The formula to minimise; N(u) is a number computed from u.
struct Formula {
  std::string minimised, tested;
  bool is_reduced = false;  // the datum occurs only in a reduction
  bool is_array = false;
};
const std::vector<Formula> formulas = {
    {"(N(u) - d)^2", ""},
    {"mean((u - d)^2)", "mean(u - d)", true},
    {"abs(N(u) - 3*d)", ""},
    {"mean(u)*d", ""},
    {"mean(u^2)", "N(u) - d"},
    {"if(N(u) < d, 1, 2)*(N(u) - d)^2 + d*mean(u^2)", "-d"},
    {"sum((N(c[i]) - d[i])^2, i)", "", false, true},
    {"mean(u^2)", "sum(N(c[i])*d[i], i)", false, true},
    {"mean(sum((c[i] - d[i])^2, i))", "mean(c[1] - d[1])", true, true},
};
const std::vector<std::string> moments = {" at t = 0.5", ", mean over time"};

struct Cell {
  Formula formula;
  From from;
  bool has_grid;
  std::string when;
};

/// Replaces each N(...) by a number of its field: the mean on a grid, otherwise the field itself.
std::string with_numbers(std::string formula, bool has_grid) {
  for (std::size_t at = formula.find("N("); at != std::string::npos; at = formula.find("N(", at + 1))
    formula.replace(at, 1, has_grid ? "mean" : "");
  return formula;
}

std::string text_of(Cell cell) {
  const bool is_array = cell.formula.is_array;
  const std::string moved = cell.has_grid ? " + 0.02*lap(u)" : "";
  std::string text = "model m { field u, c[2]; param k = 1; dt(u) = -k*u" + moved +
                     "; dt(c[i]) = -(k + i)*c[i] }\nscene s : m {\n" +
                     (cell.has_grid ? "  grid x = 0 .. 1, cells 4\n  boundary u: x.low = 0.2, x.high = zero_gradient\n"
                                      "  boundary c[i]: x = zero_gradient\n"
                                    : "") +
                     "  initial u = 1; initial c[i] = i\n  time 0 .. 0.5, step 0.125\n" +
                     with_numbers("  observe o = N(u); observe g[i] = N(c[i])\n}\n", cell.has_grid) +
                     "scene truth = s { k = 1.5 }\ntask t : s {\n";
  const std::string when = cell.when == moments[0] ? cell.when : " over time";
  switch (cell.from) {
    case From::field: text += (is_array ? "  data d[i] = c[i]" : "  data d = u") + (" from scene truth" + when); break;
    case From::observable:
      text += (is_array ? "  data d[i] = g[i]" : "  data d = o") + (" from scene truth" + when);
      break;
    case From::file: text += "  data d = load(\"d.npy\")" + when; break;
  }
  if (cell.from == From::file) {  // one file for all components
    for (std::string* formula : {&cell.formula.minimised, &cell.formula.tested})
      *formula = std::regex_replace(*formula, std::regex(R"(d\[.\])"), "d");
  }
  text += "\n  unknown k\n  minimise " + with_numbers(cell.formula.minimised, cell.has_grid) + cell.when + "\n";
  if (!cell.formula.tested.empty())
    text += "  test w = " + with_numbers(cell.formula.tested, cell.has_grid) + cell.when + "\n";
  return text + "}\n";
}

/// A field occurs where only a number makes sense.
bool is_refused(const Cell& cell) { return cell.has_grid && cell.from == From::field && !cell.formula.is_reduced; }

std::vector<Cell> cells() {
  std::vector<Cell> all;
  for (const bool has_grid : {false, true}) {
    for (const From from : origins) {
      for (const std::string& when : moments) {
        for (const Formula& formula : formulas) {
          all.push_back({formula, from, has_grid, when});
        }
      }
    }
  }
  return all;
}

/// The file for the cells: 0.3 or less, on the grid if the data occur in reductions.
fs::path write_data(const Cell& cell) {
  const fs::path folder =
      fs::path(::testing::TempDir()) / ("dpde_bare_data_" + std::to_string(static_cast<long>(::getpid())));
  fs::create_directories(folder);
  const std::int64_t states = cell.when == moments[0] ? 1 : 5,
                     points = cell.has_grid && cell.formula.is_reduced ? 4 : 1;
  std::vector<double> values;
  for (std::int64_t i = 0; i < states * points; ++i) values.push_back(0.3 - 0.02 * static_cast<double>(i));
  std::vector<std::int64_t> shape;
  if (states > 1 || points == 1) shape.push_back(states);
  if (points > 1) shape.push_back(points);
  write_npy(folder / "d.npy", shape, values);
  return folder;
}

void expect_gradient_of_differences(Inverse& inverse) {
  Eigen::VectorXd x = inverse.start(), gradient(x.size());
  const double loss = inverse.value_and_gradient(x, gradient);
  EXPECT_TRUE(std::isfinite(loss));
  constexpr double h = 1e-4;
  const Eigen::VectorXd all = Eigen::VectorXd::Constant(x.size(), h);
  const double difference = (inverse.value(x + all) - inverse.value(x - all)) / (2 * h);
  EXPECT_NEAR(difference, gradient.sum(), 1e-6 * std::max(1.0, std::abs(gradient.sum())));
  EXPECT_GT(std::abs(gradient.sum()), 1e-6);
}

void expect_certified(const testing::OpenedScene& scene) {
  CompileOptions options = scene.session->compiled().options;
  options.tangent = true;
  DiagnosticSink sink;
  auto code = compile(scene.source, options, sink);
  ASSERT_TRUE(code);
  const auto certificate =
      analysis::certify(scene.source, std::make_shared<const Compiled>(std::move(*code)), {}, sink);
  ASSERT_TRUE(certificate) << testing::all_messages(scene.source, sink);
  EXPECT_TRUE(certificate->passed());
}

void expect_refusal(const std::string& text) {
  const SourceFile source("test.dpde", text);
  CompileOptions options;
  options.selection.name = "t";
  DiagnosticSink sink;
  EXPECT_FALSE(compile(source, options, sink));
  ASSERT_FALSE(sink.all().empty());
  EXPECT_EQ(sink.all()[0].kind->code, "E0705") << testing::all_messages(source, sink);
}

TEST(BareData, AreNumbersOrRefused) {
  std::size_t count = 0;
  for (const Cell& cell : cells()) {
    const std::string text = text_of(cell);
    SCOPED_TRACE(text);
    if (is_refused(cell)) {
      expect_refusal(text);
      continue;
    }
    const bool is_alone = cell.from == From::field && cell.when == moments[0];
    if (!testing::is_tried(count++, 6) && !is_alone) continue;
    const fs::path folder = write_data(cell);
    testing::OpenedScene scene(text, "t", {.adjoint = true, .path = (folder / "test.dpde").string()});
    const auto inverse = scene.inverse();
    ASSERT_NE(inverse, nullptr);
    expect_gradient_of_differences(*inverse);
    if (testing::is_tried(count, 7)) expect_certified(scene);
    fs::remove_all(folder);
  }
}

/// A field of a scene without a grid is a number, as an observable of it.
TEST(BareData, OfAFieldAreThoseOfItsObservable) {
  for (std::size_t i = 0; i < formulas.size(); ++i) {
    const Formula& formula = formulas[i];
    if (!testing::is_tried(i, 4)) continue;
    double losses[2] = {};
    for (const From from : {From::field, From::observable}) {
      testing::OpenedScene scene(text_of({formula, from, false, moments[1]}), "t", {.adjoint = true});
      const auto inverse = scene.inverse();
      ASSERT_NE(inverse, nullptr);
      losses[from == From::field ? 0 : 1] = inverse->value(inverse->start());
    }
    EXPECT_DOUBLE_EQ(losses[0], losses[1]) << formula.minimised;
  }
}

}  // namespace
}  // namespace dpde::driver::bare_data
