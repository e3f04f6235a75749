// SPDX-License-Identifier: Apache-2.0
// The kernels and programs a problem becomes, letter by letter.
#include <gtest/gtest.h>

#include "stencil/model_builder.h"
#include "stencil/scene_run.h"

namespace lowering_text {
namespace {

using namespace model_builder;
using dpde::stencil::print;
using scene_run::lower;

const Expr u = field("u"), v = field("v"), nu = param("nu"), kappa = field("kappa");

std::string store(const Expr& rate, std::vector<int> cells = {8}, int dx = 2, int dlap = 2) {
  model::Problem p = problem({state("u", rate)}, std::move(cells));
  p.scheme.derivative_order = p.scheme.transport.order = dx;
  p.scheme.laplacian_order = dlap;
  const dpde::stencil::Module module = lower(p);
  const dpde::stencil::Kernel& kernel = module.kernels.at(0);
  std::string text;
  for (const dpde::stencil::Let& let : kernel.lets) text += let.name + " = " + print(let.value, kernel.rank) + "; ";
  return text + print(kernel.stores.at(0).value, kernel.rank);
}

TEST(LoweringText, BurgersEuler) {
  const model::Problem p = problem({state("u", -advect({u}, u) + nu * lap(u))});
  EXPECT_EQ(print(lower(p)), R"(kernel s_step(u: field halo 1, out u_next: field, hx, dt, nu: param) {
  let u_x = (u[+1] - u[-1])/(2*hx)
  let u_xx = (u[-1] - 2*u + u[+1])/hx^2
  u_next = u + dt*(nu*u_xx - u*u_x)
}

program s_step {
  fill u periodic
  run s_step
  swap u, u_next
}

loop n in 0 .. 10 { s_step }
)");
}

TEST(LoweringText, HeatInTwoDimensionsWithBoundaries) {
  model::Problem p = problem({state("u", nu * lap(u, 2))}, {8, 6});
  p.axes[0].topology = Topology::bounded;
  p.states[0].boundary[0].low.value = param("wall") + 1.0;
  p.states[0].boundary[0].high.kind = dpde::SideKind::zero_gradient;
  EXPECT_EQ(print(lower(p)), R"(kernel s_step(u: field halo 1, out u_next: field, hx, hy, dt, nu: param) {
  let u_xx = (u[-1, 0] - 2*u + u[+1, 0])/hx^2
  let u_yy = (u[0, -1] - 2*u + u[0, +1])/hy^2
  u_next = u + dt*nu*(u_xx + u_yy)
}

program s_step {
  fill u x.low = wall + 1, x.high = zero_gradient, y periodic
  run s_step
  swap u, u_next
}

loop n in 0 .. 10 { s_step }
)");
}

TEST(LoweringText, RungeKutta4KeepsStates) {
  model::Problem p = problem({state("u", nu * lap(u) + param("t"))});
  p.scheme.time = model::time_method("rk4");
  EXPECT_EQ(print(lower(p)), R"(kernel s_stage1(u: field halo 1, out u_1: field, hx, dt, nu, t: param) {
  let u_xx = (u[-1] - 2*u + u[+1])/hx^2
  u_1 = u + dt/2*(nu*u_xx + t)
}

kernel s_stage2(u_1: field halo 1, u: field, out u_2: field, hx, dt, nu, t: param) {
  let u_xx = (u_1[-1] - 2*u_1 + u_1[+1])/hx^2
  u_2 = u + dt/2*(nu*u_xx + (t + dt/2))
}

kernel s_stage3(u_2: field halo 1, u: field, out u_3: field, hx, dt, nu, t: param) {
  let u_xx = (u_2[-1] - 2*u_2 + u_2[+1])/hx^2
  u_3 = u + dt*(nu*u_xx + (t + dt/2))
}

kernel s_stage4(u_3: field halo 1, u_2: field, u_1: field, u: field, out u_next: field, hx, dt, nu, t: param) {
  let u_xx = (u_3[-1] - 2*u_3 + u_3[+1])/hx^2
  u_next = u_2 + ((u_1 - u_2 + (u_3 - u))/3 + dt/6*(nu*u_xx + (t + dt)))
}

program s_step {
  fill u periodic
  run s_stage1
  fill u_1 periodic
  run s_stage2
  fill u_2 periodic
  run s_stage3
  fill u_3 periodic
  run s_stage4
  swap u, u_next
}

loop n in 0 .. 10 { s_step }
)");
}

TEST(LoweringText, MidpointMethodLeavesStatesAtRestAlone) {
  model::Problem p = problem({state("u", -d(v)), state("v", 0.0)});
  p.scheme.time = model::time_method("rk2");
  EXPECT_EQ(print(lower(p)), R"(kernel s_stage1(v: field halo 1, u: field, out u_1: field, hx, dt: param) {
  let v_x = (v[+1] - v[-1])/(2*hx)
  u_1 = u - dt/2*v_x
}

kernel s_stage2(v: field halo 1, u: field, out u_next: field, out v_next: field, hx, dt: param) {
  let v_x = (v[+1] - v[-1])/(2*hx)
  u_next = u - dt*v_x
  v_next = v
}

program s_step {
  fill v periodic
  run s_stage1
  run s_stage2
  swap u, u_next
  swap v, v_next
}

loop n in 0 .. 10 { s_step }
)");
}

TEST(LoweringText, BoundaryValuesOfStagesAreTakenAtTheirTime) {
  model::Problem p = problem({state("u", lap(u))}, {8}, 1, Topology::bounded);
  p.states[0].boundary[0].low.value = param("t");
  p.scheme.time = model::time_method("rk2");
  const dpde::stencil::Module module = lower(p);
  EXPECT_EQ(print(*module.find_program("s_step")), R"(program s_step {
  fill u x.low = t, x.high = 0
  run s_stage1
  fill u_1 x.low = t + dt/2, x.high = 0
  run s_stage2
  swap u, u_next
}
)");
}

TEST(LoweringText, SemiLagrangian) {
  model::Problem p = problem({state("u", -advect({u}, u) + nu * lap(u)), state("v", -advect({u}, v))});
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  EXPECT_EQ(print(lower(p)), R"(kernel s_terms(u: field halo 1, out u_mid: field, hx, dt, nu: param) {
  let u_xx = (u[-1] - 2*u + u[+1])/hx^2
  u_mid = u + dt*nu*u_xx
}

kernel s_advect(u_mid: field halo 1, v: field halo 1, out u_next: field, out v_next: field, dt, hx: param) {
  u_next = interp(u_mid, -dt*u_mid/hx)
  v_next = interp(v, -dt*u_mid/hx)
}

program s_step {
  fill u periodic
  run s_terms
  fill u_mid periodic
  fill v periodic
  run s_advect
  swap u, u_next
  swap v, v_next
}

loop n in 0 .. 10 { s_step }
)");
}

TEST(LoweringText, SemiLagrangianWithoutOtherTermsAndWithoutTransport) {
  model::Problem p = problem({state("u", nu * lap(u) - advect({param("c") + 0.0, -v}, u)), state("v", 1.0)}, {4, 4});
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  const dpde::stencil::Module module = lower(p);
  EXPECT_EQ(
      print(*module.find_kernel("s_advect")),
      R"(kernel s_advect(u_mid: field halo 1, v_mid: field, out u_next: field, out v_next: field, dt, c, hx, hy: param) {
  u_next = interp(u_mid, -dt*c/hx, dt*v_mid/hy)
  v_next = v_mid
}
)");
  p = problem({state("u", -advect({u}, u))});
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  const dpde::stencil::Module pure = lower(p);
  ASSERT_EQ(pure.kernels.size(), 1u);
  EXPECT_EQ(print(pure.kernels[0].stores[0].value, 1), "interp(u, -dt*u/hx)");
}

TEST(LoweringText, CubicSemiLagrangian) {
  model::Problem p = problem({state("u", -advect({u, 0.5}, u))}, {4, 4});
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.scheme.transport.order = 3;
  EXPECT_EQ(print(lower(p).kernels.at(0).stores[0].value, 2), "interp_cxcy(u, -dt*u/hx, -dt*0.5/hy)");
}

/// Forwards with the flow at the begin, back with that at the end; a field that nothing carries has no step ahead.
TEST(LoweringText, MacCormack) {
  model::Problem p = problem({state("u", -advect({u}, u) + v), state("v", 1.0)}, {4}, 4, Topology::bounded);
  p.scheme.transport.advect = model::Advection::maccormack;
  const dpde::stencil::Module module = lower(p);
  EXPECT_EQ(print(*module.find_kernel("s_advect")),
            R"(kernel s_advect(u_mid: field halo 1, u: field, out u_ahead: field, dt, hx: param) {
  u_ahead = interp(u_mid, -dt*u/hx)
}
)");
  EXPECT_EQ(
      print(*module.find_kernel("s_correct")),
      R"(kernel s_correct(u: field, u_ahead: field halo 1, u_mid: field halo 1, x: field, v_mid: field, out u_next: field, out v_next: field, dt, hx: param) {
  let back_x = -dt*u/hx
  let forth_x = dt*u_ahead/hx
  let u_mid_corner = interp_lx(u_mid, back_x)
  let u_mid_corner_2 = interp_ux(u_mid, back_x)
  let u_mid_least = min(u_mid_corner, u_mid_corner_2)
  let u_mid_greatest = max(u_mid_corner, u_mid_corner_2)
  u_next = min(u_mid_greatest, max(u_ahead + if(max(abs(back_x), abs(forth_x)) <= min(x, 4 - x)/hx, (u_mid - interp(u_ahead, forth_x))/2, 0), u_mid_least))
  v_next = v_mid
}
)");
}

TEST(LoweringText, Upwind) {
  model::Problem p = problem({state("u", -advect({u, 0.0}, u)), state("v", advect({-2.0, u + v}, v))}, {4, 4});
  p.scheme.transport.advect = model::Advection::upwind;
  p.scheme.transport.order = 1;
  p.scheme.transport.order = 1;
  EXPECT_EQ(
      print(lower(p).kernels.at(0)),
      R"(kernel s_step(u: field halo 1, v: field halo 1, out u_next: field, out v_next: field, dt, hx, hy: param) {
  let velocity_y = u + v
  u_next = u - dt*(max(u, 0)*(u - u[-1, 0])/hx + min(u, 0)*(u[+1, 0] - u)/hx)
  v_next = v + dt*(-2*(v[+1, 0] - v)/hx + max(velocity_y, 0)*(v - v[0, -1])/hy + min(velocity_y, 0)*(v[0, +1] - v)/hy)
}
)");
}

TEST(LoweringText, UpwindOfADerivativeTakesNeighboursOfTheDerivative) {
  model::Problem p = problem({state("u", -advect({param("c")}, d(u)))});
  p.scheme.transport.advect = model::Advection::upwind;
  p.scheme.transport.order = 1;
  EXPECT_EQ(print(lower(p).kernels.at(0)), R"(kernel s_step(u: field halo 2, out u_next: field, hx, dt, c: param) {
  let u_x = (u[+1] - u[-1])/(2*hx)
  u_next = u - dt*(max(c, 0)*(u_x - (u - u[-2])/(2*hx))/hx + min(c, 0)*((u[+2] - u)/(2*hx) - u_x)/hx)
}
)");
}

TEST(LoweringText, FourthOrder) {
  EXPECT_EQ(store(-advect({u}, u) + nu * lap(u), {8}, 4, 4),
            "u_x = (8*(u[+1] - u[-1]) - (u[+2] - u[-2]))/(12*hx); "
            "u_xx = (16*(u[-1] + u[+1]) - (u[-2] + u[+2]) - 30*u)/(12*hx^2); u + dt*(nu*u_xx - u*u_x)");
}

TEST(LoweringText, ConservativeForms) {
  EXPECT_EQ(store(-d(u * u / 2.0)), "u - dt*(u[+1]*u[+1]/2 - u[-1]*u[-1]/2)/(2*hx)");
  EXPECT_EQ(store(d(kappa * d(u))),
            "u + dt*((kappa + kappa[+1])*(u[+1] - u) - (kappa[-1] + kappa)*(u - u[-1]))/(2*hx^2)");
  EXPECT_EQ(store(d(param("c") * d(u))), "u + dt*(c*(u[+1] - u) - c*(u - u[-1]))/hx^2");
  EXPECT_EQ(store(d((1.0 + (u ^ 2.0)) * d(u))),
            "u + dt*((1 + (u^2 + u[+1]^2)/2)*(u[+1] - u) - (1 + (u[-1]^2 + u^2)/2)*(u - u[-1]))/hx^2");
  EXPECT_EQ(store(d((1.0 + coordinate(0)) * d(u))),
            "u + dt*((1 + (x + hx/2))*(u[+1] - u) - (1 + (x[-1] + hx/2))*(u - u[-1]))/hx^2");
}

TEST(LoweringText, NestedDerivatives) {
  EXPECT_EQ(store(d(d(u))), "u + dt*(u[+1] - u - (u - u[-1]))/hx^2");
  EXPECT_EQ(store(d(d(u, 1), 0), {4, 4}), "u + dt*(u[+1, +1] - u[+1, -1] - (u[-1, +1] - u[-1, -1]))/(4*hx*hy)");
  EXPECT_EQ(store(-d(d(u, 0, 2))), "u - dt*(u - 2*u[+1] + u[+2] - (u[-2] - 2*u[-1] + u))/(2*hx^3)");
  EXPECT_EQ(store(-lap(lap(u))), "u - dt*(u[-2] - 2*u[-1] + u - 2*(u[-1] - 2*u + u[+1]) + (u - 2*u[+1] + u[+2]))/hx^4");
  EXPECT_EQ(store(-d(u, 0, 3)), "u_xxx = (u[+2] - u[-2] - 2*(u[+1] - u[-1]))/(2*hx^3); u - dt*u_xxx");
}

TEST(LoweringText, FreshNamesAvoidThoseOfTheProblem) {
  model::Problem p = problem({state("u", nu * lap(u) + field("u_next") + field("u_xx"))});
  p.coefficients = {{"u_next", {}}, {"u_xx", {}}};
  EXPECT_EQ(print(lower(p).kernels.at(0)),
            R"(kernel s_step(u: field halo 1, u_next: field, u_xx: field, out u_next_2: field, hx, dt, nu: param) {
  let u_xx_2 = (u[-1] - 2*u + u[+1])/hx^2
  u_next_2 = u + dt*(nu*u_xx_2 + u_next + u_xx)
}
)");
}

TEST(LoweringText, CoefficientsReadAtOffsetsAreFilledWithoutGradient) {
  model::Problem p = problem({state("u", d(kappa * d(u)) + field("f"))}, {8}, 1, Topology::bounded);
  p.coefficients = {{"kappa", {}}, {"f", {}}};
  p.coefficients[0].value.formula = 1.0 + coordinate(0);
  p.coefficients[1].value.formula = kappa * 2.0;
  const dpde::stencil::Module module = lower(p);
  EXPECT_EQ(print(*module.find_program("s_step")), R"(program s_step {
  fill u x = 0
  fill kappa x = zero_gradient
  run s_step
  swap u, u_next
}
)");
  EXPECT_EQ(print(*module.find_kernel("s_coefficients_2")), R"(kernel s_coefficients_2(kappa: field, out f: field) {
  f = kappa*2
}
)");
  EXPECT_EQ(print(*module.find_program("s_coefficients")), R"(program s_coefficients {
  axes x bounded
  run s_coefficients
  run s_coefficients_2
  keep kappa, f
}
)");
}

TEST(LoweringText, InitialExactAndStart) {
  model::Problem p = problem({state("u", 0.0 - u), state("v", u)});
  p.states[0].initial.formula = call(Fn::sin, coordinate(0));
  p.states[1].initial.file = "v.npy";
  p.states[0].exact = call(Fn::exp, -param("t"));
  p.task.emplace();
  p.task->name = "k";
  using Kind = model::Unknown::Kind;
  p.task->unknowns = {{Kind::initial, "u", {}, {}}, {Kind::initial, "v", {}, {}}, {Kind::parameter, "nu", {}, {}}};
  p.task->unknowns[0].from.formula = 0.0;
  p.task->unknowns[1].from.file = "guess.npy";
  p.task->unknowns[2].from.formula = 1.0;
  const dpde::stencil::Module module = lower(p);
  std::vector<std::string> names;
  for (const dpde::stencil::Program& program : module.programs) names.push_back(program.name);
  EXPECT_EQ(names, (std::vector<std::string>{"s_initial", "k_start", "s_step", "s_exact"}));
  EXPECT_EQ(print(*module.find_kernel("s_initial")), "kernel s_initial(x: field, out u: field) {\n  u = sin(x)\n}\n");
  EXPECT_EQ(print(*module.find_kernel("k_start")), "kernel k_start(out u: field) {\n  u = 0\n}\n");
  EXPECT_EQ(print(*module.find_kernel("s_exact")),
            "kernel s_exact(out u_exact: field, t: param) {\n  u_exact = exp(-t)\n}\n");
  EXPECT_EQ(module.find_program("s_initial")->keeps, std::vector<std::string>{"u"});
  EXPECT_EQ(module.find_program("s_exact")->keeps, std::vector<std::string>{"u_exact"});
}

TEST(LoweringText, ScenesOfHandWrittenProgramsGetNoStep) {
  model::Problem p = problem({state("u", 0.0)});
  p.program = "leapfrog";
  p.states[0].rhs.reset();
  p.states[0].initial.formula = 1.0;
  const dpde::stencil::Module module = lower(p);
  ASSERT_EQ(module.programs.size(), 1u);
  EXPECT_EQ(module.programs[0].name, "s_initial");
  EXPECT_TRUE(module.loops.empty());
}

TEST(LoweringText, Quantities) {
  model::Problem p = problem({state("u", nu * lap(u))});
  p.observables = {{"energy", 0.5 * integral(u * u), {}},
                   {"roughness", -(mean(u) * 2.0) + mean(d(u) ^ 2.0) / nu, {}},
                   {"total", sum(u) - mean(u) - 1.0, {}}};
  p.task.emplace();
  p.task->name = "k";
  p.task->data = {{"u_ref", "r.npy"}};
  p.task->losses = {{mean((u - field("u_ref")) ^ 2.0), {}, {}}, {0.1 * mean(d(u - field("u_ref")) ^ 2.0), {}, {}}};
  p.task->tests = {{{"worst", mean(u), {}}, {}}};
  const dpde::stencil::Module module = lower(p);
  EXPECT_EQ(
      print(*module.find_kernel("s_observe")),
      R"(kernel s_observe(u: field halo 1, sum energy: param, sum roughness: param, sum total: param, hx, cells, nu: param) {
  let u_x = (u[+1] - u[-1])/(2*hx)
  energy += 0.5*u*u*hx
  roughness += -2*u/cells + u_x^2/(nu*cells)
  total += u - u/cells - 1/cells
}
)");
  EXPECT_EQ(
      print(*module.find_kernel("k_loss_1")),
      "kernel k_loss_1(u: field, u_ref: field, sum loss: param, cells: param) {\n  loss += (u - u_ref)^2/cells\n}\n");
  EXPECT_EQ(print(*module.find_program("k_loss_2")), R"(program k_loss_2 {
  fill u periodic
  fill u_ref periodic
  run k_loss_2
}
)");
  EXPECT_EQ(print(*module.find_kernel("k_test_worst")),
            "kernel k_test_worst(u: field, sum worst: param, cells: param) {\n  worst += u/cells\n}\n");
}

TEST(LoweringText, AdvectOutsideTheStepIsCentralUnderSemiLagrangian) {
  model::Problem p = problem({state("u", -advect({u}, u))});
  p.scheme.transport.advect = model::Advection::semi_lagrangian;
  p.scheme.transport.order = 1;
  p.observables = {{"steepening", mean(advect({u}, u)), {}}};
  EXPECT_EQ(print(*lower(p).find_kernel("s_observe")),
            R"(kernel s_observe(u: field halo 1, sum steepening: param, hx, cells: param) {
  let u_x = (u[+1] - u[-1])/(2*hx)
  steepening += u*u_x/cells
}
)");
}

}  // namespace
}  // namespace lowering_text
