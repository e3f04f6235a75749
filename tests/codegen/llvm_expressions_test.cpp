// SPDX-License-Identifier: Apache-2.0
// Compiled rows against their meaning: every kind of expression, every function, every tail of the vectorised loop.
#include "codegen/llvm_reference.h"

namespace dpde::codegen::testing {
namespace {

const std::vector<Topology> periodic_1d{Topology::periodic};

/// Rows of 1 to 67 cells: whole vectors, tails of all lengths, and rows shorter than a vector.
void expect_same_for_all_lengths(const loop::Module& module, const Params& params = {}) {
  const auto compiled = compile(module);
  ASSERT_NE(compiled, nullptr);
  for (int n = 1; n <= 67 && !::testing::Test::HasFailure(); ++n) expect_same(module, *compiled, {n, 1, 1}, params);
}

TEST(LlvmExpressions, ArithmeticOfNeighboursForAllLengths) {
  ModuleBuilder b(periodic_1d);
  const Expr a = b.uniform("a", op(BinaryOp::divide, b.param("nu"), b.param("hx") * b.param("hx")));
  const Expr u = b.load("u"), west = b.load("u", {-1}), east = b.load("u", {1});
  const Expr flux = b.let("flux", loop::make(loop::Neg{u * (east - west)}));
  b.store("v", u + a * (west - Expr(2) * u + east) + op(BinaryOp::divide, flux, u));
  b.store("w", flux - b.load("u", {-2}) * b.load("u", {2}));
  expect_same_for_all_lengths(b.finish(), {{"nu", 0.01}, {"hx", 0.2}});
}

class LlvmBinary : public ::testing::TestWithParam<BinaryOp> {};

TEST_P(LlvmBinary, AsInTheLanguage) {
  ModuleBuilder b(periodic_1d);
  const Expr x = b.load("x"), y = b.load("y");
  b.store("of_numbers", op(GetParam(), x, y));
  b.store("of_conditions", op(GetParam(), op(BinaryOp::less, x, y), op(BinaryOp::greater, x, Expr(1.0))));
  b.store("of_equal_numbers", op(GetParam(), x, x));
  b.store("chosen", select(op(GetParam(), x - Expr(1), y - Expr(0.75)), x, y));
  expect_same_for_all_lengths(b.finish());
}

INSTANTIATE_TEST_SUITE_P(All, LlvmBinary,
                         ::testing::Values(BinaryOp::add, BinaryOp::subtract, BinaryOp::multiply, BinaryOp::divide,
                                           BinaryOp::power, BinaryOp::less, BinaryOp::less_equal, BinaryOp::greater,
                                           BinaryOp::greater_equal, BinaryOp::equal, BinaryOp::not_equal,
                                           BinaryOp::logical_and, BinaryOp::logical_or));

class LlvmFunction : public ::testing::TestWithParam<Fn> {};

TEST_P(LlvmFunction, AsInTheMathLibrary) {
  ModuleBuilder b(periodic_1d);
  const Expr x = b.load("x"), y = b.load("y");
  const auto f = [&](Expr a) {
    std::vector<Expr> arguments{a};
    if (arity(GetParam()) == 2) arguments.push_back(y);
    return call(GetParam(), arguments);
  };
  b.store("near_one", f(x));
  b.store("both_signs", f(Expr(8) * (x - Expr(1))));  // NaN of log, sqrt, asin, acos included
  b.store("at_zero", f(x - x));
  b.store("equal", f(y));
  b.store("of_uniform", f(b.uniform("q", f(b.param("p")))));
  loop::Module module = b.finish();
  module.uniforms[0].value = call(GetParam(), std::vector<Expr>(arity(GetParam()), b.param("p")));
  expect_same_for_all_lengths(module, {{"p", 0.625}});
}

INSTANTIATE_TEST_SUITE_P(All, LlvmFunction, ::testing::ValuesIn(every_function()),
                         [](const auto& info) { return std::string(name_of(info.param)); });

TEST(LlvmExpressions, Powers) {
  ModuleBuilder b(periodic_1d);
  const Expr x = b.load("x"), p = b.uniform("p", b.param("p"));
  for (const double exponent : {0.0, 1.0, 2.0, 3.0, 7.0, 16.0, 17.0, 0.5, 1.5, 2.25}) {
    const std::string name = std::to_string(exponent);
    b.store("plus_" + name, op(BinaryOp::power, x, Expr(exponent)));
    b.store("minus_" + name, op(BinaryOp::power, x, loop::make(loop::Neg{Expr(exponent)})));
    b.store("of_negative_" + name, op(BinaryOp::power, Expr(0) - x, Expr(-exponent)));
  }
  b.store("uniform", op(BinaryOp::power, x, p));
  b.store("of_uniform", op(BinaryOp::power, p, x));
  expect_same_for_all_lengths(b.finish(), {{"p", 2.75}});
}

TEST(LlvmExpressions, SmallPowersAreProducts) {
  ModuleBuilder b(periodic_1d);
  b.store("v", op(BinaryOp::power, b.load("u"), Expr(-3)));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  Memory memory(module, {5, 1, 1});
  run(*compiled->find("all"), periodic_1d, memory, {});
  for (int i = 0; i < 5; ++i) {
    const double u = memory.at("u", i, 0, 0);
    EXPECT_EQ(memory.at("v", i, 0, 0), 1 / (u * (u * u)));
  }
}

TEST(LlvmExpressions, MinAndMaxKeepTheFirstAtATieAndWhereNothingCompares) {
  ModuleBuilder b(periodic_1d);
  b.store("least", call(Fn::min, {b.load("x"), b.load("y")}));
  b.store("most", call(Fn::max, {b.load("x"), b.load("y")}));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  Memory memory(module, {19, 1, 1});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 19; ++i) {
    memory.at("x", i, 0, 0) = i % 2 == 0 ? nan : -0.0;
    memory.at("y", i, 0, 0) = i % 2 == 0 ? 1.0 : 0.0;
  }
  run(*compiled->find("all"), periodic_1d, memory, {});
  for (int i = 0; i < 19; ++i) {
    for (const char* field : {"least", "most"}) {
      const double value = memory.at(field, i, 0, 0);
      if (i % 2 == 0) {
        EXPECT_TRUE(std::isnan(value));
      } else {
        EXPECT_TRUE(value == 0 && std::signbit(value));
      }
    }
  }
}

TEST(LlvmExpressions, SelectHidesNanOfTheOtherBranch) {
  ModuleBuilder b(periodic_1d);
  const Expr x = b.load("x") - Expr(1);
  b.store("root", select(op(BinaryOp::greater, x, Expr(0.0)), call(Fn::sqrt, {x}), Expr(-1.0)));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  Memory memory(module, {67, 1, 1});
  run(*compiled->find("all"), periodic_1d, memory, {});
  int negative = 0;
  for (int i = 0; i < 67; ++i) {
    const double v = memory.at("x", i, 0, 0) - 1;
    EXPECT_EQ(memory.at("root", i, 0, 0), v > 0 ? std::sqrt(v) : -1.0);
    negative += v <= 0;
  }
  EXPECT_GT(negative, 10);
}

TEST(LlvmExpressions, ConditionsAreNumbersWhereNumbersAreWanted) {
  ModuleBuilder b(periodic_1d);
  const Expr x = b.load("x");
  const Expr above = b.let("above", op(BinaryOp::greater, x, Expr(1.0)));
  b.store("v", above);
  b.store("w", above * x + op(BinaryOp::less_equal, x, Expr(0.75)));
  b.store("q", select(x - x, Expr(1.0), select(above, Expr(2.0), Expr(3.0))));
  b.sum("count", above);
  expect_same_for_all_lengths(b.finish());
}

TEST(LlvmExpressions, AccumulatingStoresAddToWhatWasThere) {
  ModuleBuilder b(periodic_1d);
  const Expr u = b.load("u");
  b.add("v", u * b.load("w"));
  b.add("v", Expr(3.0));
  b.store("q", u);
  b.add("q", b.load("w", {1}));
  loop::Module module = b.finish();
  expect_same_for_all_lengths(module);
}

TEST(LlvmExpressions, ReadsSeeWhatWasThereBeforeTheStores) {
  ModuleBuilder b(periodic_1d);
  b.add("v", b.load("u"));
  b.store("w", b.load("v") * Expr(2));
  expect_same_for_all_lengths(b.finish());
}

TEST(LlvmExpressions, SumsForAllLengths) {
  ModuleBuilder b(periodic_1d);
  const Expr u = b.load("u"), d = b.let("d", u - b.load("v", {1}));
  b.sum("energy", d * d);
  b.sum("mass", u);
  b.store("w", d);
  expect_same_for_all_lengths(b.finish());
}

TEST(LlvmExpressions, SumsAreTheSameOnEveryRunAndAreAdded) {
  ModuleBuilder b(periodic_1d);
  b.sum("total", b.load("u") * b.load("v"));
  const loop::Module module = b.finish();
  const auto first = compile(module);
  const auto second = compile(module);
  Memory memory(module, {1009, 1, 1});
  run(*first->find("all"), periodic_1d, memory, {});
  const double once = memory.sums()[0];
  EXPECT_GT(once, 500);
  for (const auto& compiled : {first, second}) {
    memory.sums()[0] = 0;
    run(*compiled->find("all"), periodic_1d, memory, {});
    EXPECT_EQ(memory.sums()[0], once);
  }
  double sums[1] = {1.0};
  void* streams[2] = {memory.base("u"), memory.base("v")};
  const dpde_row row{streams, nullptr, nullptr, sums, 1009, 0, 0, 0, &memory.layout()};
  first->find("all")->kernels[0].row(&row);
  EXPECT_EQ(sums[0], 1.0 + once);
}

TEST(LlvmExpressions, NoCellsNoEffect) {
  ModuleBuilder b(periodic_1d);
  b.sum("total", b.load("u"));
  b.store("v", b.load("u"));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  double u = 1, v = 2, sum = 3;
  void* streams[2] = {&u, &v};
  Memory memory(module, {1, 1, 1});
  const dpde_row row{streams, nullptr, nullptr, &sum, 0, 0, 0, 0, &memory.layout()};
  compiled->find("all")->kernels[0].row(&row);
  EXPECT_EQ(v, 2);
  EXPECT_EQ(sum, 3);
}

TEST(LlvmExpressions, RowsMayBeCalledLikeFunctionsOfTheMathLibrary) {
  ModuleBuilder b(periodic_1d);
  const Expr u = b.load("u");
  b.store("v", call(Fn::sin, {u}) + call(Fn::tan, {u}) + call(Fn::floor, {u}));
  for (const char* name : {"sin", "tan", "exp", "floor"}) {
    b.start(name);
    b.store(std::string("w_") + name, b.load("u") * Expr(2));
  }
  expect_same_for_all_lengths(b.finish());
}

TEST(LlvmExpressions, UniformsBuildOnEarlierOnes) {
  ModuleBuilder b(periodic_1d);
  const Expr half = b.uniform("half", b.param("p") * Expr(0.5));
  const Expr unused = b.uniform("unused", half * half);
  const Expr both = b.uniform("both", unused + call(Fn::exp, {half}));
  b.store("v", both * b.load("u"));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  double uniforms[3] = {};
  const double p = 1.5;
  compiled->find("all")->compute_uniforms(&p, uniforms);
  EXPECT_EQ(uniforms[0], 0.75);
  EXPECT_EQ(uniforms[1], 0.5625);
  EXPECT_DOUBLE_EQ(uniforms[2], 0.5625 + std::exp(0.75));
  expect_same_for_all_lengths(module, {{"p", p}});
}

TEST(LlvmExpressions, SharedNodesAreComputedOnce) {
  ModuleBuilder b(periodic_1d);
  Expr e = b.load("u");
  for (int i = 0; i < 40; ++i) e = (e + e) * Expr(0.5);  // 2^40 leaves when written out
  loop::Module module = b.finish();
  module.rows[0].stores.push_back({static_cast<int>(module.rows[0].streams.size()), false, e, {}});
  module.rows[0].streams.push_back({"v", {}, loop::Stream::Mode::out});
  module.programs[0].fields = {"u", "v"};
  const auto compiled = compile(module);
  Memory memory(module, {9, 1, 1});
  run(*compiled->find("all"), periodic_1d, memory, {});
  for (int i = 0; i < 9; ++i) EXPECT_EQ(memory.at("v", i, 0, 0), memory.at("u", i, 0, 0));
}

}  // namespace
}  // namespace dpde::codegen::testing
