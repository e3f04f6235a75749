// SPDX-License-Identifier: Apache-2.0
// `real = f32` from the command line: files, checkpoints, costs, certificates, mistakes.
#include <cmath>

#include "command_support.h"
#include "support/netcdf_file.h"

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
  text.replace(text.find("k*lap(u)"), 8, "79*u + k*lap(u)");  // times 10.9 each step
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

}  // namespace
}  // namespace dpde::testing
