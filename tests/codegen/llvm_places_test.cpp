// SPDX-License-Identifier: Apache-2.0
// What depends on where a cell lies: inside, interpolation and its transpose, on all ranks and kinds of axes.
#include "codegen/llvm_reference.h"

namespace dpde::codegen::testing {
namespace {

const std::vector<std::vector<Topology>> all_axes{{P},    {B},       {P, P},    {B, P},   {P, B},
                                                  {B, B}, {P, B, P}, {B, P, B}, {B, B, B}};
const std::vector<std::array<int, 3>> sizes{{1, 1, 1}, {2, 1, 3}, {3, 2, 1}, {17, 3, 2}, {19, 4, 5}, {67, 2, 2}};
const double nan = std::numeric_limits<double>::quiet_NaN();
const double infinity = std::numeric_limits<double>::infinity();

void expect_same_for_all_sizes(const loop::Module& module, int grow = 0) {
  const auto compiled = compile(module);
  ASSERT_NE(compiled, nullptr);
  for (const std::array<int, 3>& cells : sizes) {
    expect_same(module, *compiled, cells, {}, grow);
    if (::testing::Test::HasFailure()) return;
  }
}

/// Displacements of up to some cells in both directions, different along each axis.
std::vector<Expr> displacements(ModuleBuilder& b, std::size_t rank, double reach) {
  std::vector<Expr> result;
  for (std::size_t a = 0; a < rank; ++a) {
    const Expr field = b.load(std::string("d") + "xyz"[a]);
    result.push_back((field - Expr(1.0)) * Expr(2 * reach / static_cast<double>(a + 1)));
  }
  return result;
}

TEST(LlvmPlaces, InsideOnAllRanksAndGrownRegions) {
  for (const std::vector<Topology>& axes : all_axes) {
    ModuleBuilder b(axes);
    const Expr u = b.load("u");
    Expr total = 0.0;
    double weight = 1;
    for (const Offset offset :
         {Offset{0, 0, 0}, Offset{-1, 0, 0}, Offset{2, 0, 0}, Offset{0, 1, 0}, Offset{0, -2, 1}}) {
      for (const int grow : {0, 1, 3}) {
        Offset used{};
        for (std::size_t a = 0; a < axes.size(); ++a) used[a] = offset[a];
        total = total + select(inside(used, grow), u * Expr(weight), Expr(0.0));
        weight *= 2;
      }
    }
    b.store("v", total);
    const loop::Module module = b.finish();
    expect_same_for_all_sizes(module, 0);
    expect_same_for_all_sizes(module, 2);
  }
}

TEST(LlvmPlaces, InterpolationOnAllRanks) {
  for (const std::vector<Topology>& axes : all_axes) {
    for (const double reach : {0.75, 40.0}) {
      ModuleBuilder b(axes);
      b.store("v", loop::make(b.place("u", displacements(b, axes.size(), reach))));
      expect_same_for_all_sizes(b.finish());
    }
  }
}

TEST(LlvmPlaces, InterpolationFromDisplacedAndGrownCells) {
  for (const std::vector<Topology>& axes : all_axes) {
    ModuleBuilder b(axes);
    Offset offset{};
    for (std::size_t a = 0; a < axes.size(); ++a) offset[a] = a == 1 ? 2 : -1;
    b.store("v", loop::make(b.place("u", displacements(b, axes.size(), 1.5), offset)) * b.load("u"));
    expect_same_for_all_sizes(b.finish(), 2);
  }
}

/// What is taken along an axis, each beside another along the others.
TEST(LlvmPlaces, SlopesCellsAndCubicsAlongEveryAxis) {
  for (const std::vector<Topology>& axes : all_axes) {
    for (int kind = 1; kind < along_count; ++kind) {
      for (std::size_t axis = 0; axis < axes.size(); ++axis) {
        ModuleBuilder b(axes);
        std::array<InterpolationBasis, loop::max_rank> along{};
        for (std::size_t a = 0; a < axes.size(); ++a)
          along[a] = static_cast<InterpolationBasis>((kind + a - axis + along_count) % along_count);
        b.store("v", loop::make(b.place("u", displacements(b, axes.size(), 2.5), {}, along)));
        expect_same_for_all_sizes(b.finish());
      }
    }
  }
}

TEST(LlvmPlaces, WholeCellsTakeTheNeighbourAndTheSlopeToTheRight) {
  ModuleBuilder b({B});
  b.store("v", loop::make(b.place("u", {b.load("d")})));
  b.store("s", loop::make(b.place("u", {b.load("d")}, {}, {InterpolationBasis::slope})));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  for (const int d : {-2, -1, 0, 1}) {
    Memory memory(module, {20, 1, 1});
    std::fill(memory.field("d").begin(), memory.field("d").end(), d);
    run(*compiled->find("all"), {B}, memory, {});
    for (int i = 2; i < 18; ++i) {
      EXPECT_EQ(memory.at("v", i, 0, 0), memory.at("u", i + d, 0, 0));
      EXPECT_EQ(memory.at("s", i, 0, 0), memory.at("u", i + d + 1, 0, 0) - memory.at("u", i + d, 0, 0));
    }
  }
}

/// Turns are counted by the inverse of the number of cells, which is not exact.
TEST(LlvmPlaces, WholeTurnsLeadBackOnRings) {
  ModuleBuilder b({P});
  b.store("v", loop::make(b.place("u", {b.load("d")})));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  for (int n = 1; n < 200; ++n) {
    for (const int turns : {-7, -3, -1, 1, 2, 5, 1000003}) {
      Memory memory(module, {n, 1, 1});
      std::fill(memory.field("d").begin(), memory.field("d").end(), 1.0 * turns * n + 1);
      run(*compiled->find("all"), {P}, memory, {});
      for (int i = 0; i < n; ++i) ASSERT_EQ(memory.at("v", i, 0, 0), memory.at("u", (i + 1) % n, 0, 0)) << n << turns;
    }
  }
}

TEST(LlvmPlaces, TheEdgeItselfIsNotClamped) {
  ModuleBuilder b({B});
  b.store("s", loop::make(b.place("u", {b.load("d")}, {}, {InterpolationBasis::slope})));
  const loop::Module module = b.finish();
  const auto compiled = compile(module);
  const int n = 1000;
  Memory memory(module, {n, 1, 1});
  memory.at("d", 0, 0, 0) = -0.5;
  memory.at("d", 1, 0, 0) = std::nextafter(-1.5, -2);
  memory.at("d", n - 2, 0, 0) = std::nextafter(1.5, 2);
  memory.at("d", n - 1, 0, 0) = 0.5;
  run(*compiled->find("all"), {B}, memory, {});
  EXPECT_EQ(memory.at("s", 0, 0, 0), memory.at("u", 0, 0, 0) - memory.at("u", -1, 0, 0));
  EXPECT_EQ(memory.at("s", 1, 0, 0), 0);
  EXPECT_EQ(memory.at("s", n - 2, 0, 0), 0);
  EXPECT_EQ(memory.at("s", n - 1, 0, 0), memory.at("u", n, 0, 0) - memory.at("u", n - 1, 0, 0));
}

/// Cells an interpolation that reaches `reach` cells beyond walls may read hold 1, all other memory holds NaN: a value
/// that is 1 has read nothing else.
void set_readable_cells(Memory& memory, const std::vector<Topology>& axes, int reach) {
  std::fill(memory.field("u").begin(), memory.field("u").end(), nan);
  std::array<int64_t, 3> edge{};
  for (std::size_t a = 0; a < axes.size(); ++a) edge[a] = axes[a] == B ? reach : 0;
  const dpde_layout& layout = memory.layout();
  for (int64_t z = -edge[2]; z < layout.cells[2] + edge[2]; ++z) {
    for (int64_t y = -edge[1]; y < layout.cells[1] + edge[1]; ++y) {
      for (int64_t x = -edge[0]; x < layout.cells[0] + edge[0]; ++x) memory.at("u", x, y, z) = 1;
    }
  }
}

void expect_any_displacement_stays_inside(InterpolationBasis along) {
  for (const std::vector<Topology>& axes : all_axes) {
    ModuleBuilder b(axes);
    b.store("v", loop::make(b.place("u", displacements(b, axes.size(), 0.5), {}, {along, along, along})));
    const loop::Module module = b.finish();
    const auto compiled = compile(module);
    for (const double d : {1e300, -1e300, 1e18, -1e18, 3e9, -3e9, 1e-300, -1e-300, -0.0, nan, infinity, -infinity}) {
      for (const std::array<int, 3>& cells : sizes) {
        Memory memory(module, cells);
        set_readable_cells(memory, axes, reach_of(along));
        for (const char* name : {"dx", "dy", "dz"}) {
          if (memory.fields().contains(name)) std::fill(memory.field(name).begin(), memory.field(name).end(), d);
        }
        run(*compiled->find("all"), axes, memory, {});
        memory.for_each_row(axes, 0, [&](int64_t y, int64_t z, int64_t first, int64_t count) {
          for (int64_t x = first; x < first + count; ++x) {
            const double v = memory.at("v", x, y, z);
            EXPECT_TRUE(std::isfinite(d) ? std::abs(v - 1) < 1e-14 : std::isnan(v)) << d << " gives " << v;
          }
        });
        if (::testing::Test::HasFailure()) return;
      }
    }
  }
}

TEST(LlvmPlaces, AnyDisplacementStaysInsideTheField) {
  for (const InterpolationBasis along :
       {InterpolationBasis::linear, InterpolationBasis::lower, InterpolationBasis::upper, InterpolationBasis::cubic})
    expect_any_displacement_stays_inside(along);
}

TEST(LlvmPlaces, NothingAtNoPlaceIsANumber) {
  for (int kind = 0; kind < 2 * along_count; ++kind) {
    const Topology axis = kind % 2 == 0 ? P : B;
    ModuleBuilder b({axis});
    b.store("v", loop::make(b.place("u", {b.load("d")}, {}, {static_cast<InterpolationBasis>(kind / 2)})));
    const loop::Module module = b.finish();
    const auto compiled = compile(module);
    Memory memory(module, {23, 1, 1});
    for (int i = 0; i < 23; ++i) memory.at("d", i, 0, 0) = i % 3 == 0 ? nan : i % 3 == 1 ? infinity : 0.25;
    run(*compiled->find("all"), {axis}, memory, {});
    for (int i = 0; i < 23; ++i) EXPECT_EQ(std::isnan(memory.at("v", i, 0, 0)), i % 3 != 2);
  }
}

TEST(LlvmPlaces, ScatterOnAllRanks) {
  for (const std::vector<Topology>& axes : all_axes) {
    for (const double reach : {0.75, 40.0}) {
      ModuleBuilder b(axes);
      std::array<InterpolationBasis, loop::max_rank> slope{}, cubic{};
      slope[axes.size() - 1] = InterpolationBasis::slope;
      cubic[0] = InterpolationBasis::cubic;
      cubic[axes.size() - 1] = reach < 1 ? InterpolationBasis::cubic_slope : InterpolationBasis::cubic;
      const std::vector<Expr> d = displacements(b, axes.size(), reach);
      b.scatter(b.place("u_bar", d), b.load("v_bar"));
      b.scatter(b.place("w_bar", d, {1}), b.load("v_bar") * loop::make(b.place("u", d, {}, slope)));
      b.scatter(b.place("u_bar", d, {-1}), Expr(0.5));
      b.scatter(b.place("w_bar", d, {}, cubic), b.load("v_bar"));
      b.scatter(b.place("u_bar", d, {}, {InterpolationBasis::lower}), Expr(0.5));
      expect_same_for_all_sizes(b.finish());
    }
  }
}

TEST(LlvmPlaces, ScatterIsTheTransposeOfInterpolation) {
  for (const std::vector<Topology>& axes : all_axes) {
    ModuleBuilder b(axes);
    b.store("v", loop::make(b.place("u", displacements(b, axes.size(), 3))));
    b.start("scatter");
    b.scatter(b.place("u_bar", displacements(b, axes.size(), 3)), b.load("v_bar"));
    const loop::Module module = b.finish();
    const auto compiled = compile(module);
    Memory memory(module, {13, 5, 3});
    std::fill(memory.field("v").begin(), memory.field("v").end(), 0.0);
    std::fill(memory.field("u_bar").begin(), memory.field("u_bar").end(), 0.0);
    run(*compiled->find("all"), axes, memory, {});
    double left = 0, right = 0;
    for (std::size_t i = 0; i < memory.field("u").size(); ++i) {
      left += memory.field("v")[i] * memory.field("v_bar")[i];
      right += memory.field("u")[i] * memory.field("u_bar")[i];
    }
    EXPECT_GT(left, 5);
    EXPECT_NEAR(left, right, 1e-13 * left);
  }
}

void expect_any_scatter_stays_inside(InterpolationBasis along) {
  for (const std::vector<Topology>& axes : all_axes) {
    ModuleBuilder b(axes);
    b.scatter(b.place("u", displacements(b, axes.size(), 0.5), {}, {along, along, along}), Expr(1.0));
    const loop::Module module = b.finish();
    const auto compiled = compile(module);
    for (const double d : {1e300, -1e300, nan, infinity, -infinity}) {
      Memory memory(module, {5, 3, 2});
      for (const char* name : {"dx", "dy", "dz"}) {
        if (memory.fields().contains(name)) std::fill(memory.field(name).begin(), memory.field(name).end(), d);
      }
      std::fill(memory.field("u").begin(), memory.field("u").end(), 0.0);
      Memory readable = memory;
      set_readable_cells(readable, axes, reach_of(along));
      run(*compiled->find("all"), axes, memory, {});
      for (std::size_t i = 0; i < memory.field("u").size(); ++i) {
        if (!std::isnan(readable.field("u")[i])) continue;
        EXPECT_EQ(memory.field("u")[i], 0);
      }
    }
  }
}

TEST(LlvmPlaces, ScatterOfAnyDisplacementStaysInsideTheField) {
  for (const InterpolationBasis along :
       {InterpolationBasis::linear, InterpolationBasis::lower, InterpolationBasis::cubic})
    expect_any_scatter_stays_inside(along);
}

}  // namespace
}  // namespace dpde::codegen::testing
