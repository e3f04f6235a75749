// SPDX-License-Identifier: Apache-2.0
// The module around the rows: text, vector code, lifetime and threads.
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm_reference.h"
#include "dpde/instruction_set.h"

namespace dpde::codegen::testing {
namespace {

using Names = std::vector<std::string>;

/// Two momentum equations with centred differences, products regrouped as the loop level does.
loop::Module burgers_2d() {
  ModuleBuilder b({P, P});
  const Expr cx = b.uniform("cx", b.param("dt")), cy = b.uniform("cy", b.param("dt"));
  const Expr dx = b.uniform("dx", b.param("nu")), dy = b.uniform("dy", b.param("nu"));
  const Expr c0 = b.uniform("c0", Expr(1) - Expr(2) * b.param("nu"));
  const Expr u = b.load("u"), v = b.load("v");
  for (const std::string f : {"u", "v"}) {
    const Expr ax = b.let(f + "_ax", cx * u), ay = b.let(f + "_ay", cy * v);
    b.store(f + "_next", c0 * b.load(f) + (dx - ax) * b.load(f, {1, 0}) + (dx + ax) * b.load(f, {-1, 0}) +
                             (dy - ay) * b.load(f, {0, 1}) + (dy + ay) * b.load(f, {0, -1}));
  }
  return b.finish();
}

loop::Module heat_3d() {
  ModuleBuilder b({P, P, P});
  const Expr a = b.uniform("a", b.param("nu")), c = b.uniform("c", b.param("dt"));
  b.store("v", a * b.load("u") + c * (b.load("u", {-1, 0, 0}) + b.load("u", {1, 0, 0})) +
                   c * (b.load("u", {0, -1, 0}) + b.load("u", {0, 1, 0})) +
                   c * (b.load("u", {0, 0, -1}) + b.load("u", {0, 0, 1})));
  return b.finish();
}

/// The gather adjoint of 1-D Burgers: neighbours of two fields along x, a gradient as a sum, masks at the ends.
loop::Module burgers_adjoint(Topology axis) {
  ModuleBuilder b({axis});
  const Expr c = b.uniform("c", b.param("dt")), d = b.uniform("d", b.param("nu"));
  const Expr l = b.load("l"), lw = b.load("l", {-1}), le = b.load("l", {1});
  const Expr u = b.load("u"), uw = b.load("u", {-1}), ue = b.load("u", {1});
  const Expr from_west = select(inside({-1}, 0), lw * (d - c * uw), Expr(0.0));
  const Expr from_east = select(inside({1}, 0), le * (d + c * ue), Expr(0.0));
  b.add("u_bar", l * (Expr(1) - Expr(2) * d - c * (ue - uw)) + from_west + from_east);
  b.sum("nu_bar", l * (uw - Expr(2) * u + ue));
  return b.finish();
}

loop::Module interpolating(std::vector<Topology> axes) {
  ModuleBuilder b(axes);
  std::vector<Expr> d;
  for (std::size_t a = 0; a < axes.size(); ++a) d.push_back(b.load(std::string("d") + "xyz"[a]) * Expr(-0.5));
  b.store("v", loop::make(b.place("u", d)));
  return b.finish();
}

TEST(LlvmModule, EquationsAreVectorised) {
  for (loop::Module module : {burgers_2d(), heat_3d(), burgers_adjoint(P), burgers_adjoint(B)}) {
    EXPECT_EQ(scalar_rows(module), Names{});
    module.real = Precision::f32;
    EXPECT_EQ(scalar_rows(module), Names{});
  }
}

TEST(LlvmModule, EquationsAreRight) {
  const Params params{{"dt", 0.05}, {"nu", 0.1}};
  for (const loop::Module& module : {burgers_2d(), heat_3d(), burgers_adjoint(P), burgers_adjoint(B)}) {
    const auto compiled = compile(module);
    for (const std::array<int, 3> cells : {std::array{1, 1, 1}, {15, 2, 3}, {64, 3, 2}, {131, 2, 2}}) {
      expect_same(module, *compiled, cells, params);
    }
  }
}

TEST(LlvmModule, AllWithoutCallsIsVectorised) {
  ModuleBuilder b({B, P});
  b.store("copy", b.load("u"));
  b.start("sum");
  b.sum("s", b.load("u"));
  b.start("functions");
  const Expr u = b.load("u");
  b.store("v", call(Fn::sqrt, {u}) + call(Fn::abs, {u}) + call(Fn::floor, {u}) + call(Fn::sign, {u}) +
                   call(Fn::min, {u, Expr(2.0)}) + call(Fn::max, {u, Expr(2.0)}) + op(BinaryOp::power, u, Expr(5.0)));
  b.start("masks");
  b.store("w", select(inside({1, 1}, 0), b.load("u", {1, 1}), Expr(0.0)));
  b.start("updates");
  b.add("q", b.load("u") * b.load("q"));
  b.start("scatter");
  b.scatter(b.place("r", {b.load("u"), b.load("v")}), Expr(1.0));
  EXPECT_EQ(scalar_rows(b.finish()), Names{});
  for (const int width : {128, 256}) EXPECT_EQ(scalar_rows(burgers_2d(), {width}), Names{}) << width;
}

TEST(LlvmModule, InterpolationIsVectorisedWhereThereAreGathers) {
  if (instruction_set() != InstructionSet::v4) {
    std::puts("this processor has no AVX-512: whether gathers vectorise is not looked at");
    return;
  }
  for (const std::vector<Topology>& axes : {std::vector{P}, {B}, {P, P}, {B, B}, {P, P, P}, {B, B, B}}) {
    loop::Module module = interpolating(axes);
    EXPECT_EQ(scalar_rows(module), Names{});
    module.real = Precision::f32;
    EXPECT_EQ(scalar_rows(module), Names{});
  }
}

TEST(LlvmModule, WidthOfVectorsIsAChoice) {
  EXPECT_EQ(emit_assembly(heat_3d(), {256}).find("zmm"), std::string::npos);
  EXPECT_EQ(emit_assembly(heat_3d(), {128}).find("ymm"), std::string::npos);
  EXPECT_NE(emit_assembly(heat_3d(), {128}).find("xmm"), std::string::npos);
  if (instruction_set() == InstructionSet::v4) {
    EXPECT_NE(emit_assembly(heat_3d()).find("zmm"), std::string::npos);
    EXPECT_EQ(emit_assembly(heat_3d()), emit_assembly(heat_3d(), {512}));
  }
}

TEST(LlvmModule, ResultsDoNotDependOnTheWidth) {
  const loop::Module module = burgers_2d();
  const std::vector<double> params = values_of(module, {{"dt", 0.05}, {"nu", 0.1}});
  Memory expected(module, {77, 3, 1});
  run(*compile(module)->find("all"), {P, P}, expected, params);
  for (const int width : {128, 256}) {
    Memory memory(module, {77, 3, 1});
    run(*compile(module, {width})->find("all"), {P, P}, memory, params);
    EXPECT_EQ(memory.fields(), expected.fields());
  }
}

TEST(LlvmModule, TextBeforeOptimisation) {
  ModuleBuilder b({P, P});
  const Expr c = b.uniform("c", b.param("dt") * Expr(0.5));
  b.sum("total", b.load("u", {1, -1}));
  b.store("v", c * (b.load("u", {-1, 1}) + b.load("u")));
  EXPECT_EQ(emit_llvm(b.finish(), false), R"(; ModuleID = 'dpde'
source_filename = "dpde"

; Function Attrs: nounwind
define void @dpde_compute_uniforms(ptr %params, ptr %uniforms) #0 {
entry:
  %0 = getelementptr inbounds double, ptr %params, i64 0
  %dt = load double, ptr %0, align 8
  %1 = fmul contract double %dt, 5.000000e-01
  %2 = getelementptr inbounds double, ptr %uniforms, i64 0
  store double %1, ptr %2, align 8
  ret void
}

; Function Attrs: alwaysinline nounwind
define internal void @row_k_cells(i64 %count, ptr noalias nocapture readonly %uniforms, ptr noalias nocapture %sums, ptr noalias nocapture readonly "dpde-line-start"="1" %u_ym1, ptr noalias nocapture readonly "dpde-line-start"="0" %u, ptr noalias nocapture readonly "dpde-line-start"="-1" %u_yp1, ptr noalias nocapture writeonly %v) #1 {
entry:
  %0 = icmp sgt i64 %count, 0
  br i1 %0, label %before, label %done

before:                                           ; preds = %entry
  %1 = getelementptr inbounds i8, ptr %uniforms, i64 0
  %c = load double, ptr %1, align 8
  br label %cell

cell:                                             ; preds = %before, %cell
  %i = phi i64 [ 0, %before ], [ %next, %cell ]
  %total = phi contract double [ 0.000000e+00, %before ], [ %11, %cell ]
  %2 = getelementptr inbounds double, ptr %u_ym1, i64 %i
  %3 = load double, ptr %2, align 8
  %4 = getelementptr inbounds double, ptr %u, i64 %i
  %5 = load double, ptr %4, align 8
  %6 = getelementptr inbounds double, ptr %u_yp1, i64 %i
  %7 = load double, ptr %6, align 8
  %8 = fadd contract double %7, %5
  %9 = fmul contract double %c, %8
  %10 = getelementptr inbounds double, ptr %v, i64 %i
  store double %9, ptr %10, align 8
  %11 = fadd reassoc contract double %total, %3
  %next = add nuw nsw i64 %i, 1
  %12 = icmp eq i64 %next, %count
  br i1 %12, label %exit, label %cell

exit:                                             ; preds = %cell
  %total_row = phi contract double [ %11, %cell ]
  %13 = getelementptr inbounds double, ptr %sums, i64 0
  %14 = load double, ptr %13, align 8
  %15 = fadd contract double %14, %total_row
  store double %15, ptr %13, align 8
  br label %done

done:                                             ; preds = %exit, %entry
  ret void
}

; Function Attrs: nounwind
define void @row_k(ptr %row) #0 {
entry:
  %0 = getelementptr inbounds i8, ptr %row, i64 32
  %count = load i64, ptr %0, align 8
  %1 = getelementptr inbounds i8, ptr %row, i64 16
  %uniforms = load ptr, ptr %1, align 8
  %2 = getelementptr inbounds i8, ptr %row, i64 24
  %sums = load ptr, ptr %2, align 8
  %3 = getelementptr inbounds i8, ptr %row, i64 0
  %4 = load ptr, ptr %3, align 8
  %5 = getelementptr inbounds i8, ptr %4, i64 0
  %u_ym1 = load ptr, ptr %5, align 8
  %6 = getelementptr inbounds i8, ptr %4, i64 8
  %u = load ptr, ptr %6, align 8
  %7 = getelementptr inbounds i8, ptr %4, i64 16
  %u_yp1 = load ptr, ptr %7, align 8
  %8 = getelementptr inbounds i8, ptr %4, i64 24
  %v = load ptr, ptr %8, align 8
  call void @row_k_cells(i64 %count, ptr %uniforms, ptr %sums, ptr %u_ym1, ptr %u, ptr %u_yp1, ptr %v)
  ret void
}

attributes #0 = { nounwind }
attributes #1 = { alwaysinline nounwind }
)");
}

TEST(LlvmModule, OptimisedTextNamesTheRowsAndIsTheSameEveryTime) {
  const std::string text = emit_llvm(burgers_2d(), true);
  EXPECT_NE(text.find("define void @row_k("), std::string::npos);
  EXPECT_EQ(text.find("_cells("), std::string::npos);
  EXPECT_NE(text.find(" x double>"), std::string::npos);
  EXPECT_EQ(text, emit_llvm(burgers_2d(), true));
}

TEST(LlvmModule, CodeLivesAsLongAsTheModule) {
  const loop::Module module = heat_3d();
  std::shared_ptr<CompiledModule> kept = compile(module);
  for (int i = 0; i < 5; ++i) compile(burgers_2d());
  expect_same(module, *kept, {33, 3, 2}, {{"dt", 0.05}, {"nu", 0.1}});
  EXPECT_EQ(kept->find("none"), nullptr);
}

TEST(LlvmModule, ThreadsMayCompileAtTheSameTime) {
  const loop::Module module = heat_3d();
  std::vector<std::shared_ptr<CompiledModule>> modules(8);
  std::vector<std::thread> threads;
  for (auto& slot : modules) threads.emplace_back([&] { slot = jit(module).module; });
  for (std::thread& thread : threads) thread.join();
  for (const auto& compiled : modules) {
    ASSERT_NE(compiled, nullptr);
    expect_same(module, *compiled, {21, 2, 2}, {{"dt", 0.05}, {"nu", 0.1}});
  }
}

TEST(LlvmModule, TimesAreReported) {
  const auto start = std::chrono::steady_clock::now();
  const JitResult result = jit(burgers_2d());
  const double total = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GT(result.emit_s, 0);
  EXPECT_GT(result.optimise_s, 0);
  EXPECT_GT(result.link_s, 0);
  EXPECT_LE(result.emit_s + result.optimise_s + result.link_s, total);
  fmt::print("one row: IR {:.2f} ms, passes {:.2f} ms, machine code {:.2f} ms\n", 1e3 * result.emit_s,
             1e3 * result.optimise_s, 1e3 * result.link_s);
}

}  // namespace
}  // namespace dpde::codegen::testing
