// SPDX-License-Identifier: Apache-2.0
// The reference semantics against hand-computed values and against the identities that define transposes.
#include "stencil/interpret/interpret.h"

#include <cmath>

#include "stencil_text.h"
#include "support/setting.h"

namespace dpde::stencil {
namespace {

const Side zero_value{SideKind::value, 0.0};
const Side zero_gradient{SideKind::zero_gradient, 0.0};

/// All sorts of boundaries of one axis whose fill is linear.
const std::vector<AxisBoundary> sorts = {
    {Topology::periodic, {}, {}},
    {Topology::bounded, zero_value, zero_value},
    {Topology::bounded, zero_value, zero_gradient},
    {Topology::bounded, zero_gradient, zero_value},
    {Topology::bounded, zero_gradient, zero_gradient},
    {Topology::bounded, {SideKind::gradient, 0.0}, {SideKind::mixed, 0.0, 1.5, param("b")}},
    {Topology::bounded, {SideKind::gradient, 0.0, 0.0, 0.0, true}, {SideKind::mixed, 0.0, 1.5, param("b"), true}},
    {Topology::bounded, {SideKind::mixed, 0.0, 0.7, param("b"), true}, {SideKind::value, 0.0, 0.0, 0.0, true}},
    {Topology::bounded, {SideKind::line, 0.0, 1.3}, {SideKind::mixed, 0.0, 1.5, param("b")}},
    {Topology::bounded, {SideKind::gradient_at_cell, 0.0}, {SideKind::gradient_at_cell, 0.0}},
    {Topology::bounded, {SideKind::gradient_at_cell, 0.0}, {SideKind::mixed, 0.0, 1.5, param("b")}},
    {Topology::bounded, {SideKind::linear, 0.0, 0.0, 0.0, true}, {SideKind::linear, 0.0, 0.0, 0.0, true}},
};
const Params spacings{{"hx", 0.5}, {"hy", 0.3}, {"hz", 0.7}, {"b", 0.2}};

/// Every sort along each axis, beside every sort along each other one; all triples where the test is thorough.
template <class F>
void for_each_boundary(int rank, const F& f) {
  const std::size_t count = sorts.size();
  const bool all = rank < 3 || testing::is_thorough();
  for (std::size_t x = 0; x < count; ++x) {
    for (std::size_t y = 0; y < (rank > 1 ? count : 1); ++y) {
      for (std::size_t z = 0; z < (rank > 2 && all ? count : 1); ++z) {
        std::vector<AxisBoundary> axes{sorts[x], sorts[y], sorts[all ? z : (x + y) % count]};
        axes.resize(static_cast<std::size_t>(rank));
        f(axes);
      }
    }
  }
}

std::vector<double> along_x(const State& state, const std::string& field) {
  std::vector<double> values;
  for (int i = -state.halo(0); i < state.grid().cells[0] + state.halo(0); ++i) values.push_back(state.at(field, i));
  return values;
}

/// n = 3: u[-1] and u[2] lie on the walls and become c, beyond them the odd image.
TEST(Halo, OnWallsSetsTheLastEntryAndTheOddImageAboutTheWall) {
  State state({1, {3, 1, 1}}, 3);
  state.set("u", {1, 2, 99});
  const Side low{SideKind::value, 10.0, 0.0, 0.0, true}, high{SideKind::value, param("c"), 0.0, 0.0, true};
  apply(state, Fill{"u", {{Topology::bounded, low, high}}}, {{"c", 20}});
  const double wanted[] = {18, 19, 10, 1, 2, 20, 38, 39, 30};
  for (int i = -3; i < 6; ++i) EXPECT_EQ(state.at("u", {i, 0, 0}), wanted[i + 3]) << i;
}

/// The value on an open wall stays, and the line through it goes on.
TEST(Halo, OutflowKeepsWhatLiesOnTheWall) {
  for (int n = 2; n < 5; ++n) {
    State state({1, {n, 1, 1}}, 3);
    std::vector<double> line;
    for (int i = 0; i < n; ++i) line.push_back(3 - 2 * i);
    state.set("u", line);
    const Side low{SideKind::linear, 0.0, 0.0, 0.0, true}, high{SideKind::outflow, 0.0, 0.0, 0.0, true};
    apply(state, Fill{"u", {{Topology::bounded, low, high}}}, {});
    for (int i = 0; i < n + 3; ++i) EXPECT_EQ(state.at("u", {i, 0, 0}), 3 - 2 * i) << n << " " << i;
  }
}

/// Straight lines go on as they are, on a wall and beyond it too; a single cell has none.
TEST(Halo, LinearGoesOnStraight) {
  for (const bool is_on_wall : {false, true}) {
    const Side side{SideKind::linear, 0.0, 0.0, 0.0, is_on_wall};
    for (int n = is_on_wall ? 3 : 2; n < 6; ++n) {
      State state({1, {n, 1, 1}}, 4);
      std::vector<double> line;
      for (int i = 0; i < n; ++i) line.push_back(is_on_wall && i == n - 1 ? 99 : 3 - 2 * i);
      state.set("u", line);
      apply(state, Fill{"u", {{Topology::bounded, side, side}}}, {});
      for (int i = -4; i < n + 4; ++i) EXPECT_EQ(state.at("u", {i, 0, 0}), 3 - 2 * i) << n << " " << i;
    }
  }
  State one({1, {1, 1, 1}}, 3);
  one.set("u", {7});
  apply(one, Fill{"u", {{Topology::bounded, {SideKind::linear}, {SideKind::linear}}}}, {});
  EXPECT_EQ(along_x(one, "u"), std::vector<double>(7, 7));
}

Side on_wall(Side side) {
  side.on_wall = true;
  return side;
}

/// u = 1 + 2x + 3x^2 on four cells of 1/2: one-sided differences know its slopes -2 and 14 outwards, and what is set
/// beyond a wall gives that slope about it. mixed(0, 1, g) is a gradient, and no slope at both walls makes the
/// parabola's neighbours a level.
TEST(Halo, ConditionsOnWallsHoldThereForAParabola) {
  const auto parabola = [](double x) { return 1 + 2 * x + 3 * x * x; };
  const Params params{{"hx", 0.5}, {"g", -2}};
  for (const Side& low : {Side{SideKind::gradient, param("g")}, Side{SideKind::mixed, param("g"), 0.0, 1.0}}) {
    for (const Side& high : {Side{SideKind::gradient, 14.0}, Side{SideKind::mixed, 3 * 17.0 + 4 * 14.0, 3.0, 4.0},
                             Side{SideKind::value, 17.0}}) {
      State state({1, {4, 1, 1}}, 2);
      state.set("u", {parabola(0.5), parabola(1), parabola(1.5), 99});
      apply(state, Fill{"u", {{Topology::bounded, on_wall(low), on_wall(high)}}}, params);
      for (int i = -2; i < 4; ++i) EXPECT_NEAR(state.at("u", i), parabola(0.5 * (i + 1)), 1e-14) << i;
      if (high.kind == SideKind::gradient) {
        EXPECT_NEAR(state.at("u", 4), parabola(2.5), 1e-13);
      }
    }
  }
  State level({1, {4, 1, 1}}, 1);
  level.set("u", {2, 2, 2, 99});
  apply(level, Fill{"u", {{Topology::bounded, on_wall(zero_gradient), on_wall(zero_gradient)}}}, {});
  EXPECT_EQ(along_x(level, "u"), (std::vector<double>{2, 2, 2, 2, 2, 2}));
}

/// Two cells have one value between the walls, one cell none: then the high wall is a value or stays, and low goes from
/// it.
TEST(Halo, ConditionsOnWallsOfOneAndTwoCells) {
  const auto filled = [](std::vector<double> u, const Side& low, const Side& high) {
    State state({1, {static_cast<int>(u.size()), 1, 1}}, 1);
    state.set("u", u);
    apply(state, Fill{"u", {{Topology::bounded, on_wall(low), on_wall(high)}}}, {{"hx", 0.5}});
    return along_x(state, "u");
  };
  const Side slope{SideKind::gradient, -2.0}, rise{SideKind::gradient, 2.0}, value{SideKind::value, 5.0},
      robin{SideKind::mixed, 3 * 5.0 + 4 * 2.0, 3.0, 4.0};
  for (const Side& high : {rise, value, robin}) {  // 3 + 2x
    const std::vector<double> line = filled({4, 99}, slope, high);
    EXPECT_NEAR(line[0], 3, 1e-14);
    EXPECT_NEAR(line[2], 5, 1e-14);
  }
  EXPECT_EQ(filled({4}, slope, rise)[0], 3);
  EXPECT_EQ(filled({4}, slope, rise)[1], 4);
  EXPECT_EQ(filled({99}, slope, value)[0], 4);
  EXPECT_EQ(filled({99}, slope, value)[1], 5);
  EXPECT_EQ(filled({7}, value, rise)[0], 5);
  EXPECT_EQ(filled({7}, value, rise)[1], 7);
}

/// Slope c at the centre of the cell: parabolas are exact in any layer, lines in a single cell.
TEST(Halo, SlopesAtCells) {
  const auto filled = [](std::vector<double> u, double low, double high) {
    State state({1, {static_cast<int>(u.size()), 1, 1}}, 3);
    state.set("u", u);
    const Side at_low{SideKind::gradient_at_cell, low}, at_high{SideKind::gradient_at_cell, high};
    apply(state, Fill{"u", {{Topology::bounded, at_low, at_high}}}, {{"hx", 0.5}});
    return along_x(state, "u");
  };
  const auto parabola = [](int i) { return 1 + 0.5 * i + 0.25 * i * i; };  // 1 + x + x^2 at x = i/2
  std::vector<double> inside;
  for (int i = 0; i < 4; ++i) inside.push_back(parabola(i));
  const std::vector<double> u = filled(inside, -1, 4);
  for (int i = -3; i < 7; ++i) EXPECT_NEAR(u[static_cast<std::size_t>(i + 3)], parabola(i), 1e-14) << i;
  EXPECT_EQ(filled({4}, -2, 2), (std::vector<double>{1, 2, 3, 4, 5, 6, 7}));
}

TEST(Interpret, FillsByRepeatedReflection) {
  State state({1, {2, 1, 1}}, 5);
  state.set("u", {1, 2});
  apply(state, Fill{"u", {{Topology::periodic, {}, {}}}}, {});
  EXPECT_EQ(along_x(state, "u"), (std::vector<double>{2, 1, 2, 1, 2, 1, 2, 1, 2, 1, 2, 1}));
  apply(state, Fill{"u", {{Topology::bounded, zero_gradient, zero_gradient}}}, {});
  EXPECT_EQ(along_x(state, "u"), (std::vector<double>{1, 1, 2, 2, 1, 1, 2, 2, 1, 1, 2, 2}));
  // u[-1-k] = 2*10 - u[k], u[n+k] = 2*20 - u[n-1-k]: a straight rise of 20 each time both walls are passed
  apply(state, Fill{"u", {{Topology::bounded, {SideKind::value, 10.0}, {SideKind::value, param("a")}}}}, {{"a", 20}});
  EXPECT_EQ(along_x(state, "u"), (std::vector<double>{-1, -19, -18, 18, 19, 1, 2, 38, 39, 21, 22, 58}));
}

/// A straight line u = 3 + 2x on cells of 1/2 has u' = -2 outwards at x = 0 and value 5 at x = 1: each kind continues
/// it.
TEST(Interpret, GradientAndMixedContinueAStraightLine) {
  const Side slope{SideKind::gradient, param("g")}, robin{SideKind::mixed, 3 * 5.0 + 4 * 2.0, 3.0, 4.0};
  State state({1, {2, 1, 1}}, 2);
  state.set("u", {3.5, 4.5});
  apply(state, Fill{"u", {{Topology::bounded, slope, robin}}}, {{"g", -2}, {"hx", 0.5}});
  const std::vector<double> line{1.5, 2.5, 3.5, 4.5, 5.5, 6.5};
  for (std::size_t i = 0; i < line.size(); ++i) EXPECT_NEAR(along_x(state, "u")[i], line[i], 1e-14);
  // mixed(1, 0, c) is a value and mixed(0, 1, g) a gradient
  const Side value{SideKind::mixed, 5.0, 1.0, 0.0}, gradient{SideKind::mixed, -2.0, 0.0, 1.0};
  apply(state, Fill{"u", {{Topology::bounded, gradient, value}}}, {{"hx", 0.5}});
  for (std::size_t i = 0; i < line.size(); ++i) EXPECT_NEAR(along_x(state, "u")[i], line[i], 1e-14);
}

/// The values of a wall in a field: read at the place that is filled, along periodic axes where it wraps to.
TEST(Interpret, ValuesThatVaryAlongAWall) {
  State state({2, {3, 2, 1}}, 1);
  state.set("u", {1, 2, 3, 4, 5, 6});
  for (int i = 0; i < 3; ++i) state.at("c", i, -1) = 10 * i;
  const Side wall{SideKind::value, access("c")};
  apply(state, Fill{"u", {{Topology::periodic, {}, {}}, {Topology::bounded, wall, zero_gradient}}}, {});
  for (int i = -1; i < 4; ++i) EXPECT_EQ(state.at("u", i, -1), 20 * ((i + 3) % 3) - state.at("u", i, 0)) << i;
}

TEST(Interpret, FillOfOneCell) {
  State state({1, {1, 1, 1}}, 3);
  state.set("u", {7});
  apply(state, Fill{"u", {{Topology::bounded, zero_value, zero_gradient}}}, {});
  EXPECT_EQ(along_x(state, "u"), (std::vector<double>{7, -7, -7, 7, 7, -7, -7}));
}

TEST(Interpret, FillsAxesOneAfterTheOther) {
  State state({2, {2, 1, 1}}, 1);
  state.set("u", {1, 2});
  apply(state, Fill{"u", {{Topology::periodic, {}, {}}, {Topology::bounded, zero_value, {SideKind::value, 5.0}}}}, {});
  EXPECT_EQ(state.at("u", -1, -1), -2);  // the corner: x first, then the wall
  EXPECT_EQ(state.at("u", 2, 1), 9);
}

/// <fill(u), w> over interior and `width` halo cells of bounded axes; w is 0 in the halo of periodic ones.
void check_transpose(const Grid& grid, const std::vector<AxisBoundary>& axes, int width, Random& random) {
  State state(grid, width);
  random.fill_interior(state, "u");
  state.poison("w");
  double left = 0, right = 0, size = 0;
  apply(state, Fill{"u", axes}, spacings);
  for_each_cell(grid, width, [&](int i, int j, int k) {
    const int cell[] = {i, j, k};
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      const bool in_halo = cell[axis] < 0 || cell[axis] >= grid.cells[axis];
      if (in_halo && axes[axis].topology == Topology::periodic) return;
    }
    state.at("w", i, j, k) = random();
    left += state.at("w", i, j, k) * state.at("u", i, j, k);
    size += std::abs(state.at("w", i, j, k));
  });
  apply(state, Fold{"w", width, axes}, spacings);
  for_each_cell(grid, 0, [&](int i, int j, int k) { right += state.at("w", i, j, k) * state.at("u", i, j, k); });
  EXPECT_NEAR(left, right, 1e-14 * size) << "rank " << grid.rank << " width " << width << " cells " << grid.cells[0];
}

TEST(Interpret, FoldIsTheTransposeOfFill) {
  Random random(1);
  for (int rank = 1; rank <= 3; ++rank) {
    for_each_boundary(rank, [&](const std::vector<AxisBoundary>& axes) {
      for (int width = 1; width <= (rank == 3 ? 3 : 4); ++width) {
        for_each_grid(rank, rank == 3 ? 3 : 6, [&](const Grid& grid) { check_transpose(grid, axes, width, random); });
      }
    });
  }
}

TEST(Interpret, FoldClearsTheHaloItFolds) {
  State state({1, {2, 1, 1}}, 2);
  for (int i = -2; i < 4; ++i) state.at("w", i) = i + 3;  // 1 2 | 3 4 | 5 6
  apply(state, Fold{"w", 1, {{Topology::bounded, zero_value, zero_gradient}}}, {});
  EXPECT_EQ(along_x(state, "w"), (std::vector<double>{1, 0, 1, 9, 0, 6}));
  apply(state, Fold{"w", 2, {{Topology::periodic, {}, {}}}}, {});
  EXPECT_EQ(along_x(state, "w"), (std::vector<double>{1, 0, 1, 9, 0, 6}));
}

TEST(Interpret, ReducesLinesPlanesAndGrids) {
  State state({2, {3, 2, 1}}, 1);
  state.set("u", {1, 2, 6, 4, 8, 15});
  const auto reduced = [&](Reduction kind, bool over_x, bool over_y) {
    apply(state, Reduce{"m", kind, "u", {over_x, over_y, false}});
    return state.get("m");
  };
  EXPECT_EQ(reduced(Reduction::mean, true, false), (std::vector<double>{3, 3, 3, 9, 9, 9}));
  EXPECT_EQ(reduced(Reduction::mean, false, true), (std::vector<double>{2.5, 5, 10.5, 2.5, 5, 10.5}));
  EXPECT_EQ(reduced(Reduction::sum, true, true), (std::vector<double>(6, 36)));
  EXPECT_EQ(reduced(Reduction::max, true, false), (std::vector<double>{6, 6, 6, 15, 15, 15}));
  EXPECT_EQ(reduced(Reduction::min, false, true), (std::vector<double>{1, 2, 6, 1, 2, 6}));
  EXPECT_TRUE(std::isnan(state.at("m", -1, 0)));  // a halo is what a fill makes of it
  state.at("u", 1, 1) = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> broken = reduced(Reduction::max, true, false);
  EXPECT_EQ(broken[0], 6);
  EXPECT_TRUE(std::isnan(broken[3]));
}

TEST(Interpret, StepOfAHandWrittenProgram) {
  const Module m = module_of(R"(
kernel heat(u: field halo 1, out u_next: field, sum total: param, nu: param) {
  let lap = u[-1] - 2*u + u[+1]
  u_next = u + nu*lap
  total += u
}
program step {
  fill u x.low = 1, x.high = zero_gradient
  run heat
  swap u, u_next
}
)");
  State state({1, {3, 1, 1}}, 1);
  state.set("u", {1, 2, 4});
  const auto sums = interpret(m, m.programs[0], state, {{"nu", 0.5}});
  EXPECT_EQ(state.get("u"), (std::vector<double>{1.5, 2.5, 3}));  // halo: 1 and 4
  EXPECT_EQ(sums.at("total"), 7);
  EXPECT_TRUE(std::isnan(state.at("u_next", 0)));
  EXPECT_TRUE(std::isnan(state.at("u", -1)));  // the halo was not computed
}

TEST(Interpret, InsideAndGrownRegions) {
  const Module m = module_of(R"(
kernel k(u: field halo 1, out v: field, out here: field) {
  v = if(inside[+1, 0], u[+1, 0], 100)
  here = inside[0, -1] grow 1
}
program p {
  axes x bounded, y periodic
  run k grow 1
  keep v, here
}
)");
  State state({2, {2, 2, 1}}, 2);
  state.set("u", {1, 2, 3, 4});
  interpret(m, m.programs[0], state, {});
  const std::vector<double> v = {state.at("v", -1, 1), state.at("v", 0, 1), state.at("v", 1, 1), state.at("v", 2, 1)};
  EXPECT_EQ(v, (std::vector<double>{3, 4, 100, 100}));
  EXPECT_TRUE(std::isnan(state.at("v", 0, -1)));  // no growth along a periodic axis
  EXPECT_EQ(state.at("here", -1, 0), 1);
  EXPECT_EQ(state.at("here", 2, 1), 1);
}

TEST(Interpret, ReadsSeeTheFieldsAsTheyWere) {
  const Module m = module_of(R"(
kernel zero(out v: field) { v = 1 }
kernel add(u: field, inout v: field, inout w: field) { v += u*v; w += 2*v }
kernel one(out w: field) { w = 1 }
program p { run zero; run one; run add; keep v, w }
)");
  State state({1, {2, 1, 1}}, 0);
  state.set("u", {3, 5});
  interpret(m, m.programs[0], state, {});
  EXPECT_EQ(state.get("v"), (std::vector<double>{4, 6}));
  EXPECT_EQ(state.get("w"), (std::vector<double>{3, 3}));
}

TEST(Interpret, SwapsHappenAtOnce) {
  const Module m = module_of(R"(
kernel k(u: field, v: field, out a: field, out b: field) { a = v; b = u }
program p { run k; swap u, a; swap v, b }
)");
  State state({1, {1, 1, 1}}, 0);
  state.set("u", {3});
  state.set("v", {5});
  interpret(m, m.programs[0], state, {});
  EXPECT_EQ(state.get("u"), std::vector<double>{5});
  EXPECT_EQ(state.get("v"), std::vector<double>{3});
}

TEST(Interpret, UnwrittenMemoryShows) {
  const Module m = module_of("kernel k(u: field, out v: field) { v = u + 1 }\nprogram p { run k; keep v }\n");
  State state({1, {2, 1, 1}}, 0);
  interpret(m, m.programs[0], state, {});
  EXPECT_TRUE(std::isnan(state.at("v", 0)));
}

TEST(Interpret, Coordinates) {
  State state({1, {4, 1, 1}}, 1);
  state.set_coordinate(0, Topology::periodic, -1, 0.5);
  EXPECT_EQ(along_x(state, "x"), (std::vector<double>{0.75, -0.75, -0.25, 0.25, 0.75, -0.75}));
  state.set_coordinate(0, Topology::bounded, -1, 0.5);
  EXPECT_EQ(along_x(state, "x"), (std::vector<double>{-1.25, -0.75, -0.25, 0.25, 0.75, 1.25}));
}

// ---- interpolation -------------------------------------------------------------------------------------------------

double interpolated(const std::string& axes, const std::string& fill, double d, const std::string& callee = "interp") {
  const Module m = module_of("kernel k(u: field, out v: field, d: param) { v = " + callee +
                             "(u[+1], d) }\nprogram p { axes " + axes + "; fill u " + fill + "; run k; keep v }\n");
  State state({1, {4, 1, 1}}, 1);
  state.set("u", {1, 2, 4, 8});
  interpret(m, m.programs[0], state, {{"d", d}});
  return state.at("v", 0);  // around cell 1
}

TEST(Interpret, InterpAlongAPeriodicAxis) {
  const auto at = [](double d) { return interpolated("x periodic", "periodic", d); };
  EXPECT_EQ(at(0), 2);
  EXPECT_EQ(at(0.25), 2.5);
  EXPECT_EQ(at(-0.5), 1.5);
  EXPECT_EQ(at(2.5), 4.5);     // between cells 3 and 0
  EXPECT_EQ(at(-1.25), 2.75);  // between cells 3 and 0
  EXPECT_EQ(at(4e6 + 1), 4);
  EXPECT_EQ(interpolated("x periodic", "periodic", 0, "interp_dx"), 2);
  EXPECT_EQ(interpolated("x periodic", "periodic", -0.5, "interp_dx"), 1);
}

TEST(Interpret, InterpAlongABoundedAxisIsClamped) {
  const auto at = [](double d, const std::string& callee = "interp") {
    return interpolated("x bounded", "x.low = 0, x.high = zero_gradient", d, callee);
  };
  EXPECT_EQ(at(0.25), 2.5);
  EXPECT_EQ(at(-1.25), 0.5);  // -0.25, between the halo value -1 and 1
  EXPECT_EQ(at(-1.5), 0);     // the wall itself
  EXPECT_EQ(at(-7), 0);
  EXPECT_EQ(at(2.25), 8);
  EXPECT_EQ(at(1e300), 8);
  EXPECT_EQ(at(-1.5, "interp_dx"), 2);
  EXPECT_EQ(at(-1.75, "interp_dx"), 0);
  EXPECT_EQ(at(2.5, "interp_dx"), 0);  // the halo repeats the last value
  EXPECT_EQ(at(0, "interp_dx"), 2);
}

TEST(Interpret, InterpOfNoPlaceIsNaN) {
  for (const double d : {double{NAN}, double{INFINITY}, -double{INFINITY}}) {
    EXPECT_TRUE(std::isnan(interpolated("x periodic", "periodic", d)));
    EXPECT_TRUE(std::isnan(interpolated("x bounded", "x = 0", d)));
    EXPECT_TRUE(std::isnan(interpolated("x bounded", "x = 0", d, "interp_dx")));
  }
}

TEST(Interpret, InterpIsMultilinear) {
  const Module m = module_of(R"(
kernel k(u: field, out v: field, out vx: field, out vxy: field, a, b: param) {
  v = interp(u, a, b)
  vx = interp_dx(u, a, b)
  vxy = interp_dxdy(u, a, b)
}
program p { fill u periodic; run k; keep v, vx, vxy }
)");
  State state({2, {2, 2, 1}}, 1);
  state.set("u", {1, 2, 5, 16});
  interpret(m, m.programs[0], state, {{"a", 0.25}, {"b", 0.5}});
  EXPECT_EQ(state.at("v", 0, 0), 0.5 * 1.25 + 0.5 * 7.75);
  EXPECT_EQ(state.at("vx", 0, 0), 0.5 * 1 + 0.5 * 11);
  EXPECT_EQ(state.at("vxy", 0, 0), 10);
}

/// The interp and scatter of one field with slopes as in `callee`; the displacement is a field.
Module gather_and_scatter(int rank, const std::string& callee, const std::string& axes, const std::string& halo) {
  std::string d;
  for (int axis = 0; axis < rank; ++axis) d += std::string(", d") + "xyz"[axis];
  std::string fields;
  for (int axis = 0; axis < rank; ++axis) fields += std::string(", d") + "xyz"[axis] + ": field";
  const std::string on = " on " + std::to_string(rank) + " axes";
  return module_of("kernel gather(u: field" + fields + ", out v: field) { v = " + callee + "(u" + d + ") }\n" +
                   "kernel zero(out u_bar: field)" + on + " { u_bar = 0 }\n" + "kernel scatter(v_bar: field" + fields +
                   ", inout u_bar: field) { " + callee + "(u_bar" + d + ") += v_bar }\n" + "program forward { axes " +
                   axes + "; fill u " + halo + "; run gather; keep v }\n" + "program back { axes " + axes +
                   "; run zero grow 2; run scatter; fold u_bar grow 2 " + halo + "; keep u_bar }\n");
}

void check_scatter(const Module& m, const Grid& grid, Random& random) {
  State state(grid, 2);
  for (const std::string field : {"u", "v_bar", "dx", "dy", "dz"}) random.fill_interior(state, field);
  for_each_cell(grid, 0, [&](int i, int j, int k) {
    for (const std::string field : {"dx", "dy", "dz"})
      state.at(field, i, j, k) = std::round(16 * state.at(field, i, j, k)) / 4;
  });
  interpret(m, *m.find_program("forward"), state, {});
  interpret(m, *m.find_program("back"), state, {});
  double left = 0, right = 0, size = 0;
  for_each_cell(grid, 0, [&](int i, int j, int k) {
    left += state.at("v", i, j, k) * state.at("v_bar", i, j, k);
    right += state.at("u", i, j, k) * state.at("u_bar", i, j, k);
    size += std::abs(state.at("u", i, j, k) * state.at("u_bar", i, j, k));
  });
  EXPECT_NEAR(left, right, 1e-14 * (1 + size)) << grid.cells[0] << " " << grid.cells[1] << " " << grid.cells[2];
}

TEST(Interpret, ScatterIsTheTransposeOfInterp) {
  Random random(2);
  struct Case {
    int rank;
    std::string callee, axes, halo;
  };
  const std::vector<Case> cases = {
      {1, "interp", "x periodic", "periodic"},
      {1, "interp", "x bounded", "x.low = 0, x.high = zero_gradient"},
      {1, "interp_dx", "x bounded", "x.low = zero_gradient, x.high = 0"},
      {1, "interp_dx", "x periodic", "periodic"},
      {1, "interp_cx", "x periodic", "periodic"},
      {1, "interp_cx", "x bounded", "x.low = 0, x.high = zero_gradient"},
      {1, "interp_cdx", "x bounded", "x.low = zero_gradient, x.high = 0"},
      {2, "interp_lxuy", "x bounded, y periodic", "x = zero_gradient, y periodic"},
      {2, "interp_cxcy", "x bounded, y bounded", "x = zero_gradient, y = 0"},
      {3, "interp_cddxcdddyuz", "x bounded, y periodic, z bounded", "x = 0, y periodic, z = zero_gradient"},
      {2, "interp", "x periodic, y bounded", "x periodic, y = 0"},
      {2, "interp_dy", "x bounded, y bounded", "x = zero_gradient, y = 0"},
      {2, "interp_dxdy", "x bounded, y periodic", "x = 0, y periodic"},
      {3, "interp_dxdz", "x bounded, y periodic, z bounded", "x = 0, y periodic, z = zero_gradient"},
      {3, "interp", "x bounded, y bounded, z bounded", "x = 0, y = zero_gradient, z.low = zero_gradient, z.high = 0"},
  };
  for (const Case& c : cases) {
    const Module m = gather_and_scatter(c.rank, c.callee, c.axes, c.halo);
    for_each_grid(c.rank, c.rank == 3 ? 3 : 5, [&](const Grid& grid) { check_scatter(m, grid, random); });
  }
}

}  // namespace
}  // namespace dpde::stencil
