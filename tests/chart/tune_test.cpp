// SPDX-License-Identifier: Apache-2.0
// The choice of a method against a sweep of everything, with costs that are counted and not timed.
#include "chart/tune.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "chart/finer_runs.h"
#include "driver/compile/pipeline.h"
#include "model/from_ast.h"
#include "support/setting.h"

namespace dpde::chart {
namespace {

constexpr const char* text = R"(
model wind { field u; param c; dt(u) = -advect(c, u) }
model heat { field u; param k; dt(u) = k*lap(u) }
scheme plain { time = rk4 }
scene ring : wind with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  c = 1
  initial u = sin(x)
  exact u = sin(x - c*t)
  time 0 .. 1, step 1/32
}
scene rod : heat with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  k = 0.3
  initial u = sin(x) + 0.5*sin(3*x)
  exact u = exp(-k*t)*sin(x) + 0.5*exp(-9*k*t)*sin(3*x)
  time 0 .. 1, step 1/64
}
scene slow : heat with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  k = 0.3
  initial u = sin(x) + 0.5*sin(3*x)
  exact u = exp(-k*t)*sin(x) + 0.5*exp(-9*k*t)*sin(3*x)
  time 0 .. 1, step 1/4096
}
model drift { field u; dt(u) = -advect((1, 0.5), u) + 0.01*lap(u) }
scene sheet : drift with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  grid y = 0 .. 2*pi, cells 32, periodic
  initial u = sin(x)*cos(y)
  exact u = exp(-0.02*t)*sin(x - t)*cos(y - 0.5*t)
  time 0 .. 1, step 1/32
}
scene bump : heat with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  k = 0.3
  initial u = exp(cos(x))
  time 0 .. 1, step 1/64
}
model ks { field u; dt(u) = -0.5*dx(u^2) - lap(u) - lap(lap(u)) }
scheme waves { dx = spectral; lap = spectral; dealias = two_thirds; time = etdrk4 }
scene start : ks with waves {
  grid x = 0 .. 32*pi, cells 128, periodic
  initial u = cos(x/16)*(1 + sin(x/16))
  time 0 .. 20, step 0.25
}
)";

/// It keeps what it is given.
class KeepsAll : public codegen::CodeCache {
 public:
  std::optional<std::string> find(std::string_view key) override {
    const auto found = kept.find(std::string(key));
    return found == kept.end() ? std::nullopt : std::optional(found->second);
  }
  void store(std::string_view key, std::string_view code) override { kept[std::string(key)] = code; }
  std::map<std::string, std::string> kept;
};

/// Runs are not timed: what counts is `counted`.
struct Scene {
  explicit Scene(const char* name) : Scene({"test.dpde", text}, name) {}
  Scene(SourceFile file, const char* name) : source(std::move(file)) {
    options.compile.selection.name = name;
    options.compile.backend = driver::Backend::jit;
    options.compile.cache = std::make_shared<KeepsAll>();
    options.samples = 1;
    options.sample_seconds = 0;
    std::string why;
    session = open(source, options, {}, why);
    EXPECT_NE(session, nullptr) << why;
  }
  const SourceFile source;
  PointOptions options;
  std::unique_ptr<driver::Session> session;
};

/// Seconds of a machine that moves 16 GB and makes 8 G operations a second, 16 G in single precision, and takes 100 ns
/// for a sweep over the grid (S. Williams, A. Waterman and D. Patterson, Comm. ACM 52 (2009)).
double counted(const Point& point) {
  const auto real = point.variant.method.find("real");
  const double operations = real != point.variant.method.end() && real->second == "f32" ? 16e9 : 8e9;
  double cells = 1;
  for (const int count : point.cells) cells *= count;
  return point.steps * (1e-7 + cells * std::max(point.cost.bytes / 16e9, point.cost.flops / operations));
}

/// By every method, grid, step and precision.
std::vector<Point> swept(const Scene& scene, double most_cells, const References& references,
                         const std::vector<double>& fractions = {0.9, 0.6, 0.3}) {
  std::vector<Point> points;
  const model::Problem& problem = scene.session->problem();
  const double lowest = std::min(1.0, 8.0 / problem.axes.front().cells);
  for (auto method : methods_for(problem, {})) {
    for (const char* real : {"f64", "f32"}) {
      method["real"] = real;
      for (const double fraction : fractions) {
        for (double factor = lowest; factor <= 1.001 * most_cells; factor *= std::sqrt(2.0))
          points.push_back(run_point(scene.source, scene.options, problem,
                                     {{method, cells_of(problem, factor)}, fraction}, references));
      }
    }
  }
  std::erase_if(points, [](const Point& point) { return point.steps == 0; });
  return points;
}

struct Comparison {
  double ratio = 0;  // of what is chosen over the cheapest
  double runs = 0;   // of those of the sweep
};
Comparison compare(const Scene& scene, double most_cells, double tolerance, const std::vector<Point>& all,
                   const References& references) {
  double best = INFINITY;
  const Point* cheapest = nullptr;
  for (const Point& point : all) {
    if (!is_complete(point) || !(point.error <= tolerance) || !(counted(point) < best)) continue;
    best = counted(point);
    cheapest = &point;
  }
  TuneOptions options{scene.options, tolerance, most_cells};
  options.cost = counted;
  const Choice choice = tune(scene.source, options, scene.session->problem(), {}, references);
  if (!choice.chosen || cheapest == nullptr) {
    ADD_FAILURE() << "nothing is chosen";
    return {};
  }
  EXPECT_LE(choice.chosen->error, tolerance);
  const auto describe = [](const Point& point) {
    return fmt::format("{}, {} cells, {} steps", method_text(point.variant), point.cells.front(), point.steps);
  };
  const Comparison result{choice.chosen->seconds / best, static_cast<double>(choice.tried) / std::ssize(all)};
  fmt::print("{} {}: {}; cheapest {}; {:.2f} times its cost, {} of {} runs\n", scene.session->problem().scene,
             tolerance, describe(*choice.chosen), describe(*cheapest), result.ratio, choice.tried, all.size());
  return result;
}

TEST(Tune, ChoosesWhatASweepOfEverythingChoosesWithFewRuns) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: seven seconds";
  for (const char* name : {"ring", "rod"}) {
    const Scene scene(name);
    const std::vector<Point> all = swept(scene, 2, {});
    for (const double tolerance : {2e-2, 1e-3}) {
      const Comparison found = compare(scene, 2, tolerance, all, {});
      EXPECT_LE(found.ratio, 1.15) << name << " " << tolerance;
      EXPECT_LE(found.runs, 0.2) << name << " " << tolerance;
    }
  }
}

/// Where a rung of cells costs 2.8 times the one below it, steps between the longest and a third of it count.
TEST(Tune, ChoosesStepsOnTwoAxes) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: a sweep of two axes";
  const Scene scene("sheet");
  const std::vector<Point> all = swept(scene, 1, {}, {0.9, 0.75, 0.6, 0.45, 0.3});
  for (const double tolerance : {1e-3}) EXPECT_LE(compare(scene, 1, tolerance, all, {}).ratio, 1.15) << tolerance;
}

/// Crank-Nicolson's steps have no limit: those of the scene, a hundred times too short, are lengthened. The largest
/// error by steps is that of exp(-9 k t), k = 0.3: (9 k)^3 dt^2/12.
TEST(Tune, LengthensStepsWithoutALimit) {
  const Scene scene("slow");
  TuneOptions options{scene.options, 2e-2, 2};
  options.cost = counted;
  const Choice choice = tune(scene.source, options, scene.session->problem(), {{{"time", {"crank_nicolson"}}}}, {});
  ASSERT_TRUE(choice.chosen);
  EXPECT_LE(choice.chosen->error, 2e-2);
  EXPECT_GT(choice.chosen->step, 0.05);
}

/// A run that is broken off has no error: it is not told as one of 0.
TEST(Tune, TellsNoRunsThatWereBrokenOff) {
  const Scene scene("rod");
  std::atomic<bool> stop = false;
  TuneOptions options{scene.options, 1e-6, 2};
  options.cost = counted;
  options.point.stop = &stop;
  options.tell = [&](const std::string& what) { stop = what.find("rk4") != std::string::npos; };
  const Choice choice = tune(scene.source, options, scene.session->problem(), {}, {});
  EXPECT_FALSE(choice.chosen);
  ASSERT_FALSE(choice.runners_up.empty());
  for (const RunnerUp& other : choice.runners_up) {
    EXPECT_TRUE(!other.point.failure.empty() || is_complete(other.point)) << other.reason;
    EXPECT_EQ(other.reason.find("should take"), std::string::npos) << other.reason;
  }
}

/// Fractions that a person names are all that are tried.
TEST(Tune, TriesNoOtherFractionsThanThoseNamed) {
  const Scene scene("ring");
  TuneOptions options{scene.options, 1e-2, 2};
  options.cost = counted;
  const Choice choice = tune(scene.source, options, scene.session->problem(), {{{"time", {"rk4"}}}, {}, {}, {0.2}}, {});
  ASSERT_TRUE(choice.chosen);
  EXPECT_LE(choice.chosen->step, 0.2 * choice.chosen->largest_step);
}

/// Ten cases of the examples, at night; ChoosesWhatASweepOfEverythingChooses has four by day.
TEST(Tune, ComesNearASweepInNineOfTenCases) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: sweeps of five scenes";
  struct Case {
    const char *file, *scene;
    std::vector<double> tolerances;
  };
  const std::vector<Case> cases{{"burgers_1d/burgers", "front", {1e-2, 1e-4}},
                                {"advection/advection", "ring", {1e-2, 1e-4}},
                                {"heat/heat", "rod", {1e-3, 1e-5}},
                                {"burgers_1d/burgers", "ends", {1e-2, 1e-4}},
                                {"wave/wave", "string", {1e-1, 1e-2}}};
  int tried = 0, near = 0;
  for (const Case& one : cases) {
    const std::string path = fmt::format("{}/dsl-examples/{}.dpde", DPDE_SOURCE_DIR, one.file);
    std::ifstream file(path);
    std::stringstream content;
    content << file.rdbuf();
    const Scene scene({path, content.str()}, one.scene);
    References references;
    if (!scene.session->problem().states.front().exact) {
      std::string why;
      const auto made = make_reference(scene.source, scene.options, scene.session->problem(),
                                       {1, 8, one.tolerances.back() / 3, 100}, why);
      ASSERT_TRUE(made) << why;
      references.states = *made;
    }
    const std::vector<Point> all = swept(scene, 4, references);
    for (const double tolerance : one.tolerances) {
      const Comparison found = compare(scene, 4, tolerance, all, references);
      ++tried;
      near += found.ratio <= 1.15 ? 1 : 0;
      EXPECT_LE(found.runs, 0.2) << one.scene << " " << tolerance;
    }
  }
  EXPECT_GE(10 * near, 9 * tried) << near << " of " << tried;
}

/// On 8 cells, which hold none of the waves that the fourth derivative damps, all methods are unstable at every step.
TEST(Tune, GoesOnWhereTheCoarsestGridFails) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const Scene scene("start");
  std::string why;
  References references;
  const auto made = make_reference(scene.source, scene.options, scene.session->problem(), {1, 4, 1e-3, 100}, why);
  ASSERT_TRUE(made) << why;
  references.states = *made;
  TuneOptions options{scene.options, 1e-2, 2};
  options.cost = [](const Point& point) { return 1.0 * point.steps * point.cells.front(); };
  const Choice choice = tune(scene.source, options, scene.session->problem(), {}, references);
  ASSERT_TRUE(choice.chosen);
  EXPECT_LE(choice.chosen->error, 1e-2);
  for (const RunnerUp& other : choice.runners_up) EXPECT_EQ(other.reason.find("unstable"), std::string::npos);
}

/// What is resolved by waves alone is cut; differences are not asked to cut what they resolve.
TEST(Methods, OfDifferencesDoNotDealias) {
  const Scene scene("start");
  const model::Problem& problem = scene.session->problem();
  const auto methods = methods_for(problem, {});
  ASSERT_GT(methods.size(), 2u);
  for (const auto& method : methods) EXPECT_EQ(model::with_settings(problem.scheme, method).dealias, method.empty());
  const model::Scheme reference = model::with_settings(problem.scheme, most_accurate(problem));
  EXPECT_TRUE(reference.dealias) << "of Fourier series the reference is one too";
  EXPECT_EQ(reference.laplacian_order, model::spectral);
  EXPECT_FALSE(methods_for(Scene("rod").session->problem(), {}).back().contains("dealias"));
}

TEST(References, AreKeptAndNoFinerThanNeeded) {
  Scene scene("bump");
  const auto cache = std::make_shared<KeepsAll>();
  scene.options.compile.cache = cache;
  std::string why;
  const auto made = [&](double enough, double most) {
    return make_reference(scene.source, scene.options, scene.session->problem(), {1, most, enough, 100}, why);
  };
  const auto rough = made(1e-3, 8), fine = made(1e-9, 8);
  ASSERT_TRUE(rough && fine) << why;
  EXPECT_EQ(rough->text().find("a run on 2 times the cells"), 0u) << rough->text();
  EXPECT_EQ(fine->text().find("a run on 8 times the cells"), 0u) << fine->text();
  EXPECT_LT(fine->uncertainty(), 1e-8);
  // What is found under the key is what the reference is made of.
  int references = 0;
  for (auto& [key, bytes] : cache->kept) {
    if (!key.starts_with("reference of a chart")) continue;
    ++references;
    if (key.find("cells.x=64\n") != std::string::npos) bytes.assign(bytes.size(), '\0');
  }
  EXPECT_EQ(references, 4) << "on 32, 64, 128 and 256 cells";
  const auto again = made(1e-3, 2);
  ASSERT_TRUE(again);
  EXPECT_NE(again->text(), rough->text())
      << "runs that differ by half are no reference: the scene's own scheme makes it";
}

/// The box holds 26 of 64 cells, 52 of 128 and 102 of 256, where 25.6, 51.2 and 102.4 would be right: 64 and 128 cells
/// agree by chance, though the mass of both is off by 1.6 %.
TEST(References, OfJumpsAreNotTrustedWhereTwoGridsAgreeByChance) {
  const SourceFile file("test.dpde", R"(
model ade { field u; dt(u) = -advect(1, u) + 0.02*lap(u) }
scheme c { advect = central(2); lap = central(2); time = rk4 }
scene box : ade with c {
  grid x = 0 .. 1, cells 16, periodic
  initial u = if(abs(x - 0.5) < 0.2, 1, 0)
  time 0 .. 0.5, step 0.005
}
)");
  const Scene scene(file, "box");
  std::string why;
  for (const double most : {8.0, 16.0}) {
    const auto made = make_reference(scene.source, scene.options, scene.session->problem(), {1, most, 1e-3, 100}, why);
    ASSERT_TRUE(made) << why;
    EXPECT_GT(made->uncertainty(), most == 8 ? 52 / 51.2 - 1 : 1 - 102 / 102.4) << most;
  }
}

/// A reference is solved to the smallest tolerance, and a warning in the place of an error is none.
TEST(Sweep, ReferencesSolveExactly) {
  model::Scheme scheme;
  EXPECT_TRUE(exact_solves(scheme).empty());
  scheme.solve = {.tolerance = 1e-3, .most_iterations = 7, .warns = true};
  const auto exact = exact_solves(scheme);
  ASSERT_EQ(exact.size(), 1u);
  const SolveBy by = model::with_settings(scheme, exact).solve;
  EXPECT_EQ(by.tolerance, SolveBy{}.tolerance);
  EXPECT_EQ(by.most_iterations, SolveBy{}.most_iterations);
  EXPECT_FALSE(by.warns);
  EXPECT_EQ(by.method, scheme.solve.method);
  scheme.solve = {.tolerance = 1e-14};
  EXPECT_TRUE(exact_solves(scheme).empty()) << "smaller than that of references";
}

}  // namespace
}  // namespace dpde::chart
