// SPDX-License-Identifier: Apache-2.0
// Second derivatives by the weights of networks, layer by layer: Hessian products against differences of gradients, and
// against the Gauss-Newton matrix for zero residuals, in each back end; and their use in Newton's method.
#include <cmath>
#include <random>

#include "driver/scene/inverse.h"
#include "driver_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct NetworkLayers {
  const char *name, *items;
};
const NetworkLayers network_layers[] = {
    {"dense", "dense 4; tanh; dense out"},
    {"convolutions, tanh", "conv 3, 3; tanh; conv out, 3"},
    {"gelu", "conv 3, 5; gelu; conv out, 3"},
    {"silu", "conv 3, 3; silu; conv out, 1"},
    {"softplus, sigmoid", "conv 3, 3; softplus; conv 3, 3; sigmoid; conv out, 3"},
    {"relu", "conv 4, 3; relu; conv out, 3"},
    {"leaky_relu", "conv 4, 3; leaky_relu(0.1); conv out, 3"},
    {"no bias, groups, dilation", "conv 4, 3, bias = 0; tanh; conv 4, 3, groups = 2, dilation = 2; tanh; conv out, 3"},
    {"residual, scale", "conv 3, 3; residual { tanh; conv 3, 3 }; scale 0.5; tanh; conv out, 3"},
    {"mean_pool, upsample", "conv 3, 3; tanh; skip { mean_pool 2; conv 3, 3; tanh; upsample 2 }; conv out, 3"},
    {"max_pool", "conv 3, 3; tanh; skip { max_pool 2; conv 3, 3; tanh; upsample 2 }; conv out, 3"},
    {"stride", "conv 3, 3, stride = 2; tanh; upsample 2; conv out, 3"},
    {"symmetric", "symmetric flips; conv 3, 3; tanh; conv out, 3"},
};

std::string network_text(const NetworkLayers& row, const std::string& loss, const std::string& optimiser = "lbfgs()") {
  return std::string("network law(u, k) { initial he, seed 2; padding replicate; ") + row.items + R"( }
model m { field u; param k = 0.3; dt(u) = 0.02*lap(u) - u*dx(u) + k*law(u, k) }
scheme s { time = rk2; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 8
  boundary u: x.low = 0.1, x.high = zero_gradient
  initial u = sin(2*pi*x) + 0.2*law(x, k)
  time 0 .. 0.08, step 0.02
}
task t : r { )" +
         loss + "; using " + optimiser + ", iterations 8 }\n";
}

struct NetworkTask {
  SourceFile source;
  std::unique_ptr<driver::Session> session;
  std::unique_ptr<driver::Inverse> inverse;

  NetworkTask(const std::string& text, driver::Backend backend) : source("t.dpde", text) {
    driver::CompileOptions compile;
    compile.backend = backend;
    compile.tangent = compile.adjoint = compile.second = true;
    DiagnosticSink sink;
    session = driver::Session::open(source, compiled(source, compile), {}, sink);
    if (session) inverse = driver::Inverse::open(*session, source, sink);
    EXPECT_NE(inverse, nullptr) << all_messages(source, sink);
  }
  Eigen::VectorXd product(Curvature curvature, const Eigen::VectorXd& v) const {
    EXPECT_TRUE(inverse->has_products(curvature));
    Eigen::VectorXd result(v.size());
    inverse->product(inverse->start(), v, result, curvature);
    return result;
  }
  Eigen::VectorXd quotient(const Eigen::VectorXd& v, double step) const {
    Eigen::VectorXd ahead(v.size()), behind(v.size());
    inverse->value_and_gradient(inverse->start() + step * v, ahead);
    inverse->value_and_gradient(inverse->start() - step * v, behind);
    return (ahead - behind) / (2 * step);
  }
};

Eigen::VectorXd some_weights(Eigen::Index size) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Eigen::VectorXd v(size);
  for (double& one : v) one = normal(random);
  return v;
}

const std::string of_all = "learn law; unknown k; unknown initial u; minimise mean((u - 0.5)^2) + mean(law(u, 1)^2)";

TEST(NetworkSecondOrder, IsHowGradientsChange) {
  for (std::size_t number = 0; const NetworkLayers& row : network_layers) {
    if (!is_tried(number++, 2)) continue;
    const NetworkTask task(network_text(row, of_all), driver::Backend::jit);
    ASSERT_NE(task.inverse, nullptr) << row.name;
    const Eigen::VectorXd v = some_weights(task.inverse->size()), found = task.product(Curvature::full, v);
    double error = 1;
    for (const double step : {1e-5, 1e-6, 1e-7})  // larger steps may cross a kink
      error = std::min(error, (found - task.quotient(v, step)).norm() / found.norm());
    EXPECT_LT(error, 1e-7) << row.name;
  }
}

/// With zero residuals the curvature omitted by Gauss-Newton vanishes.
TEST(NetworkSecondOrder, OfGaussAndNewtonIsTheHessianWhereNothingIsLeft) {
  for (std::size_t number = 0; const NetworkLayers& row : network_layers) {
    if (!is_tried(number++, 4)) continue;
    const NetworkTask task(
        network_text(row,
                     "data d = u from scene r over time; learn law; unknown k; minimise mean((u - d)^2) over time"),
        driver::Backend::jit);
    ASSERT_NE(task.inverse, nullptr) << row.name;
    const Eigen::VectorXd v = some_weights(task.inverse->size()), full = task.product(Curvature::full, v);
    EXPECT_LT((full - task.product(Curvature::gauss_newton, v)).norm(), 1e-12 * full.norm()) << row.name;
    EXPECT_GT(full.norm(), 0) << row.name;
  }
}

TEST(NetworkSecondOrder, IsTheSameInEachBackEnd) {
  for (std::size_t number = 0; const NetworkLayers& row : network_layers) {
    const std::size_t own = number++;
    if (!is_tried(own, 5)) continue;
    const NetworkTask jit(network_text(row, of_all), driver::Backend::jit);
    const Eigen::VectorXd v = some_weights(jit.inverse->size());
    std::vector<driver::Backend> others{driver::Backend::interpreter};
    if (is_tried(own, 20)) others.push_back(driver::Backend::cpp);
    for (const driver::Backend backend : others) {
      const NetworkTask other(network_text(row, of_all), backend);
      for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
        const Eigen::VectorXd found = jit.product(curvature, v);
        EXPECT_LT((found - other.product(curvature, v)).norm(), 1e-12 * found.norm()) << row.name;
      }
    }
  }
}

/// Weights alone, together with parameters, and a network that is not trained.
TEST(NetworkSecondOrder, OfEachKindOfUnknown) {
  for (const char* const unknowns :
       {"learn law", "learn law; unknown k", "unknown k", "unknown initial u", "unknown k; unknown initial u"}) {
    const NetworkTask task(
        network_text(network_layers[1], std::string(unknowns) + "; minimise mean((u - 0.5)^2) + mean(law(u, 1)^2)"),
        driver::Backend::jit);
    const Eigen::VectorXd v = some_weights(task.inverse->size()), found = task.product(Curvature::full, v);
    EXPECT_LT((found - task.quotient(v, 1e-5)).norm(), 1e-7 * found.norm()) << unknowns;
  }
}

/// The model around a network, and its position in it.
struct NetworkPlace {
  const char *name, *equation, *more = "", *scheme = "time = rk2", *initial = "u = sin(2*pi*x)";
  const char *loss = "mean((u - 0.5)^2)", *time = "0 .. 0.06, step 0.02";
};
const NetworkPlace network_places[] = {
    {"an equation", "0.02*lap(u) + law(u, k)"},
    {"a product of calls", "0.02*lap(u) + law(u, u) + law(u, k)*law(k, u)"},
    {"an argument", "law(law(u, k), u)"},
    {"inside a derivative", "dx(law(u, dx(u)) + k*u)"},
    {"a mean", "0.02*lap(u) + mean(law(u, k)^2)"},
    {"a branch", "0.02*lap(u) + max(law(u, k), 0.1*u)"},
    {"an event", "0.02*lap(u)", "after step: u += 0.1*law(u, k)"},
    {"an event of some steps", "0.02*lap(u)", "every 0.04: u += 0.1*law(u, k)"},
    {"implicit steps", "0.02*lap(u) + 0.1*law(u, k)", "", "time = backward_euler"},
    {"mixed steps", "0.02*lap(u) + law(u, k)", "", "time = ars222"},
    {"split steps", "0.02*lap(u) + law(u, k)", "", "time = rk2; split = strang(diffusion, sources)"},
    {"a scheme with a memory", "0.02*lap(u) + law(u, k)", "", "time = ab2"},
    {"exponential steps", "0.02*lap(u) + law(u, k)", "", "time = etdrk2; lap = spectral"},
    {"steps under a tolerance", "0.02*lap(u) + law(u, k)", "", "time = bs32", "u = sin(2*pi*x)", "mean((u - 0.5)^2)",
     "0 .. 0.06, step 0.02, tolerance 1e-6"},
    {"a steady state", "lap(u) - u + law(u, k) + 1", "", "time = rk2", "u = sin(2*pi*x)", "mean((u - 0.5)^2)",
     "0 .. 40, step 0.002, until steady 1e-10"},
    {"an initial state", "0.02*lap(u)", "", "time = rk2", "u = law(x, k)"},
    {"a loss", "0.02*lap(u) + k*u", "", "time = rk2", "u = sin(2*pi*x)", "mean((law(u, k) - 0.5)^2)"},
    {"a loss that is no sum of squares", "0.02*lap(u) + law(u, k)", "", "time = rk2", "u = sin(2*pi*x)", "mean(u^4)"},
};

/// Symmetric on all grids, and a third-order remainder of the loss.
TEST(NetworkSecondOrder, IsCertifiedInEachPlace) {
  std::size_t number = 0;
  for (const NetworkPlace& place : network_places) {
    if (!is_tried(number++, 5)) continue;
    SCOPED_TRACE(place.name);
    expect_certified(
        std::string("network law(u, k) { initial he, seed 2; padding replicate; conv 3, 3; tanh; conv out, 3 }\n"
                    "model m { field u; param k = 0.3; dt(u) = ") +
            place.equation + " }\nscheme s { networks = f64; " + place.scheme +
            " }\nscene r : m with s {\n  grid x = 0 .. 1, cells 7, periodic\n  initial " + place.initial + "\n  time " +
            place.time + "\n  " + place.more + "\n}\ntask t : r { learn law; unknown k; minimise " + place.loss +
            " }\n",
        true);
  }
}

TEST(NetworkSecondOrder, OfAnyNumberOfStoredStates) {
  const SourceFile source("t.dpde", network_text(network_layers[1], of_all));
  driver::CompileOptions compile;
  compile.backend = driver::Backend::jit;
  compile.tangent = compile.adjoint = compile.second = true;
  const auto scene = compiled(source, compile);
  std::vector<Eigen::VectorXd> found;
  for (const int slots : {0, 1, 2}) {
    driver::SessionOptions options;
    options.slots = slots;
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, scene, options, sink);
    const auto inverse = driver::Inverse::open(*session, source, sink);
    found.emplace_back(inverse->size());
    inverse->product(inverse->start(), some_weights(inverse->size()), found.back(), Curvature::full);
  }
  EXPECT_EQ(found[0], found[1]);
  EXPECT_EQ(found[0], found[2]);
}

}  // namespace
}  // namespace dpde::testing
