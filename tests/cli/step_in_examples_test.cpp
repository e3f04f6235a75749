// SPDX-License-Identifier: Apache-2.0
// Results of `check` on the steps of examples, compared with runs of them.
#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

using StepInExamples = Command;

/// Three models, substeps, means and walls: a step of 5760 s is stable for two months, one of 6480 s is not.
TEST_F(StepInExamples, ThatOfCoupledModelsIsSoonTold) {
  if (!is_thorough()) GTEST_SKIP() << "three verdicts of 15 s each; at night";
  const std::string year = DPDE_SOURCE_DIR "/dsl-examples/coupled/year.dpde year --json ";
  const Json verdict = dpde("check " + year).json()["stability"];
  EXPECT_EQ(verdict["kind"], "limit");
  const double limit = verdict["max_step"].get<double>();
  EXPECT_GT(limit, 5760);
  EXPECT_LT(limit, 6480);
  const Outcome below = dpde("run " + year + "--force --set step=5760 --set end=5184000");
  EXPECT_EQ(below.status, 0) << below.err;
  const Outcome above = dpde("run " + year + "--force --set step=6480 --set end=5184000");
  EXPECT_EQ(above.codes(), std::vector<std::string>{"E0801"}) << above.err;
}

/// A filter that leaves some waves lets those of a few cells grow where a wind leaves a pole. With a filter as strong
/// as here this happens on coarse grids, too.
TEST_F(StepInExamples, WavesThatNoStepHoldsAreTold) {
  if (!is_thorough()) GTEST_SKIP() << "six runs, two minutes; at night";
  const std::string rotation = DPDE_SOURCE_DIR
      "/dsl-examples/sphere/filtered.dpde filtered_rotation --json --set cells.x=48 --set cells.y=24 --set reach=0.5 "
      "--set step=640 ";
  const auto check = [&](const std::string& calming) {
    return dpde("check " + rotation + "--set calming=" + calming).json()["stability"];
  };
  const auto error = [&](const std::string& step, const std::string& calming) {
    const Outcome run =
        dpde("run " + rotation + "--force --set end=1728000 --set step=" + step + " --set calming=" + calming);
    return run.status == 0 ? run.json()["error"]["h"]["l2"].get<double>() : 1e300;
  };
  const Json waves = check("0")["short_waves"];
  EXPECT_LT(waves["cells"], 5);
  EXPECT_GT(waves["growth_rate"], 1e-5);
  EXPECT_FALSE(check("4e-4").contains("short_waves"));
  EXPECT_GT(error("640", "0"), 100);
  EXPECT_GT(error("160", "0"), 100);
  EXPECT_LT(error("640", "4e-4"), 15);
}

}  // namespace
}  // namespace dpde::testing
