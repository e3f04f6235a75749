// SPDX-License-Identifier: Apache-2.0
// `real = f32` from the command line: files, checkpoints, costs, certificates, errors.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "support/netcdf_file.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class PrecisionCommand : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("rod.dpde", rod_text);
  }
};

TEST_F(PrecisionCommand, RunsAndWritesFloats) {
  const Outcome exact = dpde("run rod.dpde rod --json --out d"),
                single = dpde("run rod.dpde rod --json --out s --set real=f32");
  ASSERT_EQ(single.status, 0) << single.err;
  const NetcdfFile doubles(path("d/rod.nc").string()), floats(path("s/rod.nc").string());
  EXPECT_FALSE(doubles.is_float("u"));
  EXPECT_TRUE(floats.is_float("u"));
  EXPECT_FALSE(floats.is_float("time"));
  const std::vector<double> wanted = doubles.values("u"), values = floats.values("u");
  ASSERT_EQ(values.size(), wanted.size());
  double largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) largest = std::max(largest, std::abs(values[i] - wanted[i]));
  EXPECT_LT(largest, 1e-6);
  EXPECT_GT(largest, 1e-10);
  EXPECT_NE(floats.text("", "dpde_scheme").find("real = f32"), std::string::npos);
}

TEST_F(PrecisionCommand, ResumesToTheSameEnd) {
  ASSERT_EQ(dpde("run rod.dpde rod --out whole --set real=f32").status, 0);
  ASSERT_EQ(dpde("run rod.dpde rod --out half --set real=f32 --set end=0.5 --checkpoint-every 4").status, 0);
  const Outcome other = dpde("run rod.dpde rod --out half --resume --json");
  EXPECT_EQ(other.codes(), std::vector<std::string>{"E0914"}) << other.err;
  ASSERT_EQ(dpde("run rod.dpde rod --out half --set real=f32 --resume").status, 0);
  EXPECT_EQ(content(path("whole/u.npy")), content(path("half/u.npy")));
}

TEST_F(PrecisionCommand, HalvesWhatCheckSaysOfMemory) {
  const Json doubles = dpde("check rod.dpde find --json --set cells=65536").json();
  const Json floats = dpde("check rod.dpde find --json --set cells=65536 --set real=f32").json();
  EXPECT_EQ(floats["cost"]["bytes_per_point"].get<double>(), doubles["cost"]["bytes_per_point"].get<double>() / 2);
  const auto ratio = [&](const char* key) { return floats[key].get<double>() / doubles[key].get<double>(); };
  EXPECT_NEAR(ratio("gradient_memory_bytes"), 0.5, 0.02);
  EXPECT_LT(ratio("memory_bytes"), 0.65) << "the curve that a run shows is made of doubles";
}

TEST_F(PrecisionCommand, IsCertifiedAsDoublesAndAsFloats) {
  const Outcome verified = dpde("verify rod.dpde find --json --set real=f32");
  ASSERT_EQ(verified.status, 0) << verified.err;
  const Json result = verified.json();
  EXPECT_LT(result["dot_product"]["max_relative_error"].get<double>(), 1e-11);
  EXPECT_GT(result["single_precision"]["max_relative_error"].get<double>(), 1e-11);
  EXPECT_LT(result["single_precision"]["max_relative_error"].get<double>(), 1e-4);
  EXPECT_TRUE(dpde("verify rod.dpde find --json").json()["single_precision"].is_null());
  EXPECT_NE(dpde("verify rod.dpde find --set real=f32")
                .out.find("single precision: the above is of the same programs in f64"),
            std::string::npos);
}

/// Their networks are in f32 by default.
TEST_F(PrecisionCommand, ProgramsByHandAreCertifiedAsDoublesWithTheirNetworks) {
  write("by_hand.dpde", R"(network n(1) -> 1 { padding x periodic; initial he, seed 1; conv 4, 3; tanh; conv out, 3 }
kernel go(u, o: field, dt: param, out v: field) { v = u + dt*o }
program step { apply n(u) to o; run go; swap u, v }
scene s : step { grid x = 0 .. 1, cells 16, periodic; initial u = sin(2*pi*x); time 0 .. 1, step 1/4 }
task t : s { learn n; minimise mean(u^2); using lbfgs(), iterations 3 }
)");
  const Outcome verified = dpde("verify by_hand.dpde t --json");
  ASSERT_EQ(verified.status, 0) << verified.err;
  EXPECT_LT(verified.json()["dot_product"]["max_relative_error"].get<double>(), 1e-11);
  EXPECT_GT(verified.json()["single_precision"]["max_relative_error"].get<double>(), 1e-11);
}

TEST_F(PrecisionCommand, OptimisesAndBuilds) {
  const Outcome found = dpde("optimize rod.dpde find --json --set real=f32");
  EXPECT_EQ(found.status, 0) << found.err;
  const Outcome built = dpde("build rod.dpde find -o lib --set real=f32");
  ASSERT_EQ(built.status, 0) << built.err;
  const std::string source = content(path("lib/find.cpp"));
  EXPECT_NE(source.find("DPDE_F32"), std::string::npos);
  EXPECT_EQ(source.find("DPDE_F64"), std::string::npos);
}

TEST_F(PrecisionCommand, OverflowsLikeAnyOtherBlowUp) {
  std::string text = rod_text;
  text.replace(text.find("k*lap(u)"), 8, "79*u + k*lap(u)");  // times 10.9 in each step
  write("rod.dpde", text);
  const std::string run = "run rod.dpde rod --json --set end=8 --set real=";
  EXPECT_EQ(dpde(run + "f64").status, 0);
  const Outcome single = dpde(run + "f32");
  EXPECT_EQ(single.codes(), std::vector<std::string>{"E0801"}) << single.err;
  EXPECT_NE(single.err.find("rod.dpde:4:"), std::string::npos) << single.err;
}

TEST_F(PrecisionCommand, OtherPrecisionsAreMistakes) {
  const Outcome run = dpde("run rod.dpde rod --json --set real=f16");
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0505"});
  EXPECT_NE(run.err.find("choose one of: f64, f32"), std::string::npos) << run.err;
}

/// u is about `size`, w_1, w_2, ... are the formulas of it.
std::string formulas_of(const std::string& size, const std::string& c, const std::vector<std::string>& formulas) {
  std::string fields, equations, observed, initial;
  for (std::size_t i = 0; i < formulas.size(); ++i) {
    const std::string w = "w_" + std::to_string(i + 1);
    fields += "; field " + w;
    equations += "\n  dt(" + w + ") = " + formulas[i];
    initial += "\n  initial " + w + " = 0";
    observed += "\n  observe of_" + w + " = max(abs(" + w + "))";
  }
  return "model m { field u" + fields + "; param c = " + c + "; let k = " + c + "\n  dt(u) = 0*u" + equations +
         " }\nscheme q { time = euler; real = f32 }\nscene s : m with q { grid x = 0 .. 1, cells 4, periodic\n  "
         "initial "
         "u = " +
         size + "*(1 + x)" + initial + observed + "\n  time 0 .. 1, step 1 }\n";
}

/// A number beyond the range of floats either gives the same fields as in double precision or is refused at its
/// position.
TEST_F(PrecisionCommand, NumbersBeyondFloatsAreMetOrRefused) {
  const std::vector<std::pair<std::string, std::string>> numbers = {
      {"1e-60", "1e30"},
      {"1e-42", "1e20"},
      {"1e39", "1e-20"},
      {"1e60", "1e-30"}};  // with a u that brings them into range
  for (const auto& [number, size] : numbers) {
    for (const std::string c : {"c", "k"}) {
      write("factors.dpde", formulas_of(size, number,
                                        {c + "*u", "u*" + c, "-u*" + c, "u/(1/" + c + ")", c + "*u + 2*" + c + "*u",
                                         "sqrt(" + c + "*u)", c + "*dx(u)"}));
      const Outcome single = dpde("run factors.dpde --json --force"),
                    exact = dpde("run factors.dpde --json --force --set real=f64");
      ASSERT_EQ(single.status, 0) << number << single.err;
      ASSERT_EQ(exact.status, 0) << number << exact.err;
      const Json found = single.json()["observables"], known = exact.json()["observables"];
      for (const auto& [name, values] : known.items()) {
        const double wanted = values, value = found[name];
        EXPECT_NE(wanted, 0) << name;
        EXPECT_NEAR(value, wanted, 1e-5 * wanted) << c << " = " << number << ", " << name;
      }
      const std::vector<std::string> sums = {"u + " + c,
                                             c + " - u",
                                             "max(u, " + c + ")",
                                             "min(u, " + c + ")",
                                             "sqrt(u*u + " + c + ")",
                                             "u/(u + " + c + ")",
                                             "if(u > " + c + ", u, 1)",
                                             "if(u > 0, " + c + ", u)",
                                             c};
      write("sums.dpde", formulas_of(size, number, sums));
      const Outcome refused = dpde("run sums.dpde --json");
      EXPECT_EQ(refused.status, 2) << number;
      // a let is reported once, where its number is
      EXPECT_EQ(std::ranges::count(refused.codes(), "E0103"), c == "c" ? std::ssize(sums) : 1) << number << refused.err;
      EXPECT_NE(refused.err.find("write real = f64"), std::string::npos) << refused.err;
    }
  }
  write("far.dpde", formulas_of("1e30", "1e-80", {"c*u"}));
  EXPECT_EQ(dpde("run far.dpde --json").codes(), std::vector<std::string>{"E0103"}) << "it makes 0 of every float";
}

/// A field of about `size`, as a divisor, brings the number into range.
TEST_F(PrecisionCommand, NumbersBeyondFloatsAreDividedByFields) {
  for (const auto& [number, size] :
       std::vector<std::pair<std::string, std::string>>{{"1e-50", "1e-30"}, {"1e-70", "1e-37"}, {"1e50", "1e30"}}) {
    for (const std::string c : {"c", "k"}) {
      write("s.dpde", formulas_of(size, number, {c + "/u", "-" + c + "/(2*u)", "1/(u/" + c + ")", "3*" + c + "/u*2"}));
      const Outcome single = dpde("run s.dpde --json --force"),
                    exact = dpde("run s.dpde --json --force --set real=f64");
      ASSERT_EQ(single.status, 0) << number << single.err;
      const Json found = single.json()["observables"], known = exact.json()["observables"];
      for (const auto& [name, values] : known.items()) {
        const double wanted = values, value = found[name];
        EXPECT_NE(wanted, 0) << name;
        EXPECT_NEAR(value, wanted, 1e-5 * std::abs(wanted)) << c << " = " << number << ", " << name;
      }
    }
  }
}

/// Uniform values are computed in double precision.
TEST_F(PrecisionCommand, NumbersBesideSumsAreDoubles) {
  const std::string head =
      "model m { field u; dt(u) = lap(u) }\nscheme q { real = f32 }\nscene s : m with q {\n"
      "  grid x = 0 .. 1, cells 16, periodic\n  initial u = 1 + 0.2*sin(2*pi*x)\n"
      "  time 0 .. 0.001, step 0.001 }\n";
  for (const std::string loss :
       {"mean(u^2) + 1e-60", "log(mean(u^2) + 1e-45)", "sqrt(mean(u^2) + 1e-40)", "max(1e-60, mean(u^2))"}) {
    write("s.dpde", head + "task t : s { unknown initial u; minimise " + loss + " }\n");
    const Outcome single = dpde("gradient s.dpde t --json"), exact = dpde("gradient s.dpde t --json --set real=f64");
    ASSERT_EQ(single.status, 0) << loss << single.err;
    const double wanted = exact.json()["loss"];
    EXPECT_NEAR(single.json()["loss"].get<double>(), wanted, 1e-5 * std::abs(wanted)) << loss;
  }
  for (const std::string loss : {"1e-80*mean(u^2)", "mean(u^2)/1e80", "-1e-80*log(2 + mean(u^2))"}) {
    write("s.dpde", head + "task t : s { unknown initial u; minimise " + loss + " }\n");
    EXPECT_EQ(dpde("gradient s.dpde t --json").codes(), std::vector<std::string>{"E0103"}) << loss;
  }
  write("s.dpde",
        "model m { field u, w; param c; dt(u) = 0; dt(w) = max(u, c) }\nscheme q { real = f32 }\n"
        "scene s : m with q { initial u = 0; initial w = 0; time 0 .. 1, step 1; c = 1e-50 }\n"
        "task t : s { unknown c; minimise w }\n");
  EXPECT_EQ(dpde("gradient s.dpde t --json").codes(), std::vector<std::string>{"E0103"}) << "c starts from there";
}

/// Derivatives multiply numbers that are separate in the formula.
TEST_F(PrecisionCommand, NumbersOfDerivativesAreMet) {
  for (const std::string loss : {"mean((u/1e20 - 1)^2)", "mean((u/c - 1)^2)"}) {
    write("s.dpde",
          "model m { field u; param c = 1e20; dt(u) = lap(u) }\nscheme q { real = f32 }\nscene s : m with q {\n"
          "  grid x = 0 .. 1, cells 16, periodic\n  initial u = 1e20; time 0 .. 0.01, step 0.001 }\n"
          "task t : s { unknown initial u from 1e20*(1 + 0.2*sin(2*pi*x)); minimise " +
              loss + " }\n");
    const Outcome single = dpde("gradient s.dpde t --json --certify"),
                  exact = dpde("gradient s.dpde t --json --set real=f64");
    ASSERT_EQ(single.status, 0) << loss << single.err;
    const auto norm = [](const Outcome& outcome) { return outcome.json()["gradient"]["u"]["norm"].get<double>(); };
    EXPECT_NEAR(norm(single), norm(exact), 1e-4 * norm(exact)) << loss;
  }
}

/// Squares of divisors, and products of two, beyond the range of floats, though all numbers in the text are within.
TEST_F(PrecisionCommand, DivisorsOfDerivativesAreMet) {
  const std::vector<std::string> losses = {
      "mean((c/u - 1)^2)",   "mean((c*u^(-1) - 1)^2)",  "mean((u/(c + u) - 1)^2)", "mean((v/(u + c))^2)",
      "mean(log(u/c)^2)",    "mean((sqrt(u/c) - 2)^2)", "mean(((c/u)^3 - 2)^2)",   "mean((c/u)^0.5)",
      "mean(v/u*u/(u + v))", "mean(c/(u + v) + v/u/2)", "mean(tanh(c/u))",         "mean(v/u*v/u)"};
  for (const std::string size : {"1e20", "1e-25"}) {
    for (std::size_t i = 0; i < losses.size(); ++i) {
      if (!is_tried(i, 4)) continue;
      write("s.dpde", "model m { field u, v; param c = " + size +
                          "; dt(u) = 0.1*lap(u) + 0.1*u; dt(v) = 0*v }\nscheme q { real = f32 }\n"
                          "scene s : m with q {\n  grid x = 0 .. 1, cells 16, periodic\n  initial u = c\n"
                          "  initial v = 1.5*c; time 0 .. 0.01, step 0.001 }\n"
                          "task t : s { unknown initial u from c*(1 + 0.2*sin(2*pi*x)); minimise " +
                          losses[i] + " }\n");
      const Outcome single = dpde("gradient s.dpde t --json"), exact = dpde("gradient s.dpde t --json --set real=f64");
      ASSERT_EQ(single.status, 0) << losses[i] << single.err;
      const auto norm = [](const Outcome& outcome) { return outcome.json()["gradient"]["u"]["norm"].get<double>(); };
      EXPECT_GT(norm(exact), 0) << losses[i];
      EXPECT_NEAR(norm(single), norm(exact), 1e-4 * norm(exact)) << size << ": " << losses[i];
    }
  }
}

}  // namespace
}  // namespace dpde::testing
