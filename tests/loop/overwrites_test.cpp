// SPDX-License-Identifier: Apache-2.0
// Which states a program may be written over, case by case.
#include "loop/overwrites.h"

#include <gtest/gtest.h>

#include "loop/from_stencil.h"
#include "loop/loop_samples.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"

namespace dpde {
namespace {

using namespace samples;  // NOLINT

Kernel storing(std::string name, std::vector<Store> stores) {
  Kernel kernel{.name = std::move(name), .rank = 1};
  kernel.stores = std::move(stores);
  return kernel;
}

/// v is a velocity: v_next = v + dt*(u[+1] - u), u_next = u + dt*v_next.
Kernel velocity_wave() {
  const Expr u = access("u"), v = access("v"), dt = param("dt");
  const Expr kick = v + dt * (access("u", {1}) - u);
  return storing("wave", {{"v_next", false, kick, {}}, {"u_next", false, u + dt * kick, {}}});
}

struct OverwriteCase {
  std::string name, swaps;  // those that are `over`, by the names of their states
  Module module;
};

Module swapping(std::vector<Kernel> kernels, std::vector<Statement> body, std::vector<std::string> keeps = {},
                std::vector<Swap> swaps = {{"u", "u_next"}, {"v", "v_next"}}) {
  Program program{.name = "p", .axes = {Topology::periodic}, .body = std::move(body), .swaps = std::move(swaps)};
  program.keeps = std::move(keeps);
  return {std::move(kernels), {program}, {}};
}

std::vector<OverwriteCase> overwrite_cases() {
  const Expr u = access("u"), v = access("v"), dt = param("dt");
  const Fill fill_u{"u", {periodic()}}, fill_v{"v", {periodic()}}, fill_next{"v_next", {periodic()}};
  const Kernel apart = storing("apart", {{"v_next", false, v + dt * u, {}}, {"u_next", false, u - dt * v, {}}});
  const Kernel before = storing("before", {{"w", false, access("v", {1}) - v, {}}});
  const Kernel behind = storing("behind", {{"w", false, v * u, {}}});
  const Kernel drift = storing("drift", {{"u_next", false, u + dt * access("v_next"), {}}});
  const Kernel kick = storing("kick", {{"v_next", false, v + dt * u, {}}});
  const Kernel shift = storing("shift", {{"v_next", false, u + dt * v, {}}});
  return {
      {"its own cell alone", "v", swapping({velocity_wave()}, {fill_u, run("wave")})},
      {"both of their own cells", "u v", swapping({apart}, {run("apart")})},
      {"two sweeps", "u v", swapping({kick, drift}, {run("kick"), run("drift")})},
      {"neighbours of it, before", "u", swapping({before, apart}, {fill_v, run("before"), run("apart")})},
      {"read behind", "", swapping({apart, behind}, {run("apart"), run("behind")}, {"w"})},
      {"kept", "u", swapping({apart}, {run("apart")}, {"v"})},
      {"the next one kept", "u", swapping({apart}, {run("apart")}, {"v_next"})},
      {"its halo filled", "u", swapping({apart}, {run("apart"), fill_next})},
      {"of the step before", "", swapping({shift}, {run("shift")}, {}, {{"v", "u"}, {"u", "v_next"}})},
  };
}

TEST(Overwrites, AreOfStatesThatARowReadsAtItsOwnCellAlone) {
  for (const OverwriteCase& c : overwrite_cases()) {
    SCOPED_TRACE(c.name);
    const loop::Module module = loop::from_stencil(c.module, {"p"});
    EXPECT_EQ(loop::verify(module), std::vector<std::string>{});
    std::string found;
    for (const loop::Swap& swap : module.programs.at(0).swaps) {
      if (swap.is_over) found += (found.empty() ? "" : " ") + swap.state;
    }
    EXPECT_EQ(found, c.swaps) << loop::print(module);
  }
}

/// Stores of a cell stand one after the other: the second one reads what the first one is written over.
TEST(Overwrites, ARowReadsBeforeItWrites) {
  const loop::Module module = loop::from_stencil(overwrite_cases().at(1).module, {"p"});
  EXPECT_EQ(loop::print(module, module.rows.at(0)), R"(row apart {
  out v_next over v, u_next over u
  in v, u
  let u_before = u
  let v_before = v
  v_next = v_before + dt*u_before
  u_next = u_before - dt*v_before
}
)");
}

TEST(Overwrites, TheVerifierLooksAtStreams) {
  loop::Module module = loop::from_stencil(overwrite_cases().at(0).module, {"p"});
  ASSERT_EQ(module.rows.at(0).streams.at(0).field, "v_next");
  const int own = module.rows.at(0).streams.at(0).over;
  for (const int over : {own, -1, 0, 1, 99, -2}) {
    module.rows.at(0).streams.at(0).over = over;
    EXPECT_EQ(loop::verify(module).empty(), over == own || over == -1) << over;
  }
}

}  // namespace
}  // namespace dpde
