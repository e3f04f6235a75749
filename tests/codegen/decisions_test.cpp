// SPDX-License-Identifier: Apache-2.0
// What a decision hangs on is rounded operation by operation: a*b - c*d is 0 where the products are equal, in every
// lane, back end and precision. As half of a fused multiply-add one product would be exact, and the difference its
// rounding.
#include <gtest/gtest.h>

#include "codegen/cpp/compile_cpp.h"
#include "codegen/llvm/jit.h"
#include "loop/from_stencil.h"
#include "stencil/passes/passes.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"
#include "support/program_run.h"
#include "support/split_mix.h"

namespace dpde {
namespace {

using Code = std::shared_ptr<codegen::CompiledModule>;

/// The same in a let that is used elsewhere too, behind a let that distributes uniform factors, and in the place of an
/// interpolation.
constexpr const char* text =
    "kernel k(a: field, b: field, c: field, d: field, out w: field, out v: field, out q: field, dt, nu: param) {\n"
    "  let s = a*b - c*d\n"
    "  let r = dt*(nu*a + 3*b)/2 - (nu*dt*c + 3*dt*d)/2\n"
    "  w = sign(s) + if(a*b > c*d, 2, 0) + if(-c*d + a*b < 0, 4, 0)\n"
    "  v = s + r\n"
    "  q = if(dt*(a*b + nu*a) == dt*(c*d + nu*c), 1, 0) + fraction(1 + s) + if(a*b > c*d, 8, 0)\n"
    "}\n"
    "program p { axes x periodic; run k; keep w; keep v; keep q }";

void expect_ties(const Code& code, const stencil::Module& module) {
  ASSERT_TRUE(code);
  constexpr int cells = 203;
  testing::SplitMix random(5);
  testing::RunInputs inputs{{1, {cells, 1, 1}}, {}, {{"dt", 0.37}, {"nu", 1.3}, {"hx", 0.1}}};
  for (const char* field : {"a", "b"}) {
    for (double& value : inputs.fields[field] = std::vector<double>(cells)) value = random.uniform(0.5, 1.5);
  }
  inputs.fields["c"] = inputs.fields["b"];
  inputs.fields["d"] = inputs.fields["a"];
  // a*b + nu*a against c*d + nu*c: equal where a and b are
  for (int i = 0; i < cells; i += 2)
    inputs.fields["b"][i] = inputs.fields["c"][i] = inputs.fields["d"][i] = inputs.fields["a"][i];
  const testing::Outcome got = testing::run_executed(*code->find("p"), *module.find_program("p"), inputs, 1);
  for (int i = 0; i < cells; ++i) {
    EXPECT_EQ(got.fields.at("w")[i], 0) << i;
    EXPECT_EQ(got.fields.at("q")[i], i % 2 == 0 ? 1 : 0) << i;
  }
}

loop::Module lowered(stencil::Module module, Precision real) {
  for (const stencil::Pass& pass : stencil::default_passes) module = pass.run(module);
  for (const stencil::Pass& pass : stencil::loop_passes) module = pass.run(module);
  return loop::from_stencil(module, {"p"}, real);
}

TEST(Decisions, EqualProductsAreEqualInMachineCode) {
  const stencil::Module module = testing::parse_module(text);
  for (const Precision real : {Precision::f64, Precision::f32})
    expect_ties(codegen::jit(lowered(module, real)).module, module);
}

TEST(Decisions, EqualProductsAreEqualInEmittedCpp) {
  const stencil::Module module = testing::parse_module(text);
  for (const Precision real : {Precision::f64, Precision::f32})
    expect_ties(codegen::compile_cpp(lowered(module, real)).module, module);
}

}  // namespace
}  // namespace dpde
