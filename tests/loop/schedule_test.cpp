// SPDX-License-Identifier: Apache-2.0
// Where fills end up: before the first step, with the sweep that wrote the field, or where the program says.
#include <gtest/gtest.h>

#include "loop/from_stencil.h"
#include "loop/loop_samples.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"

namespace dpde {
namespace {

using namespace samples;  // NOLINT

/// A kernel that writes `to` from the neighbours of `from`.
Kernel smooth(const std::string& from, const std::string& to, bool accumulate = false) {
  return {
      .name = from + "_to_" + to, .rank = 1, .stores = {{to, accumulate, access(from, {-1}) + access(from, {1}), {}}}};
}

/// The part of the program's text from `prepare` or the first operation on.
std::string schedule_of(std::vector<Kernel> kernels, Program program) {
  program.name = "p";
  if (program.axes.empty()) program.axes = {Topology::periodic};
  const loop::Module module = loop::from_stencil({std::move(kernels), {program}, {}}, {"p"});
  EXPECT_EQ(loop::verify(module), std::vector<std::string>{});
  const std::string text = loop::print(module);
  const std::size_t halo = text.find("  halo ", text.find("program p"));
  return text.substr(text.find('\n', halo) + 1);
}

const Fill fill_u{"u", {periodic()}}, fill_v{"v", {periodic()}}, fill_w{"w", {periodic()}};

TEST(Schedule, InputsAreFilledBeforeTheFirstStep) {
  EXPECT_EQ(schedule_of({smooth("u", "v")}, {.body = {fill_u, run("u_to_v")}, .keeps = {"v"}}),
            "  prepare fill u periodic\n  sweep u_to_v\n  keep v\n}\n");
}

TEST(Schedule, TheSameFillTwiceIsOne) {
  EXPECT_EQ(schedule_of({smooth("u", "v"), smooth("u", "w")},
                        {.body = {fill_u, run("u_to_v"), fill_u, run("u_to_w")}, .keeps = {"v", "w"}}),
            "  prepare fill u periodic\n  sweep u_to_v\n  sweep u_to_v with v = w\n  keep v, w\n}\n");
}

TEST(Schedule, IntermediateFieldsAreFilledByTheirSweep) {
  EXPECT_EQ(schedule_of({smooth("u", "v"), smooth("v", "w")},
                        {.body = {fill_u, run("u_to_v"), fill_v, run("v_to_w")}, .swaps = {{"u", "w"}}}),
            "  prepare fill u periodic\n"
            "  sweep u_to_v then fill v periodic\n"
            "  sweep u_to_v with u = v, v = w then fill w periodic\n"
            "  swap u, w\n}\n");
}

TEST(Schedule, SweepsInBetweenKeepAFillInItsPlace) {
  EXPECT_EQ(
      schedule_of(
          {smooth("u", "v"), {.name = "copy", .rank = 1, .stores = {{"w", false, access("v"), {}}}}, smooth("v", "x1")},
          {.body = {fill_u, run("u_to_v"), run("copy"), fill_v, run("v_to_x1")}, .keeps = {"w", "x1"}}),
      "  prepare fill u periodic\n"
      "  sweep u_to_v\n  sweep copy\n  fill v periodic\n  sweep u_to_v with u = v, v = x1\n"
      "  keep w, x1\n}\n");
}

TEST(Schedule, ADifferentFillOfTheSameFieldStopsAllMoves) {
  const Fill hot{"u", {wall(1.0, 1.0)}}, cold{"u", {wall(0.0, 0.0)}};
  EXPECT_EQ(schedule_of({smooth("u", "v"), smooth("u", "w")}, {.axes = {Topology::bounded},
                                                               .body = {hot, run("u_to_v"), cold, run("u_to_w")},
                                                               .swaps = {{"u", "w"}},
                                                               .keeps = {"v"}}),
            "  fill u x = u0\n  sweep u_to_v\n  fill u x = 0\n  sweep u_to_v with v = w\n  swap u, w\n  keep v\n}\n");
}

TEST(Schedule, ADifferentFillOfTheNextStateKeepsTheFillInTheStep) {
  const Fill cold_u{"u", {wall(0.0, 0.0)}}, free_w{"w", {insulated()}};
  EXPECT_EQ(schedule_of({smooth("u", "w"), smooth("w", "v")}, {.axes = {Topology::bounded},
                                                               .body = {cold_u, run("u_to_w"), free_w, run("w_to_v")},
                                                               .swaps = {{"u", "w"}},
                                                               .keeps = {"v"}}),
            "  fill u x = 0\n  sweep u_to_w then fill w x = zero_gradient\n  sweep u_to_w with u = w, w = v\n  swap u, "
            "w\n  keep v\n}\n");
}

TEST(Schedule, BoundaryValuesThatDependOnTheTimeAreSetInTheStep) {
  const Fill moving{"u", {wall(call(Fn::sin, {param("t")}), 0.0)}};
  EXPECT_EQ(schedule_of({smooth("u", "w")},
                        {.axes = {Topology::bounded}, .body = {moving, run("u_to_w")}, .swaps = {{"u", "w"}}}),
            "  fill u x.low = u0, x.high = 0\n  sweep u_to_w\n  swap u, w\n}\n");
}

TEST(Schedule, AnInputThatIsOverwrittenIsFilledInTheStep) {
  EXPECT_EQ(schedule_of({smooth("u", "w"), {.name = "back", .rank = 1, .stores = {{"u", false, access("w"), {}}}}},
                        {.body = {fill_u, run("u_to_w"), run("back")}, .keeps = {"u"}}),
            "  fill u periodic\n  sweep u_to_w\n  sweep back\n  keep u\n}\n");
}

TEST(Schedule, NextStateWrittenByAScatterIsFilledAtTheEnd) {
  Kernel spread{.name = "spread", .rank = 1, .scatters = {{Interp{"w", {}, {access("u", {1})}, {}}, access("u")}}};
  Kernel clear{.name = "clear", .rank = 1, .stores = {{"w", false, 0.0, {}}}};
  EXPECT_EQ(
      schedule_of({clear, spread}, {.body = {fill_u, run("clear"), run("spread")}, .swaps = {{"u", "w"}}}),
      "  prepare fill u periodic\n  sweep clear\n  sweep spread_scatter serial\n  fill w periodic\n  swap u, w\n}\n");
}

TEST(Schedule, NextStateThatIsFoldedIsFilledAtTheEnd) {
  const std::vector<AxisBoundary> walls = {insulated()};
  EXPECT_EQ(schedule_of({smooth("u", "w")}, {.axes = {Topology::bounded},
                                             .body = {Fill{"u", walls}, run("u_to_w", 1), Fold{"w", 1, walls}},
                                             .swaps = {{"u", "w"}}}),
            "  prepare fill u x = zero_gradient\n  sweep u_to_w grow 1\n  fold w grow 1 x = zero_gradient\n"
            "  fill w x = zero_gradient\n  swap u, w\n}\n");
}

TEST(Schedule, GrownSweepsAreFollowedByTheirFill) {
  EXPECT_EQ(schedule_of({smooth("u", "v"), smooth("v", "w")},
                        {.axes = {Topology::bounded},
                         .body = {run("u_to_v", 1), Fill{"v", {insulated()}}, run("v_to_w")},
                         .keeps = {"w"}}),
            "  sweep u_to_v grow 1\n  fill v x = zero_gradient\n  sweep u_to_v with u = v, v = w\n  keep w\n}\n");
}

/// Waves keep two states: u_old becomes u, whose halo is filled already.
TEST(Schedule, TwoLevelsInTime) {
  Kernel wave{.name = "wave",
              .rank = 1,
              .stores = {{"u_new", false, access("u", {1}) + access("u", {-1}) - access("u_old"), {}}}};
  EXPECT_EQ(schedule_of({wave}, {.body = {fill_u, run("wave")}, .swaps = {{"u_old", "u"}, {"u", "u_new"}}}),
            "  prepare fill u periodic\n  sweep wave then fill u_new periodic\n  swap u_old, u\n  swap u, u_new\n}\n");
  Kernel damped = wave;
  damped.stores[0].value = wave.stores[0].value + access("u_old", {1});
  EXPECT_EQ(schedule_of({damped}, {.body = {fill_u, Fill{"u_old", {periodic()}}, run("wave")},
                                   .swaps = {{"u_old", "u"}, {"u", "u_new"}}}),
            "  prepare fill u periodic\n  prepare fill u_old periodic\n  sweep wave then fill u_new periodic\n"
            "  swap u_old, u\n  swap u, u_new\n}\n");
}

TEST(Schedule, TwoStatesAreFilledByOneSweep) {
  Kernel both{.name = "both",
              .rank = 1,
              .stores = {{"u_next", false, access("v", {1}), {}}, {"v_next", false, access("u", {1}), {}}}};
  EXPECT_EQ(schedule_of({both}, {.body = {fill_u, fill_v, run("both")}, .swaps = {{"u", "u_next"}, {"v", "v_next"}}}),
            "  prepare fill u periodic\n  prepare fill v periodic\n"
            "  sweep both then fill u_next periodic then fill v_next periodic\n"
            "  swap u, u_next\n  swap v, v_next\n}\n");
}

TEST(Schedule, StatesThatAreNotReadAreInputsAllTheSame) {
  Kernel kernel{.name = "set", .rank = 1, .stores = {{"u_next", false, param("t"), {}}}};
  Program program{.name = "p", .axes = {Topology::periodic}, .body = {run("set")}, .swaps = {{"u", "u_next"}}};
  const loop::Module module = loop::from_stencil({{kernel}, {program}, {}}, {"p"});
  EXPECT_EQ(module.programs.at(0).fields, (std::vector<std::string>{"u", "u_next"}));
  EXPECT_EQ(module.programs.at(0).input_count, 1);
}

}  // namespace
}  // namespace dpde
