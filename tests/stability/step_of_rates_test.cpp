// SPDX-License-Identifier: Apache-2.0
// Steps that are functions of L: factors from the eigenvalues of L equal the eigenvalues of each step, which are not
// computed. Commuting matrices are made triangular once for all waves.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>
#include <tuple>

#include "driver/compile/pipeline.h"
#include "stability/eigenvalues/eigenvalues.h"
#include "stability/equations.h"
#include "stability/frozen/one_moment.h"
#include "stability/step_limit.h"
#include "stability/waves/roots.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stability {
namespace {

using model::time_method;
using model::TimeScheme;

TEST(StabilityPolynomial, IsOfTheScheme) {
  const std::vector<std::pair<TimeScheme, std::vector<double>>> known{
      {time_method("euler"), {1, 1}},
      {time_method("rk2"), {1, 1, 1.0 / 2}},
      {time_method("ssp_rk3"), {1, 1, 1.0 / 2, 1.0 / 6}},
      {time_method("ssp_rk43"), {1, 1, 1.0 / 2, 1.0 / 6, 1.0 / 48}},
      {time_method("bs32"), {1, 1, 1.0 / 2, 1.0 / 6}},
      {time_method("rk4"), {1, 1, 1.0 / 2, 1.0 / 6, 1.0 / 24}},
      {time_method("dopri5"), {1, 1, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120, 1.0 / 600}}};
  for (const auto& [time, expected] : known) {
    const std::vector<double> found = stencil::stability_polynomial(time);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], 1e-14) << i;
  }
  for (const TimeScheme other :
       {time_method("ab3"), time_method("verlet"), time_method("crank_nicolson"), time_method("etdrk4")})
    EXPECT_TRUE(stencil::stability_polynomial(other).empty());
}

/// Roots that lie apart, that are one, and that are 0: the polynomial is that of its roots.
TEST(Roots, AreThoseOfTheirPolynomial) {
  using Complex = std::complex<double>;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3000; ++i) {
    std::array<Complex, 3> known;
    for (Complex& root : known) root = std::exp(6 * normal(random) * (i % 2)) * Complex(normal(random), normal(random));
    if (i % 5 == 0) known[1] = known[0];
    if (i % 15 == 0) known[2] = known[0];
    if (i % 7 == 0) known[2] = 0;
    if (i % 21 == 0) known[1] = 0;
    const auto [a, b, c] = known;
    const std::array<Complex, 3> cubic{-a * b * c, a * b + b * c + c * a, -(a + b + c)};
    const std::array<Complex, 2> quadratic{a * b, -(a + b)};
    const double size = std::max({std::abs(a), std::abs(b), std::abs(c)});
    // Where n roots are one, rounding is under the root of order n.
    const double rounding = size * (i % 15 == 0 ? 1e-4 : i % 5 == 0 || i % 21 == 0 ? 1e-6 : 1e-8);
    for (const Complex& root : known) {
      const auto found = roots_of(cubic);
      EXPECT_LT(std::abs(*std::ranges::min_element(found, {}, [&](Complex x) { return std::abs(x - root); }) - root),
                rounding)
          << i;
    }
    for (const Complex& root : {a, b}) {
      const auto found = roots_of(quadratic);
      EXPECT_LT(std::min(std::abs(found[0] - root), std::abs(found[1] - root)), rounding) << i;
    }
    EXPECT_EQ(roots_of(std::array<Complex, 1>{-a})[0], a);
  }
}

Eigen::MatrixXd random_matrix(int size, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(size, size, [&] { return normal(random); });
}

/// Also with other units for each state.
TEST(CommonDiagonals, AreEigenvaluesOfSumsOfWhatCommutes) {
  std::mt19937_64 random(7);
  for (const int size : {3, 5, 16}) {
    const Eigen::MatrixXd a = random_matrix(size, random), one = Eigen::MatrixXd::Identity(size, size);
    std::vector<Eigen::MatrixXd> matrices{a, 1e4 * one, 0.3 * a * a - 2 * one, -1e-3 * a};
    Eigen::VectorXd units(size);
    for (int i = 0; i < size; ++i) units[i] = std::exp2(7 * i % 20 - 10);
    for (Eigen::MatrixXd& matrix : matrices)
      matrix = (units.asDiagonal() * matrix * units.cwiseInverse().asDiagonal()).eval();
    const auto diagonals = common_diagonals(matrices);
    ASSERT_TRUE(diagonals) << size;
    const Eigen::VectorXcd sum = diagonals->col(0) - 2 * diagonals->col(2) + diagonals->col(3);
    const Eigen::VectorXcd direct = eigenvalues(Eigen::MatrixXd(matrices[0] - 2 * matrices[2] + matrices[3]));
    for (const std::complex<double> value : sum)
      EXPECT_LT((direct.array() - value).abs().minCoeff(), 1e-9 * direct.cwiseAbs().maxCoeff()) << size;
  }
}

TEST(CommonDiagonals, AreNoneOfOtherMatrices) {
  std::mt19937_64 random(8);
  for (const int size : {3, 8}) {
    const Eigen::MatrixXd a = random_matrix(size, random);
    Eigen::MatrixXd other = Eigen::MatrixXd::Identity(size, size);
    EXPECT_TRUE(common_diagonals({a, other}));
    other(1, 1) += 1e-6;
    EXPECT_FALSE(common_diagonals({a, other}));
  }
}

/// A periodic scene s about a state that is the same everywhere.
struct System {
  driver::Compiled compiled;
  LinearStep linear;
  Equations equations;
  FrozenPoint point;
  int rank;

  FrozenAnalysis by_rates(double step = 0.1) const {
    return FrozenAnalysis::make(linear, point, rank, step, &equations).value();
  }
};

System system_of(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message << "\n" << text;
  std::string why;
  std::optional<LinearStep> linear =
      LinearStep::make(at_one_moment(compiled.value().stencil, 0), compiled->step_name(), why);
  EXPECT_EQ(why, "");
  FrozenPoint point{{}, {}, {{"hx", 1}, {"hy", 1}, {"t", 1e6}}};
  for (const std::string& state : linear->states()) point.fields[state] = {0.5};
  for (const model::Parameter& param : compiled->problem->params) point.params[param.name] = param.value;
  const int rank = static_cast<int>(compiled->problem->axes.size());
  Equations equations(*compiled->problem);
  return {std::move(*compiled), std::move(linear).value(), std::move(equations), std::move(point), rank};
}

/// Reactions between all, products of fields, and diffusion that is another one of each field where `differ`.
std::string species(int count, const std::string& scheme, bool differ, int rank, unsigned seed,
                    const std::string& more = "") {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> number(-0.3, 0.3);
  std::string fields, equations, initial;
  for (int i = 0; i < count; ++i) {
    fields += fmt::format("field c{}; ", i);
    initial += fmt::format("  initial c{} = 0.5\n", i);
    equations += fmt::format("  dt(c{0}) = {1}*lap(c{0}) - {2}*c{0}", i, differ ? 0.4 + 0.1 * i : 0.4, 0.5);
    if (differ) equations += fmt::format(" - advect({}, c{})", rank == 1 ? "0.3" : "(0.3, -0.2)", i);
    for (int k = 0; k < count; ++k) equations += fmt::format(" + {:.3f}*c{}*c{}", number(random), i, k);
    equations += "\n";
  }
  std::string text =
      "model m { " + fields + "\n" + equations + "}\nscheme q { " + scheme + " }\nscene s : m with q {\n";
  for (int axis = 0; axis < rank; ++axis) text += fmt::format("  grid {} = 0 .. 64, cells 64, periodic\n", "xyz"[axis]);
  return text + initial + more + "  time 0 .. 1, step 0.1\n}\n";
}

/// As sets: each takes the nearest that is left.
void expect_same(const Eigen::VectorXcd& found, const Eigen::VectorXcd& expected, double tolerance,
                 const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  std::vector<std::complex<double>> left(expected.begin(), expected.end());
  for (const std::complex<double> value : found) {
    const auto nearest = std::ranges::min_element(left, {}, [&](const auto& g) { return std::abs(g - value); });
    EXPECT_LE(std::abs(*nearest - value), tolerance) << what;
    left.erase(nearest);
  }
}

/// The factors that waves are judged by are the eigenvalues of the step: at that which is found to grow most, and at
/// others, long and short ones and those along one axis.
void expect_factors_of_step(const System& system, const FrozenAnalysis& analysis, double step,
                            const std::string& text) {
  const Amplification g(*system.linear.response(system.point, step), system.rank);
  for (const Angles& angles : {analysis.excess(step).angles, Angles{}, Angles{0, 1, 0}, Angles{1, 0, 0},
                               Angles{0.01, 0.02, 0}, Angles{0.4, -1, 0}, Angles{3, 2, 0}, Angles{M_PI, M_PI, 0}}) {
    const Eigen::VectorXcd expected = g.eigenvalues(angles);
    expect_same(analysis.factors(angles, step), expected, 1e-8 * (1 + expected.cwiseAbs().maxCoeff()),
                fmt::format("step {} angles {} {}\n{}", step, angles[0], angles[1], text));
  }
}

void expect_as_by_steps(const System& system, const std::string& text) {
  const FrozenAnalysis analysis = system.by_rates();
  for (const double step : {0.05, 0.3, 0.8, 2.0}) {
    ASSERT_TRUE(analysis.is_of_rates(step)) << text;
    EXPECT_FALSE(Amplification(*system.linear.response(system.point, step), system.rank).has_common_basis());
    expect_factors_of_step(system, analysis, step, text);
  }
}

TEST(StepOfRates, IsAsByTheEigenvaluesOfTheStep) {
  unsigned seed = 1;
  for (const std::string time : {"euler", "rk2", "ssp_rk3", "rk4", "ab2", "ab3", "leapfrog"}) {
    for (const bool differ : {false, true}) {
      for (const int rank : {1, 2}) {
        const std::string text = species(3 + static_cast<int>(seed % 3), "time = " + time, differ, rank, seed);
        expect_as_by_steps(system_of(text), text);
        ++seed;
      }
    }
  }
}

/// The limit equals that of an analysis without L.
TEST(StepOfRates, HasTheSameLimit) {
  for (const std::string time : {"rk4", "ab2", "ab3"}) {
    for (const bool differ : {false, true}) {
      const System system = system_of(species(4, "time = " + time, differ, 1, 5));
      ASSERT_TRUE(system.by_rates().is_of_rates(0.1)) << time;
      const StepLimit by_rates = system.by_rates().limit();
      const StepLimit by_steps = FrozenAnalysis::make(system.linear, system.point, 1, 0.1)->limit();
      ASSERT_EQ(by_rates.kind, StepLimit::Kind::limit) << time;
      ASSERT_EQ(by_steps.kind, StepLimit::Kind::limit) << time;
      EXPECT_NEAR(by_rates.step, by_steps.step, 2e-4 * by_steps.step) << time;
    }
  }
}

/// The leapfrog lets what decays grow in each step, as it does by the eigenvalues of the step.
TEST(StepOfRates, OfLeapfrogHasNoLimit) {
  const System system = system_of(species(3, "time = leapfrog", true, 1, 5));
  ASSERT_TRUE(system.by_rates().is_of_rates(0.1));
  EXPECT_EQ(system.by_rates().limit().kind, StepLimit::Kind::never);
}

/// What is no function of all rates at once keeps eigenvalues of its own: parts that do not commute, and others.
TEST(StepOfRates, IsNoneOfSplitStepsAndSubcycles) {
  for (const std::string scheme : {"time = rk4; split = lie(advect, diffusion, sources)",
                                   "time = rk2; split = strang(advect, diffusion, sources)", "time = imex_euler"}) {
    const System system = system_of(species(3, scheme, true, 1, 3));
    EXPECT_FALSE(system.by_rates().is_of_rates(0.1)) << scheme;
  }
  const System system = system_of(species(3, "time = rk4", true, 1, 3, "  subcycle c1 in 2\n"));
  EXPECT_FALSE(system.by_rates().is_of_rates(0.1));
}

std::string three_fields(const std::string& equations, const std::string& scheme, int rank, const std::string& more) {
  const std::string time = scheme.find("time") == std::string::npos ? "time = rk4; " : "";
  std::string text =
      "model m { field u, v, w; " + equations + " }\nscheme q { " + time + scheme + " }\nscene s : m with q {\n";
  for (int axis = 0; axis < rank; ++axis) text += fmt::format("  grid {} = 0 .. 64, cells 64, periodic\n", "xyz"[axis]);
  return text + "  initial u = 1; initial v = 1; initial w = 1\n" + more + "  time 0 .. 1, step 0.1\n}\n";
}

/// By the text of a step it is known whether what holds of steps of some lengths holds of all: not where dt is in a
/// function. Stages of states are frozen, whatever stands around them.
TEST(StepOfRates, IsRationalInTheStepWhereDtIsInNoFunction) {
  const std::string rest = "; dt(v) = lap(v) - u; dt(w) = lap(w) - v";
  const std::tuple<std::string, std::string, bool> scenes[] = {
      {"dt(u) = lap(u) + u*v + sin(w)", "", true},
      {"dt(u) = lap(u) - max(u, v) - advect(v, u)", "advect = upwind(1); time = ssp_rk3", true},
      {"dt(u) = lap(u) + u*v", "time = ab3", true},
      {"dt(u) = (2 + cos(t))*lap(u)", "time = euler", true},
      {"dt(u) = (2 + cos(t))*lap(u)", "", false},
      {"dt(u) = lap(u)/max(0.1, t)", "time = rk2", false},
      {"dt(u) = lap(u) - mean(v)", "", false}};
  for (const auto& [equation, scheme, expected] : scenes) {
    const System system = system_of(three_fields(equation + rest, scheme, 1, ""));
    FrozenStages stages;
    ASSERT_TRUE(system.linear.response(system.point, 0.1, stages));
    EXPECT_EQ(system.linear.is_rational_in_step(stages), expected) << equation << scheme;
  }
}

/// The second stage of a long step has another factor than that of a short one: that eight short ones are of rates says
/// nothing of it.
TEST(StepOfRates, IsAskedOfEachStepWhereTimeIsInAFunction) {
  System system = system_of(three_fields("dt(u) = (1 + max(0, t - 0.2))*lap(u); dt(v) = lap(v) - u; dt(w) = lap(w) - v",
                                         "time = rk2", 1, ""));
  system.point.params["t"] = 0;
  const FrozenAnalysis analysis = system.by_rates();
  for (int i = 1; i <= 12; ++i) analysis.excess(0.01 * i);
  EXPECT_TRUE(analysis.is_of_rates(0.1));
  EXPECT_FALSE(analysis.is_of_rates(0.45));
  const Amplification g(*system.linear.response(system.point, 0.45), 1);
  const Largest largest = analysis.excess(0.45);
  EXPECT_NEAR(largest.value, std::log(g.spectral_radius(largest.angles)), 1e-9);
}

/// What ties fields for some waves alone: none stands for all. With v in halves the step is no polynomial of rates
/// where v and u are tied; Fourier series have no such parts.
TEST(StepOfRates, IsNoneWhereSomeWavesAreUnlikeOthers) {
  const std::string rest = "; dt(w) = lap(w) - 0.1*w + 0.3*";
  const std::tuple<std::string, std::string, int> scenes[] = {
      {"dt(u) = 2*mean(v) + mean(w); dt(v) = -2*mean(u)" + rest + "mean(u)", "", 1},
      {"dt(u) = 2*mean(v) + mean(w); dt(v) = -2*mean(u)" + rest + "mean(u)", "", 2},
      {"dt(u) = 2*mean(v, x) + mean(w); dt(v) = -2*mean(u, x)" + rest + "mean(u)", "", 2},
      {"dt(u) = 2*mean(v, y) + mean(w, x); dt(v) = -2*mean(u, y)" + rest + "mean(u, x)", "", 2},
      {"dt(u) = 0.02*integral(v) + w; dt(v) = -0.02*integral(u)" + rest + "u", "", 1},
      {"dt(u) = dx(v) + w; dt(v) = dx(u)" + rest + "u", "dx = spectral; lap = spectral; dealias = two_thirds", 1}};
  for (const auto& [equations, scheme, rank] : scenes) {
    const std::string text = three_fields(equations, scheme, rank, scheme.empty() ? "  subcycle v in 2\n" : "");
    const System system = system_of(text);
    const FrozenAnalysis analysis = system.by_rates();
    for (const double step : {0.05, 0.4, 1.5}) {
      EXPECT_FALSE(analysis.is_of_rates(step)) << text;
      expect_factors_of_step(system, analysis, step, text);
    }
  }
}

/// All steps together look at little more than the waves of one: a count of the work, which is that of eigenvalues.
TEST(StepOfRates, FindsTheRatesOfEachWaveOnce) {
  const System system = system_of(species(4, "time = rk4", true, 2, 9));
  const FrozenAnalysis analysis = system.by_rates();
  analysis.excess(0.1);
  const std::size_t of_one = analysis.waves_known();
  for (int i = 0; i < 40; ++i) analysis.excess(0.1 + 0.01 * i);
  EXPECT_LT(analysis.waves_known(), 3 * of_one);
}

/// Where diffusion is the same of all, one change of basis is enough for all waves.
TEST(StepOfRates, HasOneBasisWhereWeightsCommute) {
  for (const bool differ : {false, true}) {
    const System system = system_of(species(6, "time = rk4", differ, 2, 11));
    Amplification rates(*system.equations.rates_at(system.point), 2);
    Amplification step(*system.linear.response(system.point, 0.1), 2);
    rates.expect_many_waves();
    step.expect_many_waves();
    EXPECT_EQ(rates.has_common_basis(), !differ);
    EXPECT_EQ(step.has_common_basis(), !differ);
    const Amplification plain(*system.linear.response(system.point, 0.1), 2);
    for (const Angles& angles : {Angles{1, 2, 0}, Angles{0.01, 0, 0}, Angles{M_PI, M_PI, 0}, Angles{}})
      EXPECT_NEAR(step.spectral_radius(angles), plain.spectral_radius(angles), 1e-12);
  }
}

/// Against sums two by two; what was taken leaves nothing behind.
TEST(FormSum, AddsUpAsFormsDo) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> cells(-3, 3), component(0, 39), count(1, 60);
  std::uniform_real_distribution<double> number(-1, 1);
  FormSum sum;
  for (int turn = 0; turn < 20; ++turn) {
    LinearForm by_two;
    for (int part = count(random) * count(random) / 8; part >= 0; --part) {
      LinearForm form;
      for (int term = 0; term < 5; ++term)
        form = form.plus(LinearForm(component(random)).shifted({cells(random), cells(random), cells(random)}));
      const stencil::Offset offset{cells(random), cells(random), 0};
      const double factor = number(random);
      by_two = by_two.plus(form.shifted(offset).times(factor));
      sum.add(form, offset, factor);
    }
    const LinearForm at_once = sum.take();
    ASSERT_EQ(at_once.terms().size(), by_two.terms().size());
    for (std::size_t i = 0; i < at_once.terms().size(); ++i) {
      EXPECT_EQ(at_once.terms()[i].key, by_two.terms()[i].key);
      EXPECT_NEAR(at_once.terms()[i].coefficient, by_two.terms()[i].coefficient, 1e-13);
    }
  }
  EXPECT_TRUE(sum.take().is_zero());
}

}  // namespace
}  // namespace dpde::stability
