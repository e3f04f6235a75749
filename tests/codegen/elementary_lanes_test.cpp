// SPDX-License-Identifier: Apache-2.0
// Both back ends give a cell the bits of dpde/elementary.h, for all arguments, whatever lane of whatever vector or
// remainder it is in.
#include <fmt/format.h>

#include <cstring>

#include "codegen/cpp/compile_cpp.h"
#include "codegen/elementary_functions.h"
#include "codegen/llvm/emit_llvm.h"
#include "codegen/llvm_support.h"
#include "dpde/elementary_cells.h"
#include "dpde/instruction_set.h"

namespace dpde::codegen::testing {
namespace {

/// v_sin = sin(x), ..., v_pow = x^y, and `mixed`, where a compiler might fuse what functions give with what is added to
/// it.
loop::Module all_functions(Precision real) {
  ModuleBuilder b({Topology::periodic});
  const Expr x = b.load("x"), y = b.load("y");
  for (const Fn fn : every_function()) {
    if (is_elementary(fn)) b.store("v_" + std::string(name_of(fn)), call(fn, {x}));
  }
  b.store("v_pow", op(BinaryOp::power, x, y));
  b.store("mixed", call(Fn::exp, {x}) * y + call(Fn::sin, {y}) * x + call(Fn::exp, {y}));
  loop::Module module = b.finish();
  module.real = real;
  return module;
}

template <class T>
T reference(const std::string& name, T x, T y) {
  if (name == "v_sin") return elementary::one<elementary::Sin>(x);
  if (name == "v_cos") return elementary::one<elementary::Cos>(x);
  if (name == "v_tan") return elementary::one<elementary::Tan>(x);
  if (name == "v_asin") return elementary::one<elementary::Asin>(x);
  if (name == "v_acos") return elementary::one<elementary::Acos>(x);
  if (name == "v_atan") return elementary::one<elementary::Atan>(x);
  if (name == "v_sinh") return elementary::one<elementary::Sinh>(x);
  if (name == "v_cosh") return elementary::one<elementary::Cosh>(x);
  if (name == "v_tanh") return elementary::one<elementary::Tanh>(x);
  if (name == "v_exp") return elementary::one<elementary::Exp>(x);
  if (name == "v_log") return elementary::one<elementary::Log>(x);
  if (name == "v_erf") return elementary::one<elementary::Erf>(x);
  EXPECT_EQ(name, "v_pow");
  return elementary::one<elementary::Pow>(x, y);
}

template <class T>
using Fields = std::map<std::string, std::vector<T>>;

/// Ordinary numbers; every seventh is one that formulas do not hold for.
template <class T>
Fields<T> inputs(std::size_t count) {
  using Limits = std::numeric_limits<T>;
  const std::vector<T> special{0,
                               T(-0.0),
                               Limits::infinity(),
                               -Limits::infinity(),
                               Limits::quiet_NaN(),
                               Limits::max(),
                               Limits::denorm_min(),
                               -1,
                               800,
                               -800,
                               T(1e10),
                               T(1e30)};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> draw(-8, 8);
  Fields<T> fields{{"x", {}}, {"y", {}}};
  for (std::size_t i = 0; i < count; ++i) {
    fields["x"].push_back(i % 7 == 6 ? special[i / 7 % special.size()]
                                     : static_cast<T>(std::abs(draw(random)) * (i % 3 == 0 ? -1 : 1)));
    fields["y"].push_back(i % 11 == 5 ? special[i / 11 % special.size()] : static_cast<T>(draw(random)));
  }
  return fields;
}

/// Calls the row for `count` cells from `first` on.
template <class T>
void run_row(const dpde_program& program, Fields<T>& fields, std::size_t first, std::size_t count) {
  const dpde_kernel& kernel = program.kernels[0];
  std::vector<void*> streams;
  for (int s = 0; s < kernel.stream_count; ++s)
    streams.push_back(fields.at(program.fields[kernel.streams[s].field]).data() + first);
  double none = 0;
  const dpde_row row{streams.data(), nullptr, &none, &none, static_cast<int64_t>(count), 0, 0, 0, nullptr, &none};
  kernel.row(&row);
}

template <class T>
bool same(T a, T b) {
  return (std::isnan(a) && std::isnan(b)) || std::memcmp(&a, &b, sizeof a) == 0;
}

/// Rows of all lengths up to some vectors, and cells one by one.
template <class T>
void expect_the_bits(const CompiledModule& compiled) {
  const dpde_program& program = *compiled.find("all");
  const std::size_t count = 1200;
  Fields<T> alone = inputs<T>(count);
  for (int f = 0; f < program.field_count; ++f) alone[program.fields[f]].resize(count);
  Fields<T> rows = alone;
  for (std::size_t i = 0; i < count; ++i) run_row(program, alone, i, 1);
  for (std::size_t first = 0, length = 1; first < count; first += length, length = length % 67 + 1) {
    run_row(program, rows, first, std::min(length, count - first));
  }
  for (const auto& [name, values] : rows) {
    for (std::size_t i = 0; i < count; ++i) {
      const T x = rows.at("x")[i], y = rows.at("y")[i];
      ASSERT_TRUE(same(values[i], alone.at(name)[i])) << name << " of " << x << ", " << y << " depends on the row";
      if (name[0] == 'v') {
        ASSERT_TRUE(same(values[i], reference(name, x, y))) << name << " of " << x << ", " << y;
      }
    }
  }
}

TEST(ElementaryLanes, JitWithVectorsOfAllWidths) {
  for (const int width : {0, 128, 256, 512}) {
    SCOPED_TRACE(width);
    expect_the_bits<double>(*compile(all_functions(Precision::f64), {.vector_width = width}));
    expect_the_bits<float>(*compile(all_functions(Precision::f32), {.vector_width = width}));
  }
}

TEST(ElementaryLanes, EmittedCpp) {
  const CompileResult doubles = compile_cpp(all_functions(Precision::f64)),
                      floats = compile_cpp(all_functions(Precision::f32));
  ASSERT_EQ(doubles.error + floats.error, "");
  expect_the_bits<double>(*doubles.module);
  expect_the_bits<float>(*floats.module);
}

TEST(ElementaryLanes, FunctionsDoNotKeepRowsFromBeingVectorised) {
  EXPECT_EQ(scalar_rows(all_functions(Precision::f64)), std::vector<std::string>{});
  EXPECT_EQ(scalar_rows(all_functions(Precision::f32)), std::vector<std::string>{});
  const std::string text = emit_llvm(all_functions(Precision::f64), true, {.vector_width = 256});
  const int lanes = instruction_set() == InstructionSet::portable ? 2 : 4;  // of the 128 bits that all processors have
  const std::string sines = fmt::format("<{} x double> @dpde_sin_{}(", lanes, lanes);
  EXPECT_NE(text.find("call contract " + sines), std::string::npos);
  EXPECT_NE(text.find("define internal " + sines), std::string::npos);
  EXPECT_EQ(text.find("@dpde_sin_8("), std::string::npos);  // nobody calls it
}

}  // namespace
}  // namespace dpde::codegen::testing
