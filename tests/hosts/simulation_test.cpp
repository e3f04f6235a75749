// SPDX-License-Identifier: Apache-2.0
// The interface for hosts with the compiler inside, against closed forms. A step of explicit Euler on a periodic rod
// scales sin(x) by 1 - 4 k dt/h^2 sin(h/2)^2; so everything here is known, derivatives too.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <numbers>

#include "dpde/dpde.h"
#include "dpde/runtime/npy.h"

namespace {

std::atomic<long> allocations{0};

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t bytes) {
  ++allocations;
  if (void* memory = std::malloc(bytes)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#ifdef __SANITIZE_ADDRESS__
// Libraries that came before take the sanitizer's own new.
extern "C" const char* __asan_default_options() { return "alloc_dealloc_mismatch=0"; }
#endif

namespace dpde {
namespace {

const char* rod = R"(model heat {
  field u
  param k, q
  dt(u) = k*lap(u) + q
}
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  q = 0
  initial u = sin(x)
  observe size = mean(u^2)
  time 0 .. 1, step 1/8
}
task find : rod {
  unknown k from 0.25
  unknown initial u
  minimise mean(u^2) at t = 1
}
)";

double amplification(double k, int cells) {
  const double h = 2 * std::numbers::pi / cells, s = std::sin(h / 2);
  return 1 - 4 * k * 0.125 / (h * h) * s * s;
}

std::vector<double> sine(const Simulation& sim, double amplitude) {
  std::vector<double> values = sim.coordinates(0);
  for (double& value : values) value = amplitude * std::sin(value);
  return values;
}

void expect_near(const std::vector<double>& a, const std::vector<double>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], tolerance) << i;
}

TEST(Compile, CertifiesDerivatives) {
  for (const std::optional<bool> certify : {std::optional<bool>(), std::optional(true), std::optional(false)}) {
    Simulation sim = compile_text(rod, {.name = "find", .certify = certify});
    const double g = amplification(0.25, 16), slope = (amplification(1, 16) - 1) * 8 * std::pow(g, 15);
    EXPECT_NEAR(sim.gradient(), std::pow(g, 16) / 2, 1e-15);
    EXPECT_NEAR(sim.gradient_of("k")[0], slope, 1e-13);
  }
}

TEST(Simulation, StepsAndRunsOnEveryBackEnd) {
  for (const HostBackend backend : {HostBackend::jit, HostBackend::cpp, HostBackend::interpreter}) {
    Simulation sim = compile_text(rod, {.name = "rod", .backend = backend});
    const double g = amplification(0.3, 16);
    EXPECT_TRUE(sim.step());
    expect_near(sim.state("u"), sine(sim, g), 1e-15);
    EXPECT_DOUBLE_EQ(sim.time(), 0.125);
    EXPECT_TRUE(sim.run_to(0.5));
    EXPECT_EQ(sim.steps_done(), 4);
    EXPECT_TRUE(sim.run());
    expect_near(sim.state("u"), sine(sim, std::pow(g, 8)), 1e-14);
    EXPECT_NEAR(sim.observe("size"), std::pow(g, 16) / 2, 1e-15);
    sim.reset();
    expect_near(sim.state("u"), sine(sim, 1), 1e-15);
  }
}

TEST(Simulation, ParametersCellsAndStates) {
  Simulation sim = compile_text(rod, {.name = "rod", .set = {{"cells", "32"}}, .force = true});
  EXPECT_EQ(sim.cells(), std::vector<std::int64_t>{32});
  EXPECT_EQ(sim.params(), (std::vector<std::string>{"k", "q"}));
  EXPECT_EQ(sim.states(), std::vector<std::string>{"u"});
  EXPECT_EQ(sim.param("k"), 0.3);
  sim.set("k", 0.1);
  sim.set("q", 2);  // 0 in the scene, and yet there
  sim.set_state("u", sine(sim, 3));
  sim.step(4);
  std::vector<double> expected = sine(sim, 3 * std::pow(amplification(0.1, 32), 4));
  for (double& value : expected) value += 4 * 0.125 * 2;
  expect_near(sim.state("u"), expected, 1e-14);
  EXPECT_NEAR(sim.initial("u")[0], std::sin(sim.coordinates(0)[0]), 1e-15);
}

TEST(Simulation, TakesEigenPointersAndSpans) {
  Simulation sim = compile_text(rod, {.name = "rod"});
  Eigen::VectorXd values = Eigen::VectorXd::Constant(16, 2.5);
  sim.set_state("u", values);
  Eigen::Array<double, 4, 4> out;
  sim.state("u", out);
  EXPECT_TRUE((out == 2.5).all());
  Eigen::MatrixXd two = Eigen::MatrixXd::Constant(16, 2, 7.0);
  sim.set_state("u", two.col(1));
  std::array<double, 16> back{};
  sim.state("u", Target(back.data(), back.size()));
  EXPECT_EQ(back[15], 7.0);
  sim.state("u", Eigen::Map<Eigen::VectorXd>(values.data(), 16));
  EXPECT_EQ(values[3], 7.0);
  sim.state("u", std::span(back));
  EXPECT_THROW(sim.set_state("u", Eigen::MatrixXd::Zero(2, 16).eval().row(1)), Error);
  EXPECT_THROW(sim.set_state("u", std::vector<double>(15)), Error);
}

TEST(Simulation, LossAndGradientOfATask) {
  Simulation sim = compile_text(rod, {.name = "find"});
  EXPECT_EQ(sim.unknowns(), (std::vector<std::string>{"u", "k"}));
  for (const double k : {0.25, 0.4}) {
    sim.set("k", k);
    const double g = amplification(k, 16), slope = (amplification(1, 16) - 1);
    EXPECT_NEAR(sim.loss(), std::pow(g, 16) / 2, 1e-15);
    EXPECT_NEAR(sim.gradient(), std::pow(g, 16) / 2, 1e-15);
    EXPECT_NEAR(sim.gradient_of("k")[0], 8 * std::pow(g, 15) * slope, 1e-13);
    const auto bar = sim.gradient_of("u");
    expect_near({bar.begin(), bar.end()}, sine(sim, 2 * std::pow(g, 16) / 16), 1e-15);
  }
  sim.set_initial("u", sine(sim, 2));
  EXPECT_NEAR(sim.loss(), 4 * std::pow(amplification(0.4, 16), 16) / 2, 1e-14);
  sim.step(3);
  const std::vector<double> before = sim.state("u");
  sim.gradient();
  EXPECT_EQ(sim.state("u"), before);
}

TEST(Simulation, GradientThroughTheFormulaOfTheInitialState) {
  const std::string text = std::string(rod) + R"(
scene scaled : heat with ftcs {
  grid x = 0 .. 2*pi, cells 16, periodic
  k = 0.3
  initial u = q*sin(x)
  time 0 .. 1, step 1/8
}
task level : scaled {
  unknown q from 0.5
  minimise mean((u - q)^2) at t = 0
}
)";
  Simulation sim = compile_text(text, {.name = "level"});
  // mean((q sin x - q)^2) = 3/2 q^2
  EXPECT_NEAR(sim.gradient(), 1.5 * 0.25, 1e-15);
  EXPECT_NEAR(sim.gradient_of("q")[0], 3 * 0.5, 1e-14);
  sim.set("q", 2);
  EXPECT_NEAR(sim.gradient(), 6, 1e-14);
  EXPECT_NEAR(sim.gradient_of("q")[0], 6, 1e-13);
}

TEST(Simulation, CheckpointedGradientsAreTheSame) {
  const std::string text = R"(model burgers {
  field u
  param nu
  dt(u) = -advect(u, u) + nu*lap(u)
}
scene wave : burgers {
  grid x = -1 .. 1, cells 24, periodic
  nu = 0.02
  initial u = -sin(pi*x)
  time 0 .. 0.5, step 1/64
}
task all : wave {
  unknown initial u
  unknown nu
  minimise mean(u^2) over time
}
)";
  Simulation full = compile_text(text, {.name = "all"}), few = compile_text(text, {.name = "all", .slots = 3});
  EXPECT_EQ(full.gradient(), few.gradient());
  const auto a = full.gradient_of("u"), b = few.gradient_of("u");
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
  EXPECT_EQ(full.gradient_of("nu")[0], few.gradient_of("nu")[0]);
}

/// Hosts give and take doubles whatever the scene computes in.
TEST(Simulation, SinglePrecision) {
  Simulation sim = compile_text(rod, {.name = "find", .set = {{"real", "f32"}}});
  Simulation exact = compile_text(rod, {.name = "find"});
  const double loss = exact.gradient();
  EXPECT_NEAR(sim.gradient(), loss, 1e-6 * loss);
  EXPECT_NEAR(sim.gradient_of("k")[0], exact.gradient_of("k")[0], 1e-5 * std::abs(exact.gradient_of("k")[0]));
  for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(sim.gradient_of("u")[i], exact.gradient_of("u")[i], 1e-6);
  sim.set_state("u", sine(sim, 0.1));
  EXPECT_EQ(sim.state("u")[3], static_cast<float>(sine(sim, 0.1)[3]));
  sim.step(8);
  expect_near(sim.state("u"), sine(sim, 0.1 * std::pow(amplification(0.25, 16), 8)), 1e-7);
  EXPECT_NEAR(sim.observe("size"), 0.005 * std::pow(amplification(0.25, 16), 16), 1e-8);
}

TEST(Simulation, ASteppedStepAllocatesNothing) {
  Simulation sim = compile_text(rod, {.name = "find"});
  std::vector<double> values(sim.size());
  sim.step();
  sim.state("u", values);
  sim.gradient();
  sim.loss();
  const long before = allocations;
  for (int n = 0; n < 200; ++n) sim.step();
  sim.state("u", values);
  sim.set("k", 0.2);
  const long after_steps = allocations;
  EXPECT_GT(before, 0);
  EXPECT_EQ(after_steps, before);
  sim.gradient();
  const long first = allocations;
  sim.gradient();
  sim.loss();
  EXPECT_EQ(allocations, first);
}

TEST(Simulation, AStepThatSolvesWithOtherCoefficientsAllocatesNothing) {
  Simulation sim =
      compile_text(R"(model m { field u; solve div((1 + 0.5*u^2)*grad(psi)) - psi = -u for psi; dt(u) = psi }
scheme chosen { solve = cg(1e-8); time = euler }
scene s : m with chosen { grid x = 0 .. 1, cells 12; grid y = 0 .. 1, cells 10; boundary u: all = 0
  boundary psi: all = 0; initial u = sin(pi*x)*sin(pi*y); time 0 .. 0.25, step 1/16 }
task t : s { unknown initial u; minimise mean(u^2) })",
                   {.name = "t"});
  const auto of_last = [](const auto& run, long before = 0) {
    for (int n = 0; n < 3; ++n) before = allocations, run();
    return allocations - before;
  };
  EXPECT_EQ(of_last([&] { sim.step(3); }), 0);
  EXPECT_EQ(of_last([&] { sim.gradient(); }), 0);
}

TEST(Simulation, AGradientThroughFormulasAllocatesNothing) {
  Simulation sim =
      compile_text(R"(model decay { field a_field_with_a_long_name; coefficient a_coefficient_with_a_long_name
  param a_parameter_with_a_long_name
  dt(a_field_with_a_long_name) = -a_coefficient_with_a_long_name*a_field_with_a_long_name }
scene s : decay {
  grid x = 0 .. 1, cells 8, periodic
  a_parameter_with_a_long_name = 2
  a_coefficient_with_a_long_name = a_parameter_with_a_long_name*x
  initial a_field_with_a_long_name = a_parameter_with_a_long_name
  time 0 .. 1, step 0.25
}
task t : s { unknown a_parameter_with_a_long_name; unknown initial a_field_with_a_long_name; minimise mean(a_field_with_a_long_name^2) })",
                   {.name = "t"});
  sim.gradient();
  const long before = allocations;
  sim.gradient();
  EXPECT_EQ(allocations, before);
}

TEST(Simulation, ProgressStopsAndTheFlagToo) {
  std::atomic<bool> stop{false};
  Simulation sim = compile_text(rod, {.name = "find", .stop = &stop});
  std::vector<int> seen;
  EXPECT_FALSE(sim.run(
      [&](const Progress& p) {
        seen.push_back(p.step);
        return p.step < 4;
      },
      2));
  EXPECT_EQ(seen, (std::vector<int>{2, 4}));
  EXPECT_EQ(sim.steps_done(), 4);
  stop = true;
  EXPECT_FALSE(sim.step());
  EXPECT_TRUE(std::isnan(sim.gradient()));
  EXPECT_TRUE(std::isnan(sim.loss()));
  stop = false;
  EXPECT_TRUE(sim.run());
  EXPECT_EQ(sim.steps_done(), 8);
  EXPECT_TRUE(sim.run_to(-1e300)) << "long past";
  EXPECT_THROW(sim.run_to(1e300), Error);
  EXPECT_EQ(sim.steps_done(), 8);
}

/// A time near 1e8 is known to 1.5e-8, of a step of 1e-3 more than its millionth.
TEST(Simulation, AsManySteps_FarFromTheTimeZero) {
  std::string text = rod;
  text.replace(text.find("time 0 .. 1, step 1/8"), 21, "time 1e8 .. 1e8 + 1, step 1e-3");
  for (int k = 1; k < 8; ++k) {
    std::string later = text;
    later.replace(later.find("1e8 .. 1e8 + 1"), 14,
                  "1e8 + " + std::to_string(k) + "/64 .. 1e8 + 1 + " + std::to_string(k) + "/64");
    Simulation sim = compile_text(later, {.name = "rod"});
    EXPECT_TRUE(sim.run());
    EXPECT_EQ(sim.steps_done(), 1000) << k;
    sim.reset();
    EXPECT_TRUE(sim.run_to(1e8 + k / 64.0 + 0.7));
    EXPECT_EQ(sim.steps_done(), 700) << k;
  }
}

TEST(Simulation, DataOfOtherScenesAndOfTheHost) {
  const std::string text = std::string(rod) + R"(
task match : rod {
  data u_ref = u from scene rod at t = 0.5, 1
  unknown k from 0.3
  minimise mean((u - u_ref)^2) at t = 0.5, 1
}
)";
  Simulation sim = compile_text(text, {.name = "match"});
  EXPECT_LT(sim.loss(), 1e-30);
  const double g = amplification(0.3, 16);
  sim.set_field("u_ref", std::vector<double>(32));
  EXPECT_NEAR(sim.loss(), (std::pow(g, 8) + std::pow(g, 16)) / 2, 1e-15);
  EXPECT_THROW(sim.set_field("u_ref", std::vector<double>(16)), Error);
}

TEST(Simulation, InitialStatesAndCoefficientsFromFiles) {
  const std::string folder = ::testing::TempDir() + "dpde_simulation_files";
  std::filesystem::create_directories(folder);
  write_npy(folder + "/start.npy", std::vector<std::int64_t>{4}, std::vector<double>{1, 2, 3, 4});
  const char* text = R"(model decay {
  field u
  coefficient a
  param s
  dt(u) = -s*a*u
}
scene box : decay with plain {
  grid x = 0 .. 4, cells 4, periodic
  s = 1
  a = s*x
  initial u = load("start.npy")
  time 0 .. 1, step 0.25
}
scheme plain { time = euler }
)";
  Simulation sim = compile_text(text, {.name = "box"}, folder + "/text.dpde");
  sim.step();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(sim.state("u")[i], (i + 1) * (1 - 0.25 * (i + 0.5)), 1e-15);
  sim.set("s", 2);  // twice: in the equation and in the formula of a
  sim.reset();
  sim.step();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(sim.state("u")[i], (i + 1) * (1 - 0.25 * 4 * (i + 0.5)), 1e-15);
  sim.set_field("a", std::vector<double>(4, 1.0));
  sim.reset();
  sim.step();
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(sim.state("u")[i], (i + 1) * 0.5, 1e-15);
}

/// u = t*q after explicit Euler, whatever the step: loss mean(q^2) for u at t = 1, d loss/d q_i = 2 q_i/n.
TEST(Simulation, SeeksCoefficientsAndWhatTheirFormulasHold) {
  const std::string text = R"(model heated {
  field u
  coefficient q
  param a
  dt(u) = q
}
scheme plain { time = euler }
scene s : heated with plain {
  grid x = 0 .. 4, cells 4, periodic
  a = 3
  q = a*x
  initial u = 0
  time 0 .. 1, step 0.25
}
task field : s {
  unknown q from 2*x
  minimise mean(u^2)
}
task factor : s {
  unknown a from 3
  minimise mean(u^2)
}
)";
  Simulation field = compile_text(text, {.name = "field"});
  EXPECT_NEAR(field.gradient(), 4 * (0.25 + 2.25 + 6.25 + 12.25) / 4, 1e-13);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(field.gradient_of("q")[i], 2 * 2 * (static_cast<double>(i) + 0.5) / 4, 1e-14);
  field.set_field("q", std::vector<double>(4, 5.0));
  EXPECT_NEAR(field.gradient(), 25, 1e-13);
  EXPECT_NEAR(field.gradient_of("q")[2], 2.5, 1e-14);
  Simulation factor = compile_text(text, {.name = "factor"});
  EXPECT_NEAR(factor.gradient(), 9 * 21.0 / 4, 1e-13);
  EXPECT_NEAR(factor.gradient_of("a")[0], 6 * 21.0 / 4, 1e-13);
  factor.set("a", 1);
  EXPECT_NEAR(factor.gradient(), 21.0 / 4, 1e-13);
  EXPECT_NEAR(factor.gradient_of("a")[0], 2 * 21.0 / 4, 1e-13);
}

TEST(Simulation, MistakesAreErrorsThatSayWhere) {
  try {
    compile_text(
        "model heat {\n  field u\n  dt(u) = lapp(u)\n}\nscene s : heat { grid x = 0 .. 1, cells 4, periodic\n initial "
        "u = 0\n time 0 .. 1, step 1 }\n",
        {}, "typo.dpde");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::input);
    ASSERT_EQ(error.messages().size(), 1u);
    EXPECT_EQ(error.messages()[0].code, "E0302");
    EXPECT_EQ(error.messages()[0].file, "typo.dpde");
    EXPECT_EQ(error.messages()[0].line, 3);
    EXPECT_EQ(error.messages()[0].column, 11);
    EXPECT_EQ(error.messages()[0].hint, "did you mean lap?");
    EXPECT_NE(std::string(error.what()).find("  dt(u) = lapp(u)\n            ^~~~"), std::string::npos) << error.what();
  }
  EXPECT_THROW(compile_file("/nowhere/a.dpde"), Error);
  Simulation sim = compile_text(rod, {.name = "rod"});
  EXPECT_THROW(sim.set("kk", 1), Error);
  EXPECT_THROW(sim.state("v"), Error);
  EXPECT_THROW(sim.loss(), Error);
  EXPECT_THROW(sim.gradient_of("k"), Error);
  EXPECT_THROW(sim.observe("mass"), Error);
  EXPECT_THROW(sim.coordinates(1), Error);
  sim.set("k", 1e6);
  try {
    sim.run_to(100);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::run);
    EXPECT_NE(std::string(error.what()).find("u is no longer finite"), std::string::npos);
  }
}

/// Large fields make several steps in one pass where the host asks for several: bits are those of steps one by one.
TEST(Simulation, StepsAtOnceAreStepsOneByOne) {
  const std::string plate =
      "model plate {\n  field u\n  param k\n  dt(u) = k*(dx(dx(u)) + dy(dy(u))) - u*abs(u) + t\n}\n"
      "scheme forward { time = euler }\nscene s : plate with forward {\n  k = 0.2\n  grid x = 0 .. 512, cells 512, "
      "periodic\n  grid y = 0 .. 300, cells 300\n  boundary u: y = zero_gradient\n"
      "  initial u = sin(0.1*x)*cos(0.3*y)\n  time 0 .. 4, step 0.1\n}\n";
  Simulation one = compile_text(plate);
  std::vector<std::vector<double>> expected;
  for (int n = 1; n <= 45; ++n) {  // beyond the scene's end
    if (n == 20) one.set("k", 0.3);
    one.step();
    if (n == 19 || n == 45) expected.push_back(one.state("u"));
  }
  for (const int threads : {1, 2, 3}) {
    Simulation sim = compile_text(plate, {.threads = threads});
    sim.step(19);
    EXPECT_EQ(sim.state("u"), expected[0]);
    sim.set("k", 0.3);
    sim.step(26);
    EXPECT_EQ(sim.state("u"), expected[1]);
    EXPECT_EQ(sim.steps_done(), 45);
  }
}

/// Two dimensions: x is fastest.
/// h^2/(2*0.3) is 0.257.
TEST(Host, RefusesAStepThatRuinsTheRun) {
  const HostOptions options{.name = "rod", .set = {{"step", "0.5"}, {"end", "50"}}};
  try {
    compile_text(rod, options);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    ASSERT_EQ(error.messages().size(), 1u);
    EXPECT_EQ(error.messages()[0].code, "E0808");
    EXPECT_NE(error.messages()[0].text.find("scene rod: the step 0.5 is above 0.257"), std::string::npos);
  }
  HostOptions forced = options;
  forced.force = true;
  EXPECT_NO_THROW(compile_text(rod, forced));
}

}  // namespace
}  // namespace dpde
