// SPDX-License-Identifier: Apache-2.0
// Compiled C++ against the reference interpreter: every kind of expression, of axis and of statement in 1, 2 and 3
// axes.
#include "codegen/cpp_support.h"
#include "loop/loop_samples.h"
#include "support/setting.h"

namespace dpde::codegen {
namespace {

using namespace samples;           // NOLINT
using namespace codegen::testing;  // NOLINT

const Params values = {{"hx", 0.3},  {"hy", 0.4}, {"dt", 0.01}, {"nu", 0.7}, {"kappa", 0.6},
                       {"hot", 1.5}, {"a", 0.8},  {"b", 1.3},   {"c", -0.4}, {"sin", 0.9}};

TEST(CppPrograms, Burgers) {
  const CompiledCpp compiled(burgers());
  for (const int64_t n : {1, 2, 3, 7, 8, 33, 130}) expect_same(compiled, {"burgers_step", {n}, values, 5});
}

TEST(CppPrograms, HeatInTwoDimensions) {
  const CompiledCpp compiled(heat_2d());
  for (const int64_t n : {1, 2, 5, 17}) {
    for (const int64_t m : {1, 3, 9}) expect_same(compiled, {"heat_step", {n, m}, values, 4});
  }
  expect_same(compiled, {"heat_step", {40, 23}, values, 4, 2});
}

const Expr u = access("u"), w = access("w"), a = param("a"), b = param("b"), c = param("c");

/// One output per expression, o0, o1, ..., and a program that keeps them all.
stencil::Module outputs(const std::vector<Expr>& expressions, const std::vector<AxisBoundary>& axes, int grow = 0) {
  Kernel kernel{.name = "k", .rank = static_cast<int>(axes.size())};
  Program program{.name = "p", .axes = topologies(axes)};
  program.body = {Fill{"u", axes}, Fill{"w", axes}, run("k", grow)};
  for (std::size_t i = 0; i < expressions.size(); ++i) {
    kernel.stores.push_back({"o" + std::to_string(i), false, expressions[i], {}});
    program.keeps.push_back(kernel.stores.back().field);
  }
  return {{kernel}, {program}, {}};
}

TEST(CppPrograms, Functions) {
  std::vector<Expr> all;
  for (const Fn fn : every_function()) {
    if (arity(fn) == 2 || fn == Fn::asin || fn == Fn::acos) continue;  // below
    all.push_back(call(fn, {u}));
    all.push_back(u * call(fn, {a}));
    if (fn != Fn::log && fn != Fn::sqrt) all.push_back(call(fn, {w - u * 2}));
  }
  for (const Fn fn : {Fn::asin, Fn::acos}) all.push_back(call(fn, {u - 1}) + call(fn, {c}));
  for (const Fn fn : {Fn::min, Fn::max}) {
    all.push_back(call(fn, {u, w}));
    all.push_back(call(fn, {u * w, b}) - call(fn, {a, b}));
  }
  const CompiledCpp compiled(outputs(all, {periodic()}));
  expect_same(compiled, {"p", {19}, values});
}

TEST(CppPrograms, Operators) {
  std::vector<Expr> all = {-u,
                           -(u - w),
                           u - (w - a),
                           u / (w / b),
                           a / u,
                           u - -w,
                           -(u * w) * a,
                           u * a / (b * 3) * 2 / w,
                           power(u, 2),
                           power(u, 3),
                           power(u, 4),
                           power(u, -2),
                           power(u, 0.5),
                           power(u, -0.5),
                           power(u, 2.5),
                           power(u + w, 3),
                           power(u, w),
                           power(a, w),
                           power(a, 2) * u,
                           power(b, 2.5) * u,
                           u / 3,
                           1e300 * (u * 1e-300),
                           u + a + b,
                           param("sin") * call(Fn::sin, {u}),
                           Expr(2.5),
                           b};
  for (const BinaryOp op : {BinaryOp::less, BinaryOp::less_equal, BinaryOp::greater, BinaryOp::greater_equal,
                            BinaryOp::equal, BinaryOp::not_equal}) {
    all.push_back(binary(op, u, w) + 2 * binary(op, u, u * 1));
    all.push_back(select(binary(op, a, b), u, w));
  }
  const Expr less = binary(BinaryOp::less, u, w), small = binary(BinaryOp::less, u, 0.7);
  for (const BinaryOp op : {BinaryOp::logical_and, BinaryOp::logical_or}) {
    all.push_back(binary(op, less, small));
    all.push_back(select(binary(op, binary(op, less, small), binary(BinaryOp::logical_or, less, w - u)), u, -w));
  }
  all.push_back(select(less, select(small, u, w * u), -w) * select(u - w, a, u));
  all.push_back(select(select(less, u - u, w), 1.0, 2.0));
  const CompiledCpp compiled(outputs(all, {periodic()}));
  expect_same(compiled, {"p", {21}, values});
}

std::vector<Expr> masks_and_places(int rank) {
  std::vector<Expr> all;
  for (const Offset k : {Offset{-1}, Offset{1}, Offset{2, rank > 1 ? -1 : 0, rank > 2 ? 1 : 0}}) {
    for (const int grow : {0, 1}) all.push_back(select(inside(k, grow), access("u", k), 0.0) + inside(k, grow));
  }
  all.push_back(select(binary(BinaryOp::logical_and, inside({1}, 0), inside({-1}, 0)), u, w));
  const std::vector<Expr> d = {3 * (u - 1), 4 * (w - 1), 2 * (u * w - 1)};
  for (int kind = 0; kind < along_count; ++kind) {
    for (const int offset : {0, 1}) {
      Interp interp{"q", {offset, 0, rank > 2 ? -offset : 0}, {d.begin(), d.begin() + rank}, {}};
      for (int axis = 0; axis < rank; ++axis)
        interp.along[axis] = static_cast<InterpolationBasis>((kind + 3 * axis * offset) % along_count);
      all.push_back(stencil::interp(interp));
    }
  }
  return all;
}

/// All combinations of periodic and bounded axes.
std::vector<std::vector<AxisBoundary>> all_boundaries(int rank) {
  std::vector<std::vector<AxisBoundary>> all;
  for (int bounded = 0; bounded < 1 << rank; ++bounded) {
    std::vector<AxisBoundary> axes(rank, periodic());
    for (int axis = 0; axis < rank; ++axis) {
      if (bounded >> axis & 1) axes[axis] = axis == 0 ? wall(param("hot"), 0.5) : insulated();
    }
    all.push_back(axes);
  }
  return all;
}

TEST(CppPrograms, MasksAndPlaces) {
  const std::vector<std::vector<int64_t>> grids[] = {
      {{1}, {2}, {9}, {40}}, {{1, 1}, {9, 2}, {17, 5}}, {{1, 2, 1}, {9, 3, 4}}};
  for (int rank = 1; rank <= 3; ++rank) {
    for (std::size_t k = 0; const std::vector<AxisBoundary>& axes : all_boundaries(rank)) {
      if (!dpde::testing::is_tried(k++, 2)) continue;
      stencil::Module module = outputs(masks_and_places(rank), axes);
      module.programs[0].body.insert(module.programs[0].body.begin(), Fill{"q", axes});
      const CompiledCpp compiled(std::move(module));
      for (const std::vector<int64_t>& cells : grids[rank - 1]) expect_same(compiled, {"p", cells, values});
    }
  }
}

/// Grown sweep with masks, fold, sums and a scatter: what adjoints are made of.
TEST(CppPrograms, AdjointLikePrograms) {
  for (int rank = 1; rank <= 3; ++rank) {
    for (const std::vector<AxisBoundary>& axes : all_boundaries(rank)) {
      Kernel gather{.name = "gather", .rank = rank};
      const auto term = [](Offset k) { return select(inside(k, 0), access("u", k) * a, 0.0); };
      gather.stores = {{"v", false, term({1}) - term({-1}) + term({}), {}}};
      Kernel more{.name = "more", .rank = rank, .lets = {{"d", 2 * (u - 1)}}};
      more.stores = {{"v", true, local("d") * access("v"), {}}, {"x1", false, access("v") - u, {}}};
      more.sums = {{"total", access("v") * u}, {"plain", local("d")}};
      more.scatters = {
          {Interp{"s", {}, std::vector<Expr>(rank, local("d")), {}}, w * b},
          {Interp{"s", {1}, std::vector<Expr>(rank, w - 1), {InterpolationBasis::slope, InterpolationBasis::upper}}, u},
          {Interp{"s",
                  {},
                  std::vector<Expr>(rank, w - 1),
                  {InterpolationBasis::linear, InterpolationBasis::cubic, InterpolationBasis::cubic_slope}},
           u}};
      Kernel clear{.name = "clear", .rank = rank, .stores = {{"s", false, 0.0, {}}}};
      Program program{.name = "p", .axes = topologies(axes)};
      program.body = {Fill{"u", axes}, run("gather", 1), Fold{"v", 1, axes},
                      run("clear", 1), run("more"),      Fold{"s", 1, axes}};
      program.keeps = {"v", "s", "x1"};
      const CompiledCpp compiled({{gather, more, clear}, {program}, {}});
      expect_same(compiled, {"p", std::vector<int64_t>(rank, 1), values});
      const int64_t extents[] = {9, 4, 3};
      expect_same(compiled, {"p", {extents, extents + rank}, values});
    }
  }
}

/// Fills that moved out of the step must leave what they would have left in it.
TEST(CppPrograms, StepsWithMovedFills) {
  const auto smooth = [](const std::string& from, const std::string& to) {
    return Kernel{
        .name = from + "_" + to, .rank = 1, .stores = {{to, false, (access(from, {-1}) + access(from, {1})) * a, {}}}};
  };
  const std::vector<AxisBoundary> hot = {wall(param("hot"), 0.0)},
                                  moving = {wall(call(Fn::sin, {param("t")}), param("t"))};
  const Kernel wave{
      .name = "wave",
      .rank = 1,
      .stores = {{"u_new", false, a * (access("u", {1}) + access("u", {-1})) - 0.1 * access("u_old", {1}), {}}}};
  const auto program = [](std::string name, std::vector<Statement> body, std::vector<Swap> swaps) {
    return Program{
        .name = std::move(name), .axes = {Topology::bounded}, .body = std::move(body), .swaps = std::move(swaps)};
  };
  const CompiledCpp compiled(
      {{smooth("u", "v"), smooth("v", "w"), smooth("u", "w"), wave},
       {program("stages", {Fill{"u", hot}, run("u_v"), Fill{"v", {insulated()}}, run("v_w")}, {{"u", "w"}}),
        program("moving", {Fill{"u", moving}, run("u_w")}, {{"u", "w"}}),
        program("wave", {Fill{"u", hot}, Fill{"u_old", hot}, run("wave")}, {{"u_old", "u"}, {"u", "u_new"}}),
        program("odd", {Fill{"u", hot}, Fill{"u_old", {insulated()}}, run("wave")}, {{"u_old", "u"}, {"u", "u_new"}})},
       {}});
  for (const std::string name : {"stages", "moving", "wave", "odd"}) {
    for (const int64_t n : {1, 2, 11}) expect_same(compiled, {name, {n}, values, 5});
  }
}

/// Whatever a displacement is, only cells of the field and its halo are read.
TEST(CppPrograms, NoDisplacementLeavesTheField) {
  const double inf = std::numeric_limits<double>::infinity();
  const std::vector<double> places = {0,      -0.0, 1e9,  -1e9, 1e18,   -1e18,   1e300,
                                      -1e300, inf,  -inf, NAN,  5e-324, -5e-324, -1e-17};
  for (const std::vector<AxisBoundary>& axes : {std::vector{periodic()}, std::vector{insulated()}}) {
    stencil::Module module =
        outputs({stencil::interp({"w", {}, {u}, {}}), stencil::interp({"w", {-1}, {u}, {InterpolationBasis::slope}}),
                 stencil::interp({"w", {-1}, {u}, {InterpolationBasis::cubic}})},
                axes);
    std::erase_if(module.programs[0].body,
                  [](const Statement& s) { return std::holds_alternative<Fill>(s) && std::get<Fill>(s).field == "u"; });
    const CompiledCpp compiled(std::move(module));
    RunSetup setup{"p", {static_cast<int64_t>(places.size())}, values};
    setup.inputs = {{"u", places}, {"w", std::vector<double>(places.size(), 3.0)}};
    const Values result = run_compiled(compiled, setup);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const bool periodic_axis = axes[0].topology == Topology::periodic;
      if (std::isfinite(places[i])) {
        EXPECT_EQ(result.at("o0")[i], 3.0) << periodic_axis << " " << places[i];
        EXPECT_EQ(result.at("o1")[i], 0.0) << periodic_axis << " " << places[i];
      } else {
        EXPECT_TRUE(std::isnan(result.at("o0")[i])) << periodic_axis << " " << places[i];
        EXPECT_TRUE(std::isnan(result.at("o1")[i])) << periodic_axis << " " << places[i];
      }
    }
  }
}

}  // namespace
}  // namespace dpde::codegen
