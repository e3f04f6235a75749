// SPDX-License-Identifier: Apache-2.0
// Whole programs as loop text, and the rules for uniforms, streams and rows one by one.
#include "loop/from_stencil.h"

#include <gtest/gtest.h>

#include "loop/loop_samples.h"
#include "loop/print_loop.h"
#include "loop/verify_loop.h"

namespace dpde {
namespace {

using namespace samples;  // NOLINT

const std::vector<std::string> no_errors;

loop::Module lower(const stencil::Module& module) {
  std::vector<std::string> names;
  for (const Program& program : module.programs) names.push_back(program.name);
  const loop::Module result = loop::from_stencil(module, names);
  EXPECT_EQ(loop::verify(result), no_errors);
  return result;
}

/// A periodic 1-D program that runs one kernel once.
stencil::Module single(Kernel kernel) {
  kernel.name = "k";
  Program program{.name = "p", .axes = std::vector(kernel.rank, Topology::periodic)};
  program.body = {run("k")};
  return {{kernel}, {program}, {}};
}

/// The text of the only row of a kernel that stores `value` to v, without its first and last line, and its uniforms.
std::string row_text(const Expr& value, std::vector<Let> lets = {}) {
  Kernel kernel{.rank = 1, .lets = std::move(lets), .stores = {{"v", false, value, {}}}};
  const loop::Module module = lower(single(kernel));
  std::string text;
  for (const loop::UniformDef& uniform : module.uniforms) text += loop::print(module, uniform) + "\n";
  const loop::Row& row = module.rows.at(0);
  for (const loop::Let& let : row.lets) text += "let " + let.name + " = " + loop::print(module, row, let.value) + "\n";
  return text + loop::print(module, row, row.stores.at(0).value);
}

TEST(FromStencil, Burgers) {
  EXPECT_EQ(loop::print(lower(burgers())), R"(params hx, dt, nu
uniform u0 = 1/(2*hx)
uniform u1 = nu/hx^2
uniform dt

row burgers_step {
  out u_next
  in u[-1], u, u[+1]
  let ux = u0*(u[+1] - u[-1])
  u_next = u + dt*(u1*(u[-1] - 2*u + u[+1]) - u*ux)
}

program burgers_step {
  axes x periodic
  inputs u
  fields u_next
  halo 1
  prepare fill u periodic
  sweep burgers_step then fill u_next periodic
  swap u, u_next
}
)");
}

TEST(FromStencil, HeatInTwoDimensions) {
  EXPECT_EQ(loop::print(lower(heat_2d())), R"(params hot, dt, kappa, hx, hy
uniform hot
uniform u0 = 1/hx^2
uniform u1 = 1/hy^2
uniform u2 = dt*kappa

row heat_step {
  out u_next
  in u[0, -1], u[-1, 0], u, u[+1, 0], u[0, +1]
  u_next = u + u2*(u0*(u[-1, 0] - 2*u + u[+1, 0]) + u1*(u[0, -1] - 2*u + u[0, +1]))
}

program heat_step {
  axes x bounded, y bounded
  inputs u
  fields u_next
  halo 1, 1
  prepare fill u x.low = hot, x.high = 0, y = zero_gradient
  sweep heat_step then fill u_next x.low = hot, x.high = 0, y = zero_gradient
  swap u, u_next
}
)");
}

const Expr u = access("u"), w = access("w"), a = param("a"), b = param("b"), c = param("c");

/// Not so where a decision hangs on them: as they are written, and rounded one by one.
TEST(FromStencil, WhatDecidesIsComputedAsItIsWritten) {
  EXPECT_EQ(row_text(call(Fn::sign, {a * u / b - a * (b * w)})),
            "a\nu0 = 1/b\nb\nsign(rounded(a*u*u0) - rounded(a*(b*w)))");
  EXPECT_EQ(row_text(binary(BinaryOp::less, power(u, 2.0) + w, 1.0)), "rounded(u*u) + w < 1");
}

TEST(FromStencil, UniformFactorsOfProductsMeet) {
  EXPECT_EQ(row_text(a * u / b * 3 / (2 * c)), "u0 = 3*a/(2*b*c)\nu0*u");
  EXPECT_EQ(row_text(u / a), "u0 = 1/a\nu0*u");
  EXPECT_EQ(row_text(a * (u * b)), "u0 = a*b\nu0*u");
  EXPECT_EQ(row_text(u * w), "u*w");
  EXPECT_EQ(row_text(a * u), "a\na*u");
}

TEST(FromStencil, SignsMoveOut) {
  EXPECT_EQ(row_text(w - (-a) * u / b), "u0 = a/b\nw + u0*u");
  EXPECT_EQ(row_text(w + a * (-u)), "a\nw - a*u");
  EXPECT_EQ(row_text(-(u * a)), "a\n-a*u");
}

TEST(FromStencil, NumbersAreFoldedIntoOne) {
  EXPECT_EQ(row_text(u / 4), "0.25*u");
  EXPECT_EQ(row_text(2 * (u * 3)), "6*u");
  EXPECT_EQ(row_text(4 * (u / 2)), "2*u");
  EXPECT_EQ(row_text(2 * (u / 2)), "u");
}

TEST(FromStencil, DivisorsThatVaryStay) {
  EXPECT_EQ(row_text(a / (b * u)), "u0 = a/b\nu0/u");
  EXPECT_EQ(row_text(1 / u / w), "1/(u*w)");
  EXPECT_EQ(row_text(u / (w / a)), "a\na*u/w");
}

TEST(FromStencil, SumsAreLeftAlone) { EXPECT_EQ(row_text(a + u + b), "a\nb\na + u + b"); }

TEST(FromStencil, UniformSubexpressionsAreOneUniform) {
  EXPECT_EQ(row_text(u + call(Fn::sin, {a * b + 1})), "u0 = sin(a*b + 1)\nu + u0");
  EXPECT_EQ(row_text(u + a * b + (u - a * b)), "u0 = a*b\nu + u0 + (u - u0)");
  EXPECT_EQ(row_text(u * select(binary(BinaryOp::less, a, b), a, b)), "u0 = if(a < b, a, b)\nu0*u");
}

TEST(FromStencil, UniformLetsDisappear) {
  EXPECT_EQ(row_text(local("c") * u, {{"c", a / b}}), "c = a/b\nc*u");
  EXPECT_EQ(row_text(local("c") * u, {{"c", a}}), "a\na*u");
  EXPECT_EQ(row_text(local("c") * u, {{"c", 2.0}}), "2*u");
  EXPECT_EQ(row_text(local("d") * u * b, {{"c", a / b}, {"d", local("c") * a}}), "c = a/b\nd = c*a\nu0 = d*b\nu0*u");
}

TEST(FromStencil, UnusedLetsDisappear) { EXPECT_EQ(row_text(u, {{"c", w * w}, {"d", local("c") * w}}), "u"); }

TEST(FromStencil, SmallPowersAreProducts) {
  EXPECT_EQ(row_text(power(u, 2)), "u*u");
  EXPECT_EQ(row_text(power(u, 3)), "u*u*u");
  EXPECT_EQ(row_text(power(u, 4)), "u*u*(u*u)");
  EXPECT_EQ(row_text(power(u, 5)), "u^5");
  EXPECT_EQ(row_text(a * power(u + w, 2)), "a\nlet base = u + w\na*(base*base)");
  EXPECT_EQ(row_text(power(u + w, 2) + power(u + w, 3)), "let base = u + w\nbase*base + base*base*base");
  EXPECT_EQ(row_text(a * power(u, -2)), "a\na/(u*u)");
  EXPECT_EQ(row_text(power(u, -0.5)), "1/sqrt(u)");
  EXPECT_EQ(row_text(power(a, 2) * u), "u0 = a^2\nu0*u");
}

TEST(FromStencil, NamesOfUniformsAvoidFieldsAndLets) {
  Kernel kernel{.rank = 1, .lets = {{"u1", access("u0") * w}}, .stores = {{"v", false, local("u1") * (a / b), {}}}};
  EXPECT_EQ(lower(single(kernel)).uniforms.at(0).name, "u2");
}

TEST(FromStencil, UniformsAreSharedByTheModule) {
  stencil::Module module = burgers();
  Kernel other{.name = "other", .rank = 1, .stores = {{"v", false, u * param("nu") / power(param("hx"), 2), {}}}};
  module.kernels.push_back(other);
  module.programs.push_back({.name = "other", .axes = {Topology::periodic}, .body = {run("other")}});
  const loop::Module result = lower(module);
  EXPECT_EQ(result.uniforms.size(), 3u);
  EXPECT_EQ(loop::print(result, result.rows.at(1)), "row other {\n  out v\n  in u\n  v = u1*u\n}\n");
}

TEST(FromStencil, AccumulatedFieldIsOneStream) {
  Kernel kernel{.rank = 1, .stores = {{"v", true, u * access("v"), {}}}};
  const loop::Module module = lower(single(kernel));
  EXPECT_EQ(loop::print(module, module.rows.at(0)), "row k {\n  inout v\n  in u\n  v += u*v\n}\n");
}

TEST(FromStencil, AllStoresSeeTheFieldsAsTheyWere) {
  Kernel kernel{.rank = 1, .stores = {{"v", true, u, {}}, {"w", false, access("v"), {}}}};
  const loop::Module module = lower(single(kernel));
  EXPECT_EQ(loop::print(module, module.rows.at(0)),
            "row k {\n  out w\n  inout v\n  in u\n  let v_before = v\n  v += u\n  w = v_before\n}\n");
}

TEST(FromStencil, ScattersGoToARowOfTheirOwn) {
  Kernel kernel{.rank = 1};
  kernel.lets = {{"d", a * u}, {"e", u + w}};
  kernel.stores = {{"v", false, local("e"), {}}};
  kernel.scatters = {{Interp{"s", {}, {local("d")}, {}}, access("g")}};
  const loop::Module module = lower(single(kernel));
  EXPECT_EQ(loop::print(module), R"(params a
uniform a

row k {
  out v
  in u, w
  let e = u + w
  v = e
}

row k_scatter {
  in u, g
  grid s
  let d = rounded(a*u)
  interp(s, d) += g
}

program p {
  axes x periodic
  inputs u, w, g, s
  fields v
  halo 0
  sweep k
  sweep k_scatter serial
}
)");
}

TEST(FromStencil, ScattersThatReadAnUpdatedFieldRunFirst) {
  Kernel kernel{.rank = 1, .stores = {{"g", true, u, {}}}};
  kernel.scatters = {{Interp{"s", {}, {u}, {}}, access("g")}};
  const loop::Module module = lower(single(kernel));
  ASSERT_EQ(module.programs.at(0).body.size(), 2u);
  EXPECT_EQ(std::get<loop::Sweep>(module.programs[0].body[0]).row, "k_scatter");
  EXPECT_EQ(std::get<loop::Sweep>(module.programs[0].body[1]).row, "k");
}

TEST(FromStencil, MasksThatCannotFailDisappear) {
  const auto text = [](std::vector<Topology> axes, int grow) {
    Kernel kernel{.name = "k", .rank = 2};
    kernel.stores = {
        {"v", false, select(inside({1, 1}, 0), access("u", {1, 1}), 0.0) + select(inside({0, 0}, 0), w, 0.0), {}}};
    Program program{.name = "p", .axes = std::move(axes), .body = {run("k", grow)}};
    const loop::Module module = lower({{kernel}, {program}, {}});
    return loop::print(module, module.rows.at(0), module.rows.at(0).stores.at(0).value);
  };
  EXPECT_EQ(text({Topology::periodic, Topology::periodic}, 0), "u[+1, +1] + w");
  EXPECT_EQ(text({Topology::periodic, Topology::bounded}, 0), "if(inside[0, +1], u[+1, +1], 0) + w");
  EXPECT_EQ(text({Topology::bounded, Topology::bounded}, 1),
            "if(inside[+1, +1], u[+1, +1], 0) + if(inside[0, 0], w, 0)");
}

TEST(FromStencil, KernelsThatKnowTheirAxesGetARowForEachKind) {
  Kernel masked{.name = "k", .rank = 1, .stores = {{"v", false, select(inside({1}, 0), access("u", {1}), 0.0), {}}}};
  Program wrapped{.name = "p", .axes = {Topology::periodic}, .body = {run("k")}};
  Program bounded{.name = "q", .axes = {Topology::bounded}, .body = {run("k"), run("k")}};
  const loop::Module module = lower({{masked}, {wrapped, bounded}, {}});
  ASSERT_EQ(module.rows.size(), 2u);
  EXPECT_EQ(std::get<loop::Sweep>(module.programs[0].body[0]).row, "k");
  EXPECT_EQ(std::get<loop::Sweep>(module.programs[1].body[0]).row, "k_2");
  EXPECT_EQ(std::get<loop::Sweep>(module.programs[1].body[1]).row, "k_2");
}

}  // namespace
}  // namespace dpde
