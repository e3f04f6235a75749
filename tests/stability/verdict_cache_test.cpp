// SPDX-License-Identifier: Apache-2.0
// Verdicts as text and back: nothing is lost, and an incomplete text is refused.
#include "stability/report/verdict_cache.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <map>

#include "driver/compile/pipeline.h"

namespace dpde::stability {
namespace {

/// All its numbers differ, so that a swap of two is detected.
StabilityReport any_verdict() {
  StabilityReport v;
  v.limit = {StepLimit::Kind::limit, 0.1, 2.5, {1.5, -2, 1e-300}, 3};
  v.wave = {0.7, -0.8, 0.9};
  v.is_of_walls = true;
  v.limiter_step = 0.2;
  v.step = 1.0 / 3;
  v.parts = 4;
  v.places = 5;
  v.places_between_walls = 6;
  v.growth = std::numeric_limits<double>::infinity();
  v.beyond = 0.11;
  v.growth_rate = 0.12;
  v.end_growth = 0.13;
  v.largest_step = 0.14;
  v.place = "x = 0.1, y = 2";
  v.field = "u.x";
  v.worst.fields["u.x"].value = std::numeric_limits<double>::quiet_NaN();
  v.worst.fields["u.x"].slope = {21, 22, 23};
  v.worst.whole["psi"].value = 24;
  v.worst.whole["psi"].slope = {25, -26, 27};
  v.worst.whole["phi"].value = 28;
  v.worst.params = {{"cells.x", 16}, {"k", 29}, {"nu", 30}};
  v.worst.place = {31, 32, 33};
  v.worst.cells = {34, 35, 36};
  v.worst.longest_wave = {37, 38, 39};
  v.courant = 0.5;
  v.short_waves = {0.15, 4.5};
  return v;
}

TEST(VerdictCache, KeepsAllOfAVerdict) {
  const std::string text = text_of(any_verdict());
  const std::optional<StabilityReport> back = verdict_from(text);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(text_of(*back), text);
  EXPECT_EQ(back->place, "x = 0.1, y = 2");
  EXPECT_EQ(back->step, 1.0 / 3);
  EXPECT_EQ(back->worst.params.at("cells.x"), 16);
  EXPECT_EQ(back->worst.whole, any_verdict().worst.whole);
  EXPECT_EQ(back->short_waves->cells, 4.5);
  EXPECT_FALSE(verdict_from(text_of(StabilityReport{.why = "a network is in it"}))->is_analysed());
}

TEST(VerdictCache, TellsItsFlagsAndKindsApart) {
  for (bool StabilityReport::*const flag :
       {&StabilityReport::is_exact, &StabilityReport::is_of_walls, &StabilityReport::is_of_grid,
        &StabilityReport::is_of_networks, &StabilityReport::is_of_means}) {
    StabilityReport v;
    v.*flag = true;
    EXPECT_EQ(text_of(verdict_from(text_of(v)).value()), text_of(v));
  }
  for (const StabilityReport::Runs runs :
       {StabilityReport::Runs::none, StabilityReport::Runs::made, StabilityReport::Runs::left_out}) {
    StabilityReport v;
    v.runs = runs;
    EXPECT_EQ(verdict_from(text_of(v)).value().runs, runs);
  }
  for (const StepLimit::Kind kind : {StepLimit::Kind::limit, StepLimit::Kind::none, StepLimit::Kind::never}) {
    StabilityReport v;
    v.limit.kind = kind;
    EXPECT_EQ(verdict_from(text_of(v)).value().limit.kind, kind);
  }
}

TEST(VerdictCache, TakesNothingThatIsNotWhole) {
  const std::string text = text_of(any_verdict());
  for (std::size_t length = 0; length < text.size(); ++length) EXPECT_FALSE(verdict_from(text.substr(0, length)));
  std::string other = text;
  other[text.find("0.3333")] = 'x';
  EXPECT_FALSE(verdict_from(other));
}

/// The key of a scene; `change` comes between its session and the key.
std::string key_with(const std::map<std::string, std::string>& settings,
                     const std::function<void(driver::Session&)>& change = {}) {
  const SourceFile source("test.dpde", R"(
model heat { field u; param k; coefficient c; control F; dt(u) = k*div(c*grad(u)) + F }
scheme plain { time = rk4 }
scene rod : heat with plain {
  grid x = 0 .. 1, cells 8, periodic
  k = 0.3
  c = 1 + 0.1*sin(2*pi*x)
  F = 0.1 + t every 1/8
  initial u = sin(2*pi*x)
  time 0 .. 1, step 1/64
}
)");
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.backend = driver::Backend::jit;
  options.selection.overrides = settings;
  options.selection.keeps_params = true;
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message;
  if (!compiled) return "";
  const auto session =
      driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(compiled).value()), {}, sink);
  if (change) change(*session);
  return key_of(*session);
}

/// All that a verdict depends on is in the key, and nothing else is.
TEST(VerdictCache, KeysAreThoseOfTheScene) {
  const std::string key = key_with({});
  EXPECT_EQ(key_with({}), key);
  for (const auto& [name, value] : std::map<std::string, std::string>{
           {"k", "0.31"}, {"cells", "9"}, {"step", "1/128"}, {"end", "2"}, {"real", "f32"}, {"time", "ssp_rk3"}})
    EXPECT_NE(key_with({{name, value}}), key) << name;
  // What hosts and optimisers set.
  EXPECT_NE(key_with({}, [](driver::Session& s) { s.workspace().set_param("k", 0.31); }), key);
  const auto in_last_cell = [](driver::Session& session) {
    std::vector<double> values = session.workspace().dense("c");
    values.back() += 1e-15;
    session.workspace().set_dense("c", values);
  };
  EXPECT_NE(key_with({}, in_last_cell), key);
  const auto at_start = [](driver::Session& session) {
    std::vector<double> values = session.initial(0);
    values.front() += 1e-15;
    session.rollout().initial(0).copy_in(values);
  };
  EXPECT_NE(key_with({}, at_start), key);
}

}  // namespace
}  // namespace dpde::stability
