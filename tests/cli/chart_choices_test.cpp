// SPDX-License-Identifier: Apache-2.0
// Choices for charts: values, blocks, references, steps beyond the stability limit.
#include "chart_support.h"

namespace dpde::testing {
namespace {

TEST_F(ChartCommand, WhatIsNoNumberIsNamed) {
  write("s.dpde", wind(true));
  const auto told = [&](const std::string& options) {
    const Outcome run = dpde(options + quick);
    EXPECT_EQ(run.status, 2) << options;
    EXPECT_EQ(run.codes(), std::vector<std::string>{"E0904"}) << run.err;
    return run.err;
  };
  EXPECT_NE(told("chart s.dpde --vary cells=16,x,32").find(": x is no whole number above 0"), std::string::npos);
  EXPECT_NE(told("chart s.dpde --vary step=0.1,0").find(": 0 is no number above 0"), std::string::npos);
  for (const char* verb : {"chart", "tune"}) {
    const std::string text = told(fmt::format("{} s.dpde --tolerance -1", verb));
    EXPECT_NE(text.find("--tolerance: -1 is no number above 0"), std::string::npos) << text;
    EXPECT_LT(text.size(), 1000u) << "not the range of all numbers";
  }
}

TEST_F(ChartCommand, OfSeveralBlocksOneHasToBeNamed) {
  write("s.dpde",
        wind(true) + "chart a : ring { vary advect in central2 }\nchart b : ring { vary advect in upwind3 }\n");
  const Outcome run = dpde("chart s.dpde" + quick);
  EXPECT_EQ(run.codes(), std::vector<std::string>{"E0319"}) << run.err;
  EXPECT_NE(run.err.find("a, b"), std::string::npos) << run.err;
  EXPECT_EQ(dpde("chart s.dpde b --vary cells=16" + quick).json()["points"][0]["variant"]["advect"], "upwind3");
}

/// A run on 64 cells verifies the accuracy of 32. The choice names its reference.
TEST_F(ChartCommand, TuneTakesTheReferenceOfABlock) {
  write("s.dpde", wind(true) + "chart a : ring { vary advect in central2, upwind3; reference self(cells = 64) }\n");
  const Outcome run = dpde("tune s.dpde a --tolerance 1e-2" + quick);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_LE(run.json()["error"].get<double>(), 1e-2);
  EXPECT_LE(run.json()["chosen"]["cells"][0].get<int>(), 32);
  EXPECT_NE(run.json()["reference"]["text"].get<std::string>().find("a run on 2 times the cells"), std::string::npos);
  EXPECT_GT(run.json()["reference"]["uncertainty"].get<double>(), 0);
  const Outcome coarse = dpde("tune s.dpde ring --tolerance 1e-2 --reference-cells 40" + quick);
  EXPECT_EQ(coarse.codes(), std::vector<std::string>{"E0916"}) << coarse.err;
  EXPECT_NE(coarse.err.find("--reference-cells 64"), std::string::npos) << coarse.err;
}

/// The limit on 24 cells is 2.83*2*pi/24 = 0.74: 1.4 times that gives one step of length 1, which does no harm; 0.98
/// and 0.95 both give steps of 1/2.
TEST_F(ChartCommand, StepsAboveTheLimitAreToldAndNoneIsRunTwice) {
  write("s.dpde", wind(true));
  const std::string command =
      "chart s.dpde --vary advect=central2 --vary cells=24 --vary fraction=1.4,0.98,0.95,0.5 --samples 1 "
      "--sample-seconds 0 --out o";
  const Outcome run = dpde(command);
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("1 of 4 points left out"), std::string::npos) << run.out;
  const Json points = parse_json(content(path("o/ring_chart.json"))).value()["points"];
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0]["outcome"], "ran");
  EXPECT_EQ(points[0]["stable"], points[0]["step"].get<double>() <= points[0]["max_step"].get<double>()) << points[0];
  EXPECT_EQ(points[0]["stable"], false) << points[0];
  EXPECT_EQ(points[1]["stable"], true);
  EXPECT_NE(run.out.find("(above the largest stable step)"), std::string::npos) << run.out;
  const Json again = dpde(command + " --resume --json").json();
  ASSERT_EQ(again["points"].size(), 3u);
  EXPECT_EQ(again["points"][0]["stable"], false);
}

/// Partial results are reported neither as a choice nor as a boundary.
TEST_F(ChartCommand, CtrlCLeavesNoChoiceAndNoBoundary) {
  std::string text = wind(false);
  text.replace(text.find("cells 32"), 8, "cells 262144");
  text.replace(text.find("step 1/32"), 9, "step 1/131072");
  write("s.dpde", text);
  const Outcome tuned = interrupted("tune s.dpde --tolerance 1e-9 --json", "0.3");
  EXPECT_EQ(tuned.status, by_ctrl_c) << tuned.err;
  EXPECT_EQ(tuned.codes(), std::vector<std::string>{"E0807"}) << tuned.err;
  EXPECT_FALSE(tuned.json().contains("chosen") && !tuned.json()["chosen"].is_null()) << tuned.out;
  const Outcome measured = interrupted("stability s.dpde --json", "0.3");
  EXPECT_EQ(measured.status, by_ctrl_c) << measured.err;
  EXPECT_EQ(measured.codes(), std::vector<std::string>{"E0807"}) << measured.err;
  EXPECT_FALSE(measured.json().contains("ratio") && !measured.json()["ratio"].is_null()) << measured.out;
}

}  // namespace
}  // namespace dpde::testing
