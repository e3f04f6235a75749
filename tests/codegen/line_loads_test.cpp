// SPDX-License-Identifier: Apache-2.0
// Lines of memory are loaded once and neighbours shifted out of registers: fewer loads, no other values
// (variants_test.cpp compares them with vectors that are too short for it), and nothing is read beyond the memory of a
// field.
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <regex>

#include "adjoint/reverse/newton_steps.h"
#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm/jit.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/layout.h"
#include "loop/from_stencil.h"
#include "loop/print_loop.h"
#include "support/derivative_check.h"
#include "support/program_cases.h"

namespace dpde {
namespace {

/// Memory of a field between pages that may not be touched: it begins behind the first of them, or ends before the
/// second.
class Guarded {
 public:
  Guarded(const dpde_layout& layout, bool at_end)
      : page_(sysconf(_SC_PAGESIZE)), bytes_((field_bytes(layout) + page_ - 1) / page_ * page_) {
    all_ = static_cast<char*>(
        mmap(nullptr, static_cast<size_t>(bytes_ + 2 * page_), PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0));
    EXPECT_EQ(mprotect(all_ + page_, static_cast<size_t>(bytes_), PROT_READ | PROT_WRITE), 0);
    char* const first = all_ + page_ + (at_end ? bytes_ - field_bytes(layout) : 0);
    base_ = first + layout.origin * real_bytes(layout);
  }
  ~Guarded() { munmap(all_, static_cast<size_t>(bytes_ + 2 * page_)); }
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;
  void* base() const { return base_; }

 private:
  int64_t page_, bytes_;
  char *all_, *base_;
};

void run_guarded(const dpde_program& program, const std::vector<int64_t>& cells, bool at_end) {
  const dpde_layout layout = make_layout(cells, {program.halo[0], program.halo[1], program.halo[2]}, program.real);
  Executor executor(program, layout, 1);
  std::vector<std::unique_ptr<Guarded>> fields;
  for (int f = 0; f < program.field_count; ++f) {
    fields.push_back(std::make_unique<Guarded>(layout, at_end));
    executor.bind(f, fields.back()->base());
  }
  for (int p = 0; p < program.param_count; ++p) executor.set_param(p, 0.5);
  executor.update_uniforms();
  executor.prepare();
  executor.run();
}

/// The programs of a case and of its adjoint.
void expect_stays_inside(const testing::ProgramCase& c, Precision real) {
  SCOPED_TRACE(c.name);
  stencil::Module module = testing::parse_module(c.text);
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "p", c.wrt, sink);
  ASSERT_FALSE(sink.has_errors());
  for (const auto& kernel : derived.module.kernels) {
    if (!module.find_kernel(kernel.name)) module.kernels.push_back(kernel);
  }
  module.programs.push_back(*derived.module.find_program(derived.program));
  const codegen::JitResult code =
      codegen::jit(loop::from_stencil(adjoint::with_newton_steps(module), {"p", derived.program}, real), {});
  ASSERT_EQ(code.error, "");
  for (const std::string& name : {std::string("p"), derived.program}) {
    for (const int64_t x : {16, 17, 31, 33}) {
      const std::vector<int64_t> all{x, 3, 2};
      for (const bool at_end : {false, true})
        run_guarded(*code.module->find(name), {all.begin(), all.begin() + c.rank}, at_end);
    }
  }
}

TEST(LineLoads, StayInsideTheMemoryOfAField) {
  for (const auto& c : testing::cases_by_day(0, 2)) expect_stays_inside(c, Precision::f64);
}

TEST(LineLoads, StayInsideTheMemoryOfAFieldInSinglePrecision) {
  for (const auto& c : testing::cases_by_day(1, 2)) expect_stays_inside(c, Precision::f32);
}

size_t count_of(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  return static_cast<size_t>(std::distance(std::sregex_iterator(text.begin(), text.end(), regex), {}));
}

/// What the loop over vectors of a row does, as text.
std::string vector_loop(const loop::Module& loops) {
  const std::string text = codegen::emit_llvm(loops, true);
  const size_t row = text.find("define void @row_"), body = text.find("vector.body", text.find("vector.ph", row));
  const size_t begin = text.find("\nvector.body", row);
  return body == std::string::npos ? "" : text.substr(begin, text.find("\n\n", begin) - begin);
}

TEST(LineLoads, LoadEachLineOnce) {
  const stencil::Module module = testing::parse_module(
      "kernel k(u: field halo 2, c: field, out v: field) { v = c*(u[-2, 0] + u[-1, 0] + u + u[+1, 0] + u[+2, 0] + u[0, "
      "-1] + u[0, +1]) }\n"
      "program p { fill u periodic; run k; keep v }");
  const std::string body = vector_loop(loop::from_stencil(module, {"p"}, Precision::f64));
  if (body.find("<8 x") == std::string::npos) GTEST_SKIP() << "vectors of this processor are shorter than cache lines";
  const size_t vectors = count_of(body, "store <8 x");            // of a round
  EXPECT_EQ(count_of(body, "= load <8 x"), 4 * vectors) << body;  // u[.., -1], u[.., 0], u[.., +1], c
  EXPECT_EQ(count_of(body, "= shufflevector <8 x"), 4 * vectors) << body;
  EXPECT_EQ(count_of(body, "= phi <8 x"), 2u) << body;
}

/// A field that is written is read anew.
TEST(LineLoads, LeaveWrittenLines) {
  const stencil::Module module = testing::parse_module(
      "kernel zero(out v: field) { v = 0 }\nkernel k(u: field halo 1, inout v: field) { v += u[+1] - u }\n"
      "program p { fill u periodic; run zero; run k; keep v }");
  loop::Module loops = loop::from_stencil(module, {"p"}, Precision::f64);
  std::erase_if(loops.rows, [](const loop::Row& row) { return row.name != "k"; });
  const std::string body = vector_loop(loops);
  if (body.find("<8 x") == std::string::npos) GTEST_SKIP() << "vectors of this processor are shorter than cache lines";
  const size_t vectors = count_of(body, "store <8 x");
  EXPECT_EQ(count_of(body, "= load <8 x"), 2 * vectors) << body;  // u, v
  EXPECT_EQ(count_of(body, "= shufflevector <8 x"), vectors) << body;
}

/// A coordinate across the rows is read once a row, and so is what depends on it alone: lengths on a sphere.
TEST(LineLoads, ReadCoordinatesAcrossRowsOnce) {
  const auto assembly_of = [](const std::string& angle, const std::string& stream) {
    const stencil::Module module =
        testing::parse_module("kernel k(u: field, x: field, y: field, out v: field) { v = u[0, 0]/cos(" + angle +
                              "[0, 0]) }\nprogram p { run k; keep v }");
    const loop::Module loops = loop::from_stencil(module, {"p"}, Precision::f64);
    EXPECT_NE(loop::print(loops).find(stream), std::string::npos) << loop::print(loops);
    return codegen::emit_assembly(loops, {});
  };
  EXPECT_EQ(assembly_of("y", "  once in y\n").find("dpde_cos_"), std::string::npos) << "of vectors";
  EXPECT_NE(assembly_of("x", "  in u, x\n").find("dpde_cos_"), std::string::npos);
}

}  // namespace
}  // namespace dpde
