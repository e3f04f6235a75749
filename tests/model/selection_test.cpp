// SPDX-License-Identifier: Apache-2.0
// What --set, --scheme and a name on the command line do.
#include "model/model_support.h"
#include "model/print/print_model.h"

namespace dpde::model {
namespace {

const std::string two_scenes = R"(
model m { field u; param k; dt(u) = k*lap(u) }
scheme first { time = euler }
scheme second { time = rk2; advect = upwind }
scheme third { time = rk4; dx = central4; lap = central(4); advect = central(4) }
scene a : m {
  grid x = 0 .. 1, cells 8, periodic
  grid y = 0 .. 1, cells 4, periodic
  k = 2
  initial u = 0
  time 0 .. 1, step 1/8
}
scene b : m with second {
  grid x = 0 .. 1, cells 8, periodic
  k = 3
  initial u = 0
  time 0 .. 1, step 1/8
}
task t : b with third { unknown k; minimise mean(u) }
)";

Problem overridden(const std::string& name, const std::map<std::string, std::string>& overrides,
                   const std::string& scheme = "") {
  return problem_of(two_scenes, {name, overrides, scheme});
}

TEST(Selection, NamesInOrder) {
  const SourceFile source("test.dpde", two_scenes);
  DiagnosticSink sink;
  const ast::File file = ast::parse(source, sink);
  EXPECT_EQ(scene_names(file), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(task_names(file), std::vector<std::string>{"t"});
}

TEST(Selection, TheOnlyTaskElseTheOnlyScene) {
  EXPECT_EQ(problem_of(two_scenes).task->name, "t");
  EXPECT_EQ(problem_of(two_scenes).scene, "b");
  EXPECT_EQ(overridden("a", {}).scene, "a");
  EXPECT_FALSE(overridden("b", {}).task.has_value());
  EXPECT_EQ(problem_of(text_with("u*w*k*c")).scene, "s");
  EXPECT_EQ(outcome_of(two_scenes, {"tt", {}, ""}).code_and_hint(), "E0318 did you mean t?");
  EXPECT_EQ(outcome_of(two_scenes, {"wave", {}, ""}).code_and_hint(), "E0318 known here: t, a, b");
  EXPECT_EQ(outcome_of(two_scenes + "task t2 : a { unknown k; minimise mean(u) }").code_and_hint(),
            "E0319 name one of: t, t2, a, b");
  EXPECT_EQ(outcome_of("model m { field u; dt(u) = -u }").code_and_hint(),  // the command does not come so far
            "E0320 write scene NAME : MODEL { grid ...; initial ...; time ... }");
}

TEST(Selection, WhichScheme) {
  EXPECT_EQ(overridden("a", {}).scheme.name, "first");
  EXPECT_EQ(overridden("b", {}).scheme.name, "second");
  EXPECT_EQ(overridden("t", {}).scheme.name, "third");
  EXPECT_EQ(overridden("t", {}, "first").scheme.name, "first");
  EXPECT_EQ(problem_of(text_with("u*w*k*c")).scheme.name, "default");
  EXPECT_EQ(outcome_of(two_scenes, {"b", {}, "secnd"}).code_and_hint(), "E0318 did you mean second?");
}

TEST(Selection, WhatSchemesSay) {
  const Scheme second = overridden("b", {}).scheme, third = overridden("t", {}).scheme,
               built_in = problem_of(text_with("u*w*k*c")).scheme;
  EXPECT_EQ(second.time, time_method("rk2"));
  EXPECT_EQ(second.transport.advect, Advection::upwind);
  EXPECT_EQ(second.transport.order, 1);
  EXPECT_EQ(third.derivative_order, 4);
  EXPECT_EQ(third.laplacian_order, 4);
  EXPECT_EQ(third.transport.advect, Advection::central);
  EXPECT_EQ(third.transport.order, 4);
  EXPECT_EQ(built_in.time, time_method("rk4"));
  EXPECT_EQ(built_in.transport.advect, Advection::central);
  EXPECT_EQ(built_in.transport.order, 2);
}

TEST(Settings, ParametersAndNumbers) {
  EXPECT_EQ(overridden("a", {{"k", "1/4"}}).find_param("k")->value, 0.25);
  EXPECT_EQ(overridden("a", {{"step", "1/16"}}).steps, 16);
  EXPECT_EQ(overridden("a", {{"end", "2"}}).steps, 16);
  EXPECT_EQ(overridden("a", {{"end", "2"}, {"step", "0.5"}}).steps, 4);
}

TEST(Settings, Cells) {
  const auto cells = [](const std::map<std::string, std::string>& overrides) {
    const Problem p = overridden("a", overrides);
    return std::vector<int>{p.axes[0].cells, p.axes[1].cells};
  };
  EXPECT_EQ(cells({}), (std::vector<int>{8, 4}));
  EXPECT_EQ(cells({{"cells", "16"}}), (std::vector<int>{16, 16}));
  EXPECT_EQ(cells({{"cells.y", "5"}}), (std::vector<int>{8, 5}));
  EXPECT_EQ(cells({{"cells", "16"}, {"cells.x", "3"}}), (std::vector<int>{3, 16}));
}

TEST(Settings, SchemeKeys) {
  EXPECT_EQ(overridden("a", {{"time", "rk2"}}).scheme.time, time_method("rk2"));
  EXPECT_EQ(overridden("a", {{"advect", "semi_lagrangian"}}).scheme.transport.advect, Advection::semi_lagrangian);
  EXPECT_EQ(overridden("a", {{"advect", "maccormack"}}).scheme.transport.advect, Advection::maccormack);
  EXPECT_EQ(overridden("a", {{"advect", "central4"}}).scheme.transport.order, 4);
  EXPECT_EQ(overridden("a", {{"advect", "upwind1"}}).scheme.transport.advect, Advection::upwind);
  EXPECT_EQ(overridden("a", {{"dx", "central(4)"}}).scheme.derivative_order, 4);
  EXPECT_EQ(overridden("a", {{"lap", "central4"}}).scheme.laplacian_order, 4);
  EXPECT_EQ(overridden("a", {{"real", "f64"}}).scheme.name, "first");
  EXPECT_EQ(overridden("a", {}).scheme.real, Precision::f64);
  EXPECT_EQ(overridden("a", {{"real", "f32"}}).scheme.real, Precision::f32);
  EXPECT_NE(print(overridden("a", {{"real", "f32"}}).scheme).find("; real = f32 }"), std::string::npos);
}

}  // namespace
}  // namespace dpde::model
