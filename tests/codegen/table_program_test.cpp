// SPDX-License-Identifier: Apache-2.0
// The C structs against the loop module they describe.
#include <gtest/gtest.h>

#include "codegen/program_table.h"
#include "loop/from_stencil.h"
#include "loop/loop_samples.h"

namespace dpde::codegen {
namespace {

using namespace samples;  // NOLINT

void row_a(const dpde_row*) {}
void uniforms_a(const double*, double*) {}

ProgramTables tables_of(const stencil::Module& module) {
  std::vector<std::string> names;
  for (const Program& program : module.programs) names.push_back(program.name);
  return ProgramTables(
      loop::from_stencil(module, names), [](const std::string&) { return &row_a; }, &uniforms_a);
}

TEST(ProgramTable, Heat) {
  const ProgramTables tables = tables_of(heat_2d());
  const dpde_program* p = tables.find("heat_step");
  ASSERT_NE(p, nullptr);
  EXPECT_EQ(p->version, DPDE_ABI_VERSION);
  EXPECT_STREQ(p->name, "heat_step");
  EXPECT_EQ(p->rank, 2);
  EXPECT_EQ(p->halo[0], 1);
  EXPECT_EQ(p->halo[1], 1);
  EXPECT_EQ(p->halo[2], 0);
  ASSERT_EQ(p->field_count, 2);
  EXPECT_EQ(p->input_count, 1);
  EXPECT_STREQ(p->fields[0], "u");
  EXPECT_STREQ(p->fields[1], "u_next");
  ASSERT_EQ(p->param_count, 5);
  EXPECT_STREQ(p->params[0], "hot");
  EXPECT_EQ(p->uniform_count, 4);
  EXPECT_EQ(p->compute_uniforms, &uniforms_a);
  EXPECT_EQ(p->sum_count, 0);
  EXPECT_EQ(p->interpret, nullptr);

  ASSERT_EQ(p->prepare_count, 1);
  const dpde_fill& fill = p->prepare[0];
  EXPECT_EQ(fill.field, 0);
  EXPECT_EQ(fill.axes[0].low.coefficients[0], DPDE_ONE);
  EXPECT_EQ(fill.axes[0].low.coefficients[1], DPDE_ZERO);
  EXPECT_EQ(fill.axes[0].low.value, 0);  // uniform `hot`
  EXPECT_EQ(fill.axes[0].high.coefficients[0], DPDE_ONE);
  EXPECT_EQ(fill.axes[0].high.value, -1);  // the number 0
  for (const dpde_side& side : {fill.axes[1].low, fill.axes[1].high}) {
    EXPECT_EQ(side.coefficients[0], DPDE_ZERO);
    EXPECT_EQ(side.coefficients[1], DPDE_ONE);
    EXPECT_EQ(side.rule, fill.axes[0].low.rule);
  }
  EXPECT_EQ(fill.axes[2].low.rule, nullptr);

  ASSERT_EQ(p->operation_count, 1);
  const dpde_operation& sweep = p->operations[0];
  EXPECT_EQ(sweep.kind, DPDE_SWEEP);
  EXPECT_EQ(sweep.kernel, 0);
  EXPECT_EQ(sweep.grow[0], 0);
  EXPECT_EQ(sweep.serial, 0);
  ASSERT_EQ(sweep.then_count, 1);
  EXPECT_EQ(sweep.then[0].field, 1);

  ASSERT_EQ(p->kernel_count, 1);
  const dpde_kernel& kernel = p->kernels[0];
  EXPECT_STREQ(kernel.name, "heat_step");
  EXPECT_EQ(kernel.row, &row_a);
  ASSERT_EQ(kernel.stream_count, 6);
  EXPECT_EQ(kernel.streams[0].field, 1);
  EXPECT_EQ(kernel.streams[0].is_written, 1);
  EXPECT_EQ(kernel.streams[1].field, 0);
  EXPECT_EQ(kernel.streams[1].offset[1], -1);
  EXPECT_EQ(kernel.streams[1].is_written, 0);
  EXPECT_EQ(kernel.grid_count, 0);

  ASSERT_EQ(p->swap_count, 1);
  EXPECT_EQ(p->swaps[0].state, 0);
  EXPECT_EQ(p->swaps[0].next, 1);
}

stencil::Module adjoint_like() {
  Kernel kernel{.name = "k", .rank = 2};
  kernel.stores = {{"v", true, access("u"), {}}};
  kernel.sums = {{"mass", access("u")}};
  Kernel spread{.name = "s", .rank = 2, .sums = {{"energy", access("u")}, {"mass", access("u")}}};
  spread.scatters = {{Interp{"v", {}, {0.5, access("u")}, {}}, access("u")}};
  const std::vector<AxisBoundary> axes = {periodic(), insulated()};
  Program program{.name = "p", .axes = topologies(axes)};
  program.body = {samples::run("k", 2), samples::run("s"), samples::run("k", 2), Fold{"v", 2, axes}};
  program.keeps = {"v"};
  return {{kernel, spread}, {program}, {}};
}

TEST(ProgramTable, GrownSweepsScattersSumsAndFolds) {
  const ProgramTables tables = tables_of(adjoint_like());
  const dpde_program* p = tables.find("p");
  ASSERT_NE(p, nullptr);
  ASSERT_EQ(p->sum_count, 2);
  EXPECT_STREQ(p->sums[0], "mass");
  EXPECT_STREQ(p->sums[1], "energy");
  EXPECT_EQ(p->halo[0], 0);
  EXPECT_EQ(p->halo[1], 2);

  ASSERT_EQ(p->operation_count, 5);
  ASSERT_EQ(p->kernel_count, 3);  // k, s, s_scatter: a kernel that runs twice is there once
  EXPECT_EQ(p->operations[0].kernel, p->operations[3].kernel);
  EXPECT_EQ(p->operations[0].grow[0], 0);  // periodic axes do not grow
  EXPECT_EQ(p->operations[0].grow[1], 2);
  EXPECT_EQ(p->operations[2].serial, 1);
  EXPECT_EQ(p->operations[4].kind, DPDE_FOLD);
  EXPECT_EQ(p->operations[4].grow[0], 0);
  EXPECT_EQ(p->operations[4].grow[1], 2);

  const dpde_kernel& k = p->kernels[p->operations[0].kernel];
  ASSERT_EQ(k.sum_count, 1);
  EXPECT_EQ(k.sums[0], 0);
  EXPECT_EQ(k.streams[0].is_written, 2);
  const dpde_kernel& s = p->kernels[p->operations[1].kernel];
  ASSERT_EQ(s.sum_count, 2);
  EXPECT_EQ(s.sums[0], 1);
  EXPECT_EQ(s.sums[1], 0);
  const dpde_kernel& scatter = p->kernels[p->operations[2].kernel];
  EXPECT_STREQ(scatter.name, "s_scatter");
  ASSERT_EQ(scatter.grid_count, 1);
  EXPECT_STREQ(p->fields[scatter.grids[0].field], "v");
  EXPECT_EQ(scatter.grids[0].is_written, 1);
}

TEST(ProgramTable, AddressesOutliveMoves) {
  ProgramTables first = tables_of(heat_2d());
  const dpde_program* before = first.find("heat_step");
  const ProgramTables second = std::move(first);
  EXPECT_EQ(second.find("heat_step"), before);
  EXPECT_STREQ(before->params[1], "dt");
  EXPECT_EQ(second.find("other"), nullptr);
  EXPECT_EQ(second.names(), std::vector<std::string>{"heat_step"});
}

void interpret_nothing(void*, const dpde_layout*, void* const*, const double*, const dpde_weights*, double*) {}

TEST(ProgramTable, Interpreter) {
  const stencil::Module source = burgers();
  ProgramTables tables(loop::from_stencil(source, {"burgers_step"}), {}, nullptr);
  int context = 0;
  tables.set_interpreter("burgers_step", &interpret_nothing, &context);
  const dpde_program* p = tables.find("burgers_step");
  EXPECT_EQ(p->interpret, &interpret_nothing);
  EXPECT_EQ(p->context, &context);
  EXPECT_EQ(p->kernels[0].row, nullptr);
}

}  // namespace
}  // namespace dpde::codegen
