// SPDX-License-Identifier: Apache-2.0
// Curvilinear coordinates: orders against exact solutions on the disc, the sphere and a metric of the scene, poles,
// conservation, and means.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;

const std::string scheme = "scheme s { advect = central(2); dx = central(2); lap = central(2); time = rk4 }\n";

/// Order of the named field between `cells` along y (or x of r) and twice as many.
double order(const std::string& text, const std::string& field, Overrides coarse, Overrides fine) {
  const double of_coarse = run_scene(text, "s", coarse).l2.at(field), of_fine = run_scene(text, "s", fine).l2.at(field);
  EXPECT_GT(of_fine, 1e-12) << text;
  return std::log2(of_coarse / of_fine);
}

/// The largest difference of a state from the values in `wanted`, x fastest.
double distance(const std::vector<double>& state, const std::vector<double>& wanted) {
  double largest = 0;
  for (std::size_t i = 0; i < state.size(); ++i) largest = std::max(largest, std::abs(state[i] - wanted[i]));
  return largest;
}

const std::string on_disc = R"(scene s : m with s {
  coordinates polar
  grid r = 0 .. 1, cells 12
  grid theta = 0 .. 2*pi, cells 16, periodic
)";
const std::string on_sphere = R"(scene s : m with s {
  coordinates sphere(2)
  grid lon = 0 .. 2*pi, cells 16, periodic
  grid lat = -pi/2 .. pi/2, cells 8
)";

/// J_1(k r) cos(theta), k its first root, by its series.
TEST(Coordinates, BesselModesOfADiscDecay) {
  std::string series = "1", term = "1";
  const double k = 3.8317059702075125;
  double factor = 1;
  for (int n = 1; n <= 14; ++n) {
    factor *= -k * k / 4 / (n * (n + 1.0));
    series += fmt::format(" + ({:.17g})*r^{}", factor, 2 * n);
  }
  const std::string mode = fmt::format("r*cos(theta)*({})", series);
  const std::string text = "model m { field u; dt(u) = lap(u) }\n" + scheme + on_disc +
                           "  boundary u: r.low = pole, r.high = 0\n  initial u = " + mode +
                           fmt::format("\n  exact u = exp(-{:.17g}*t)*", k * k) + mode +
                           "\n  time 0 .. 1/64, step 1/65536\n}\n";
  const Overrides coarse{{"cells.x", "8"}, {"cells.y", "16"}}, fine{{"cells.x", "16"}, {"cells.y", "32"}};
  EXPECT_NEAR(order(text, "u", coarse, fine), 2, 0.15);
}

/// lap Y = -l (l + 1)/a^2 Y with l = 3, m = 2; and a uniform field, which stays.
TEST(Coordinates, HarmonicsOfASphereDecay) {
  const std::string mode = "cos(lat)^2*sin(lat)*cos(2*lon)";
  const std::string text = "model m { field u; dt(u) = lap(u) }\n" + scheme + on_sphere +
                           "  boundary u: lat = pole\n  initial u = 1 + " + mode + "\n  exact u = 1 + exp(-3*t)*" +
                           mode + "\n  time 0 .. 1/16, step 1/16384\n}\n";
  const Overrides coarse{{"cells.x", "16"}, {"cells.y", "8"}}, fine{{"cells.x", "32"}, {"cells.y", "16"}};
  EXPECT_NEAR(order(text, "u", coarse, fine), 2, 0.2);
}

/// A constant vector field has different components at each point in polar coordinates. It must stay, also if it
/// advects itself across the pole.
class ConstantVectors : public ::testing::TestWithParam<std::pair<int, int>> {};
TEST_P(ConstantVectors, Stay) {
  const auto [of_dx, of_lap] = GetParam();
  const std::string text = "model m { vector u; dt(u) = lap(u) - advect(u, u) }\n" +
                           fmt::format(
                               "scheme s {{ advect = central(2); dx = central({}); lap = central({}); "
                               "time = rk4 }}\n",
                               of_dx, of_lap) +
                           R"(
scene s : m with s {
  coordinates polar
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 2*pi, cells 8, periodic
  boundary u: r.low = pole, r.high = (cos(y), -sin(y))
  initial u = (cos(theta), -sin(theta))
  exact u = (cos(theta), -sin(theta))
  time 0 .. 1/64, step 1/65536
}
)";
  const Overrides coarse{{"cells", "8"}}, fine{{"cells", "16"}};
  EXPECT_GT(order(text, "u.x", coarse, fine), 1.7);
  EXPECT_GT(order(text, "u.y", coarse, fine), 1.7);
}
INSTANTIATE_TEST_SUITE_P(OfOrders, ConstantVectors,
                         ::testing::Values(std::pair(2, 2), std::pair(2, 4), std::pair(4, 2), std::pair(4, 4)));

/// For (sin(Y), sin(X)), X = r*cos(theta), Y = r*sin(theta), the vector Laplacian is the negative field. It has the
/// scheme's order away from walls, and order 2 next to a pole.
TEST(Coordinates, VectorLaplaciansHaveTheOrderOfTheScheme) {
  const auto text = [](int order, const char* from, const char* inner) {
    return fmt::format(
        R"(model m {{ vector u; field q; dt(u) = 0; dt(q) = if(r > {2} and r < {1} + 0.8, lap(u).x + u.x, 0) }}
scheme s {{ dx = central({0}); lap = central({0}); time = rk4 }}
scene s : m with s {{
  coordinates polar
  grid r = {1} .. {1} + 1, cells 16
  grid theta = 0 .. 2*pi, cells 64, periodic
  boundary u: r.low = {3}, r.high = linear
  boundary q: r.low = {4}, r.high = zero_gradient
  initial u = (cos(theta)*sin(r*sin(theta)) + sin(theta)*sin(r*cos(theta)),
               cos(theta)*sin(r*cos(theta)) - sin(theta)*sin(r*sin(theta)))
  initial q = 0
  exact q = 0
  time 0 .. 1, step 1
}}
)",
        order, from, inner, *from == '0' ? "pole" : "linear", *from == '0' ? "pole" : "zero_gradient");
  };
  const Overrides coarse{{"cells.x", "16"}, {"cells.y", "64"}}, fine{{"cells.x", "32"}, {"cells.y", "128"}};
  for (const int exact : {2, 4}) {
    EXPECT_NEAR(order(text(exact, "1", "1.2"), "q", coarse, fine), exact, 0.3) << exact;
    EXPECT_NEAR(order(text(exact, "0", "0.3"), "q", coarse, fine), exact, 0.3) << exact;
    EXPECT_GT(order(text(exact, "0", "0"), "q", coarse, fine), exact == 2 ? 1.7 : 2.7) << exact;
  }
}

/// Solid rotation has no strain: the vector Laplacian is only the curvature term of the sphere, div is 0 and curl is
/// twice the rotation rate.
TEST(Coordinates, OperatorsOfSolidRotation) {
  const std::string text = R"(model m {
  vector u
  field q, w
  dt(u) = lap(u) + u/4
  dt(q) = div(u)
  dt(w) = curl(u) - sin(lat)
}
)" + scheme + on_sphere + R"(  boundary u: lat = pole
  boundary q: lat = pole
  boundary w: lat = pole
  initial u = (cos(lat), 0)
  exact u = (cos(lat), 0)
  initial q = 0
  initial w = 0
  exact w = 0
  time 0 .. 1/64, step 1/16384
}
)";
  const Overrides coarse{{"cells.x", "16"}, {"cells.y", "8"}}, fine{{"cells.x", "32"}, {"cells.y", "16"}};
  EXPECT_NEAR(order(text, "u.x", coarse, fine), 2, 0.2);
  EXPECT_NEAR(order(text, "w", coarse, fine), 2, 0.3);
  const auto result = run_scene(text, "s");
  EXPECT_LT(distance(result.state.at("u.y"), std::vector<double>(128, 0.0)), 1e-13);
  EXPECT_LT(distance(result.state.at("q"), std::vector<double>(128, 0.0)), 1e-13);
}

/// The outflow of a cell enters the next one, and nothing flows through a pole.
TEST(Coordinates, FluxesAreConserved) {
  const std::string text = "model m { field u; coefficient vector v; dt(u) = div(0.01*grad(u) - v*u) }\n" + scheme +
                           on_sphere + R"(  v = (sin(lat)*cos(lon), -sin(lon) + 0.3*cos(lat))
  boundary u: lat = pole
  initial u = 1 + 0.3*sin(lon + 1)*cos(lat) + lat^2
  time 0 .. 1/2, step 1/256
}
)";
  const auto sum = [](const std::vector<double>& u) {
    double sum = 0;
    for (std::size_t i = 0; i < u.size(); ++i)
      sum += u[i] * std::cos(-M_PI / 2 + (static_cast<double>(i / 16) + 0.5) * M_PI / 8);
    return sum;
  };
  const auto begin = run_scene(text, "s", {{"end", "1/256"}}).state.at("u"), end = run_scene(text, "s").state.at("u");
  EXPECT_GT(distance(begin, end), 0.1);
  EXPECT_NEAR(sum(begin), sum(end), 1e-13 * sum(end));
}

/// Cells are weighted by volume: the mean of 1 is 1, the integral the area to order 2; along one axis by length.
TEST(Coordinates, MeansWeighVolumes) {
  const std::string text = R"(model m {
  field a, b, c, d
  dt(a) = mean(1 + 0*a)
  dt(b) = integral(1 + 0*b)/(16*pi)
  dt(c) = mean(sin(lat)^2 + 0*c)
  dt(d) = integral(1 + 0*d, lon)/(4*pi*cos(lat))
}
)" + scheme + on_sphere + R"(  boundary a: lat = pole
  boundary b: lat = pole
  boundary c: lat = pole
  boundary d: lat = pole
  initial a = 0
  initial b = 0
  initial c = 0
  initial d = 0
  time 0 .. 1, step 1
}
)";
  const auto state = run_scene(text, "s").state;
  EXPECT_NEAR(state.at("a").front(), 1, 1e-15);
  EXPECT_NEAR(state.at("b").front(), 1, 0.01);
  EXPECT_NEAR(state.at("c").front(), 1.0 / 3, 0.01);
  EXPECT_NEAR(state.at("d").front(), 1, 1e-14);
}

/// Bit-identical to polar coordinates, as the formula is the same.
TEST(Coordinates, AnyOrthogonalMetricCanBeGiven) {
  const std::string model = "model m { field u; dt(u) = lap(u) - advect((0.1, r), u) }\n";
  std::string text = model + scheme + on_disc + R"(  boundary u: r.low = pole, r.high = zero_gradient
  initial u = r*cos(theta) + r^2
  time 0 .. 1/256, step 1/16384
}
)";
  const auto polar = run_scene(text, "s").state.at("u");
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"coordinates polar", "coordinates metric(1, x)"},
                                 {"(0.1, r)", "(0.1, x)"},
                                 {"grid r", "grid x"},
                                 {"grid theta", "grid y"},
                                 {"u: r.low", "u: x.low"},
                                 {", r.high", ", x.high"},
                                 {"r*cos(theta) + r^2", "x*cos(y) + x^2"}})
    text.replace(text.find(from), from.size(), to);
  EXPECT_EQ(distance(run_scene(text, "s").state.at("u"), polar), 0);
}

/// Slopes at walls are per length: u = theta in half a ring, and log(r) across it.
TEST(Coordinates, SlopesAtWallsAreOfLengths) {
  const std::string text = "model m { field u; dt(u) = lap(u) }\n" + scheme + R"(
scene s : m with s {
  coordinates polar
  grid r = 1 .. 2, cells 8
  grid theta = 0 .. 3, cells 8
  boundary u: r.low = gradient(-1), r.high = gradient(1/2), theta.low = gradient(-1/r), theta.high = 3 + log(r)
  initial u = theta + log(r)
  exact u = theta + log(r)
  time 0 .. 1/16, step 1/4096
}
)";
  EXPECT_NEAR(order(text, "u", {{"cells", "8"}}, {{"cells", "16"}}), 2, 0.3);
}

/// In three dimensions lap of r^2 is 4 + 2, up to the axis of symmetry.
TEST(Coordinates, CylindersAreSymmetricAboutAnAxis) {
  const std::string text = "model m { field u, total; dt(u) = lap(u); dt(total) = integral(1 + 0*u) }\n" + scheme + R"(
scene s : m with s {
  coordinates cylinder
  grid r = 0 .. 2, cells 8
  grid y = 0 .. 1, cells 8
  boundary u: r.low = zero_gradient, r.high = gradient(4), y.low = 6*t + r^2, y.high = 1 + r^2 + 6*t
  boundary total = 0
  initial u = r^2 + y^2
  exact u = r^2 + y^2 + 6*t
  initial total = 0
  time 0 .. 1/16, step 1/4096
}
)";
  EXPECT_NEAR(order(text, "u", {{"cells", "8"}}, {{"cells", "16"}}), 2, 0.3);
  EXPECT_NEAR(run_scene(text, "s").state.at("total").front(), 4 * M_PI / 16, 1e-12);
}

/// A hill is advected over both poles and back (Williamson et al. 1992, case 1): the error is within a third of that of
/// a turn along the equator.
TEST(Coordinates, PolesLeaveNoMark) {
  const std::string hill = "exp(-12*(1 - cos(lat)*cos(lon - 3*pi/2)))";
  const std::string text = "model m { field u; coefficient vector v; param tilt; dt(u) = -advect(v, u) }\n" + scheme +
                           "scene s : m with s {\n  coordinates sphere(1)\n  grid lon = 0 .. 2*pi, cells 48, "
                           "periodic\n  grid lat = -pi/2 .. pi/2, cells 24\n  tilt = pi/2\n  v = "
                           "(cos(lat)*cos(tilt) + sin(lat)*cos(lon)*sin(tilt), -sin(lon)*sin(tilt))\n  boundary u: "
                           "lat = pole\n  initial u = " +
                           hill + "\n  exact u = " + hill + "\n  time 0 .. 2*pi, step 2*pi/2048\n}\n";
  const Overrides over{{"advect", "upwind(3)"}};
  Overrides along = over;
  along["tilt"] = "0";
  const double over_poles = run_scene(text, "s", over).l2.at("u"), on_equator = run_scene(text, "s", along).l2.at("u");
  EXPECT_LT(over_poles, 1.33 * on_equator);
  EXPECT_LT(over_poles, 0.03);
}

/// Implicit steps have no limit from the pole.
TEST(Coordinates, ImplicitStepsCrossThePole) {
  const std::string mode = "cos(lat)^2*sin(lat)*cos(2*lon)";
  const std::string text = "model m { field u; dt(u) = lap(u) }\nscheme s { lap = central(2); time = ars222 }\n" +
                           on_sphere + "  boundary u: lat = pole\n  initial u = " + mode + "\n  exact u = exp(-3*t)*" +
                           mode + "\n  time 0 .. 1/4, step 1/64\n}\n";
  const Overrides coarse{{"cells.x", "16"}, {"cells.y", "8"}}, fine{{"cells.x", "32"}, {"cells.y", "16"}};
  EXPECT_NEAR(order(text, "u", coarse, fine), 2, 0.2);
}

/// Solves cannot read the cell half a turn away: such an equation is an error instead of a wrong solution.
TEST(Coordinates, SolvesDoNotReadAcrossPoles) {
  const auto fails = [](const std::string& rate, const std::string& settings) {
    const std::string text = "model m { field u; dt(u) = " + rate +
                             " }\nscheme s { dx = central(2); lap = central(2); " + settings + " }\n" + on_sphere +
                             "  boundary u: lat = pole\n  initial u = 1\n  time 0 .. 1, step 1/8\n}\n";
    const SourceFile source("test.dpde", text);
    DiagnosticSink sink;
    driver::compile(source, {.selection = {"s"}, .backend = std::nullopt}, sink);
    return sink.has_errors();
  };
  EXPECT_FALSE(fails("lap(u)", "time = ars222"));
  EXPECT_FALSE(fails("div((2 + sin(lon))*grad(u)) - u^3", "time = ars222; implicit = all"));
  EXPECT_TRUE(fails("lap(u) - advect((0, 1), u)", "advect = upwind(1); time = ars222; implicit = all"));
  EXPECT_TRUE(fails("lap(u) - dy(u)", "time = ars222; implicit = all"));
}

/// Shallow water on faces: flow over both poles conserves mass and energy up to the time-stepping error.
TEST(Coordinates, TurningTakesNoEnergy) {
  const std::string text = R"(model m {
  vector u on faces
  field h
  let flux = interpolate(h)*u
  dt(u) = -cross((curl(u) + 2*sin(lat))/interpolate(h), flux) - grad(h + 0.5*dot(u, u))
  dt(h) = -div(flux)
}
)" + scheme + on_sphere + R"(  boundary u.x: lat = pole
  boundary u.y: lat = 0
  boundary h: lat = pole
  initial u = (0.3*sin(lat)*cos(lon) + 0.1*cos(lat), 0.2*cos(lat)^2 - 0.3*sin(lon))
  initial h = 1 + 0.1*cos(lat)*sin(lon + lat)
  time 0 .. 1, step 1/512
}
)";
  const auto cosine = [](double row) { return std::cos(-M_PI / 2 + row * M_PI / 8); };
  const auto sums = [&](const Overrides& over) {
    const auto state = run_scene(text, "s", over).state;
    const std::vector<double>&h = state.at("h"), &x = state.at("u.x"), &y = state.at("u.y");
    double depth = 0, energy = 0;
    for (std::size_t j = 0; j < 8; ++j) {
      const double row = static_cast<double>(j), here = cosine(row + 0.5);
      for (std::size_t i = 0; i < 16; ++i) {
        const std::size_t cell = 16 * j + i, west = 16 * j + (i + 15) % 16;
        const double south = j == 0 ? 0 : y[cell - 16] * y[cell - 16] * cosine(row);
        const double north = j == 7 ? 0 : y[cell] * y[cell] * cosine(row + 1);
        const double moved = 0.25 * ((x[cell] * x[cell] + x[west] * x[west]) * here + south + north);
        depth += here * h[cell];
        energy += h[cell] * moved + 0.5 * here * h[cell] * h[cell];
      }
    }
    return std::array{depth, energy};
  };
  const auto begin = sums({{"end", "1/512"}}), end = sums({});
  EXPECT_NEAR(begin[0], end[0], 1e-13 * end[0]);
  EXPECT_NEAR(begin[1], end[1], 1e-10 * end[1]);
}

/// Balanced solid rotation across both poles (Williamson et al. 1992, case 2) has order 2, and its error after five
/// days is less than five times that of one day.
TEST(Coordinates, BalancedRotationStays) {
  const std::string text = testing::read_file(std::string(DPDE_SOURCE_DIR) + "/dsl-examples/sphere/sphere.dpde");
  const auto error = [&](const char* x, const char* y, const char* step, const char* end) {
    return run_scene(text, "rotation", {{"cells.x", x}, {"cells.y", y}, {"step", step}, {"end", end}}).l2.at("h");
  };
  const double coarse = error("16", "8", "600", "86400"), fine = error("32", "16", "300", "86400");
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.25);
  EXPECT_LT(error("32", "16", "300", "432000"), 2.6 * fine);
}

}  // namespace
}  // namespace dpde
