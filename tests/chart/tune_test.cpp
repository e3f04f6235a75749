// SPDX-License-Identifier: Apache-2.0
// The choice of a method against a sweep of everything, with costs that are counted and not timed.
#include "chart/tune.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "chart/finer_runs.h"
#include "driver/pipeline.h"
#include "model/from_ast.h"

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
  explicit Scene(const char* name) {
    options.compile.selection.name = name;
    options.compile.backend = driver::Backend::jit;
    options.compile.cache = std::make_shared<KeepsAll>();
    options.samples = 1;
    options.sample_seconds = 0;
    std::string why;
    session = open(source, options, {}, why);
    EXPECT_NE(session, nullptr) << why;
  }
  const SourceFile source{"test.dpde", text};
  PointOptions options;
  std::unique_ptr<driver::Session> session;
};

/// Stages times the width of the stencil, half as much in single precision, and something for each step.
double counted(const Point& point) {
  const auto value = [&](const char* key, const char* otherwise) {
    const auto found = point.variant.method.find(key);
    return found == point.variant.method.end() ? std::string(otherwise) : found->second;
  };
  const std::string space = value("advect", value("lap", "central2").c_str());
  const double width = space == "central4" ? 1.3 : space == "upwind3" ? 1.6 : 1;
  const double stages = value("time", "rk4") == "rk4" ? 4 : 3;
  const double cell = stages * width * (value("real", "f64") == "f32" ? 0.5 : 1.0);
  return point.steps * (20 + cell * point.cells.front());
}

/// By every method, grid, step and precision.
std::vector<Point> swept(const Scene& scene) {
  std::vector<Point> points;
  const model::Problem& problem = scene.session->problem();
  for (auto method : methods_for(problem, {})) {
    for (const char* real : {"f64", "f32"}) {
      method["real"] = real;
      for (const double fraction : {0.9, 0.6, 0.3}) {
        for (double factor = 0.25; factor <= 2.01; factor *= std::sqrt(2.0))
          points.push_back(
              run_point(scene.source, scene.options, problem, {{method, cells_of(problem, factor)}, fraction}, {}));
      }
    }
  }
  std::erase_if(points, [](const Point& point) { return point.steps == 0; });
  return points;
}

TEST(Tune, ChoosesWhatASweepOfEverythingChoosesWithFewRuns) {
  for (const char* name : {"ring", "rod"}) {
    const Scene scene(name);
    const std::vector<Point> all = swept(scene);
    for (const double tolerance : {2e-2, 1e-3}) {
      double best = INFINITY;
      for (const Point& point : all) {
        if (is_complete(point) && point.error <= tolerance) best = std::min(best, counted(point));
      }
      TuneOptions options{scene.options, tolerance, 2};
      options.cost = counted;
      const Choice choice = tune(scene.source, options, scene.session->problem(), {}, {});
      ASSERT_TRUE(choice.chosen) << name << " " << tolerance;
      EXPECT_LE(choice.chosen->error, tolerance);
      EXPECT_LE(choice.chosen->seconds, 1.15 * best)
          << name << " " << tolerance << " " << method_text(choice.chosen->variant);
      EXPECT_LE(choice.tried, std::ssize(all) / 5) << name << " " << tolerance;
      EXPECT_EQ(choice.chosen->variant.method.at("real"), "f32");
    }
  }
}

/// On 8 cells, which hold none of the waves that the fourth derivative damps, all methods are unstable at every step.
TEST(Tune, GoesOnWhereTheCoarsestGridFails) {
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

}  // namespace
}  // namespace dpde::chart
