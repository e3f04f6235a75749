// SPDX-License-Identifier: Apache-2.0
// The executor against a brute-force implementation of the definitions in compiler/src/stencil/stencil.h.
#include "dpde/runtime/executor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "dpde/runtime/error.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/layout.h"
#include "dpde/runtime/workspace.h"
#include "test_program.h"

namespace dpde {
namespace {

using test::fixed_value;
using test::StreamOf;
using test::TestProgram;
using test::zero_gradient;
using Place = std::array<int64_t, 3>;

constexpr double low_value = 0.75, high_value = -1.5;

/// Uniforms 0 and 1 are the boundary values.
void two_uniforms(const double* params, double* uniforms) {
  uniforms[0] = params[0];
  uniforms[1] = params[1];
}

const std::vector<dpde_boundary>& kinds_of_axes() {
  static const std::vector<dpde_boundary> kinds{test::periodic,
                                                {fixed_value(0), fixed_value(1)},
                                                {zero_gradient, zero_gradient},
                                                {fixed_value(), zero_gradient},
                                                {zero_gradient, fixed_value(0)}};
  return kinds;
}

double uniform_value(int index) { return index < 0 ? 0 : index == 0 ? low_value : high_value; }

/// A ghost cell is weight * interior cell + shift.
struct Mirror {
  Place cell;
  double weight = 1, shift = 0;
};

/// By definition: axes in reverse order (z is filled last, from cells with filled x and y halos), one reflection at a
/// time.
Mirror mirror_of(Place place, const dpde_layout& layout, const std::array<dpde_boundary, 3>& axes) {
  Mirror result{place, 1, 0};
  for (size_t a = 3; a-- > 0;) {
    const int64_t n = layout.cells[a];
    int64_t& p = result.cell[a];
    if (axes[a].low.rule == nullptr) {
      p = ((p % n) + n) % n;
      continue;
    }
    while (p < 0 || p >= n) {
      const bool is_low = p < 0;
      p = is_low ? -1 - p : 2 * n - 1 - p;
      const dpde_side& wall = is_low ? axes[a].low : axes[a].high;
      if (wall.coefficients[0] != DPDE_ONE) continue;
      result.shift += result.weight * 2 * uniform_value(wall.value);
      result.weight = -result.weight;
    }
  }
  return result;
}

void for_each_cell(const dpde_layout& layout, const Place& grow, const std::function<void(const Place&)>& visit) {
  for (int64_t z = -grow[2]; z < layout.cells[2] + grow[2]; ++z) {
    for (int64_t y = -grow[1]; y < layout.cells[1] + grow[1]; ++y) {
      for (int64_t x = -grow[0]; x < layout.cells[0] + grow[0]; ++x) visit({x, y, z});
    }
  }
}

double& at(Field& field, const Place& p) { return field.as<double>()[index_of(field.layout(), p[0], p[1], p[2])]; }

void randomise(Field& field, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for_each_cell(field.layout(), {}, [&](const Place& p) { at(field, p) = uniform(random); });
}

/// Calls visit for all grids of 1 to `most` cells per axis with all kinds of axes (3-D: three of the five).
void for_all_grids(int rank, int64_t most,
                   const std::function<void(const std::vector<int64_t>&, const std::array<dpde_boundary, 3>&)>& visit) {
  std::vector<dpde_boundary> kinds = kinds_of_axes();
  if (rank == 3) kinds = {kinds[0], kinds[1], kinds[3]};
  const auto power = [](int64_t base, int exponent) {
    int64_t result = 1;
    for (int i = 0; i < exponent; ++i) result *= base;
    return result;
  };
  const auto kind_count = static_cast<int64_t>(kinds.size());
  for (int64_t shape = 0; shape < power(most, rank); ++shape) {
    std::vector<int64_t> cells;
    for (int64_t a = 0, rest = shape; a < rank; ++a, rest /= most) cells.push_back(1 + rest % most);
    for (int64_t code = 0; code < power(kind_count, rank); ++code) {
      std::array<dpde_boundary, 3> axes{test::periodic, test::periodic, test::periodic};
      for (int64_t a = 0, rest = code; a < rank; ++a, rest /= kind_count)
        axes[static_cast<size_t>(a)] = kinds[static_cast<size_t>(rest % kind_count)];
      visit(cells, axes);
    }
  }
}

std::array<int64_t, 3> halo_of(int rank, int64_t width) { return {width, rank > 1 ? width : 0, rank > 2 ? width : 0}; }

/// v = 2 u[-2] - 3 u[+1 in every axis] + u, sum += v, count += 1
void star_row(const dpde_row* row) {
  const test::Doubles s{row->streams};
  for (int64_t i = 0; i < row->count; ++i) {
    s[3][i] = 2 * s[0][i] - 3 * s[1][i] + s[2][i];
    row->sums[0] += s[3][i];
    row->sums[1] += 1;
  }
}

/// in_order: the program's sums are in the order of the kernel's, a special case of the executor in 1-D.
void add_star(TestProgram& program, int rank, const std::array<dpde_boundary, 3>& axes, bool in_order = true) {
  program.params({"low", "high"}, two_uniforms, 2);
  program.sums(in_order ? std::vector<std::string>{"other", "total", "count"}
                        : std::vector<std::string>{"count", "total"});
  program.halo(halo_of(rank, 2));
  program.prepare(program.fill_of("u", axes));
  const StreamOf far{"u", rank == 1 ? -2 : 0, rank == 2 ? -2 : 0, rank == 3 ? -2 : 0};
  const StreamOf diagonal{"u", 1, rank > 1 ? 1 : 0, rank > 2 ? 1 : 0};
  program.sweep(star_row, {far, diagonal, {"u"}, {"v"}}, {program.fill_of("v", axes)}, {"total", "count"});
}

class AllRanks : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Runtime, AllRanks, testing::Values(1, 2, 3),
                         [](const auto& info) { return std::to_string(info.param) + "D"; });

TEST_P(AllRanks, SweepsAndFillsAgreeWithTheDefinition) {
  const int rank = GetParam();
  int64_t grids = 0, wrong = 0;
  const auto try_grid = [&](const std::vector<int64_t>& cells, const std::array<dpde_boundary, 3>& axes) {
    TestProgram program("star", rank, {"u"}, {"v"});
    add_star(program, rank, axes, grids % 2 == 0);
    const dpde_layout layout = make_layout(cells, halo_of(rank, 2));
    Field u(layout), v(layout), input(layout);
    randomise(input, 7);
    for_each_cell(layout, {}, [&](const Place& p) { at(u, p) = at(input, p); });
    Executor executor(program.table(), layout);
    executor.bind(0, u.base());
    executor.bind(1, v.base());
    executor.set_param(executor.param_index("low"), low_value);
    executor.set_param(executor.param_index("high"), high_value);
    executor.update_uniforms();
    executor.prepare();
    executor.run();
    const auto read = [&](const Place& p) {
      const Mirror mirror = mirror_of(p, layout, axes);
      return mirror.weight * at(input, mirror.cell) + mirror.shift;
    };
    const auto star = [&](const Place& p) {
      Place far = p, diagonal = p;
      far[static_cast<size_t>(rank - 1)] -= 2;
      for (int a = 0; a < rank; ++a) ++diagonal[static_cast<size_t>(a)];
      return 2 * read(far) - 3 * read(diagonal) + at(input, p);
    };
    ++grids;
    double total = 0;
    for_each_cell(layout, {}, [&](const Place& p) { total += star(p); });
    for_each_cell(layout, halo_of(rank, 2), [&](const Place& p) {
      const Mirror mirror = mirror_of(p, layout, axes);
      if (std::abs(at(v, p) - (mirror.weight * star(mirror.cell) + mirror.shift)) > 1e-12) ++wrong;
    });
    if (std::abs(executor.sums()[static_cast<size_t>(executor.sum_index("total"))] - total) > 1e-11) ++wrong;
    if (executor.sums()[static_cast<size_t>(executor.sum_index("count"))] != static_cast<double>(cell_count(layout)))
      ++wrong;
  };
  for_all_grids(rank, 7, try_grid);
  if (rank == 1) for_all_grids(rank, 7, try_grid);  // all 35 grids, with the other order of sums
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(grids, rank == 1 ? 2 * 7 * 5 : rank == 2 ? 49 * 25 : 343 * 27);
}

TEST_P(AllRanks, FoldIsTheTransposeOfFill) {
  const int rank = GetParam();
  int64_t wrong = 0;
  for (int64_t width : {1, 3}) {
    for_all_grids(
        rank, rank == 3 ? 5 : 7, [&](const std::vector<int64_t>& cells, const std::array<dpde_boundary, 3>& axes) {
          TestProgram program("fold", rank, {"w"});
          Place grow{};
          for (size_t a = 0; a < static_cast<size_t>(rank); ++a) grow[a] = axes[a].low.rule == nullptr ? 0 : width;
          program.fold(program.fill_of("w", axes), grow);
          const dpde_layout layout = make_layout(cells, halo_of(rank, 3));
          Field w(layout), expected(layout), beyond(layout);
          std::mt19937_64 random(11);
          std::uniform_int_distribution<int> digit(-9, 9);  // integers: sums are exact in any order
          for_each_cell(layout, halo_of(rank, 3), [&](const Place& p) { at(w, p) = at(beyond, p) = digit(random); });
          for_each_cell(layout, grow, [&](const Place& p) {
            const Mirror mirror = mirror_of(p, layout, axes);
            at(expected, mirror.cell) += mirror.weight * at(w, p);
          });
          Executor executor(program.table(), layout);
          executor.bind(0, w.base());
          executor.run();
          for_each_cell(layout, halo_of(rank, 3), [&](const Place& p) {
            bool inside_grown = true;
            for (size_t a = 0; a < 3; ++a)
              inside_grown = inside_grown && p[a] >= -grow[a] && p[a] < layout.cells[a] + grow[a];
            // Folded ghost cells are 0; cells further out are unchanged.
            const double wanted = inside_grown ? at(expected, p) : at(beyond, p);
            if (at(w, p) != wanted) ++wrong;
          });
        });
  }
  EXPECT_EQ(wrong, 0);
}

/// Writes the position: x + 100 y + 10000 z.
void place_row(const dpde_row* row) {
  for (int64_t i = 0; i < row->count; ++i)
    test::Doubles{row->streams}[0][i] = static_cast<double>(row->first + i + 100 * row->y + 10000 * row->z);
}

TEST(Executor, GrownRegions) {
  TestProgram program("grown", 3, {}, {"v"});
  program.sweep(place_row, {{"v"}}, {}, {}, {2, 0, 1});
  const dpde_layout layout = make_layout(std::vector<int64_t>{5, 70, 3}, {2, 1, 2});
  Field v(layout);
  v.fill(-1e9);
  Executor executor(program.table(), layout);
  executor.bind(0, v.base());
  executor.run();
  for_each_cell(layout, {2, 1, 2}, [&](const Place& p) {
    const bool inside = p[1] >= 0 && p[1] < 70 && p[2] >= -1 && p[2] < 4;
    EXPECT_EQ(at(v, p), inside ? static_cast<double>(p[0] + 100 * p[1] + 10000 * p[2]) : -1e9);
  });
}

/// grid[0] at (0,0,0) counts the rows; each row stores the count: serial sweeps run in order.
void order_row(const dpde_row* row) {
  const test::Doubles streams{row->streams}, grids{row->grids};
  streams[0][0] = grids[0][0];
  grids[0][0] += 1;
}

TEST(Executor, SerialSweepsRunRowsInOrder) {
  TestProgram program("serial", 3, {"n"}, {"v"});
  program.sweep(order_row, {{"v"}}, {}, {}, {}, true, {"n"});
  const dpde_layout layout = make_layout(std::vector<int64_t>{8, 150, 40}, {});
  Field n(layout), v(layout);
  Executor executor(program.table(), layout, 2);
  executor.bind(executor.field_index("n"), n.base());
  executor.bind(executor.field_index("v"), v.base());
  executor.run();
  double expected = 0;
  for (int64_t z = 0; z < 40; ++z) {
    for (int64_t y = 0; y < 150; ++y) ASSERT_EQ(v.at(0, y, z), expected++);
  }
}

TEST(Executor, ResultsDoNotDependOnTheNumberOfThreads) {
  for (const std::vector<int64_t>& cells :
       std::vector<std::vector<int64_t>>{{40, 70, 40}, {5, 800, 12}, {5, 9, 600}, {200, 300}, {30, 2000, 1}, {7, 9}}) {
    const int rank = static_cast<int>(cells.size());
    TestProgram program("star", rank, {"u"}, {"v"});
    std::array<dpde_boundary, 3> axes{kinds_of_axes()[0], kinds_of_axes()[1], kinds_of_axes()[3]};
    add_star(program, rank, axes);
    const dpde_layout layout = make_layout(cells, halo_of(rank, 2));
    Field reference(layout);
    double total = 0;
    for (int threads : {1, 2, 3, 5}) {
      Field u(layout), v(layout);
      randomise(u, 3);
      Executor executor(program.table(), layout, threads);
      executor.bind(0, u.base());
      executor.bind(1, v.base());
      executor.prepare();
      executor.run();
      if (threads == 1) {
        total = executor.sums()[1];
        EXPECT_NE(total, 0);
        for_each_cell(layout, halo_of(rank, 2), [&](const Place& p) { at(reference, p) = at(v, p); });
      }
      EXPECT_EQ(executor.sums()[1], total);
      int64_t different = 0;
      for_each_cell(layout, halo_of(rank, 2), [&](const Place& p) { different += at(v, p) != at(reference, p); });
      EXPECT_EQ(different, 0) << threads << " threads";
    }
  }
}

TEST(Executor, SumsStartAtZeroInEveryRun) {
  TestProgram program("star", 1, {"u"}, {"v"});
  add_star(program, 1, {test::periodic, test::periodic, test::periodic});
  const dpde_layout layout = make_layout(std::vector<int64_t>{11}, {2, 0, 0});
  Field u(layout), v(layout);
  Executor executor(program.table(), layout);
  executor.bind(0, u.base());
  executor.bind(1, v.base());
  for (int i = 0; i < 3; ++i) {
    executor.run();
    EXPECT_EQ(executor.sums()[static_cast<size_t>(executor.sum_index("count"))], 11);
  }
}

void interpret(void* context, const dpde_layout* layout, void* const* fields, const double* params, const dpde_weights*,
               double* sums) {
  *static_cast<int*>(context) += 1;
  const test::Doubles of{fields};
  of[1][0] = of[0][0] + params[0] + static_cast<double>(layout->cells[0]);
  sums[0] = 42;
}

TEST(Executor, CallsTheInterpreterWhereThereIsOne) {
  TestProgram program("interpreted", 1, {"u"}, {"v"});
  program.params({"a"}, nullptr, 0);
  program.sums({"s"});
  int calls = 0;
  dpde_program table = program.table();
  table.interpret = interpret;
  table.context = &calls;
  const dpde_layout layout = make_layout(std::vector<int64_t>{4}, {});
  Field u(layout), v(layout);
  u.fill(1);
  Executor executor(table, layout);
  executor.bind(0, u.base());
  executor.bind(1, v.base());
  executor.set_param(0, 0.5);
  executor.update_uniforms();
  executor.run();
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(v.at(0), 5.5);
  EXPECT_EQ(executor.sums()[0], 42);
}

TEST(Executor, RefusesWhatDoesNotFit) {
  TestProgram program("star", 2, {"u"}, {"v"});
  add_star(program, 2, {test::periodic, test::periodic, test::periodic});
  const auto message = [&](const dpde_program& table, const dpde_layout& layout) -> std::string {
    try {
      Executor executor(table, layout);
      executor.prepare();
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::run);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message(program.table(), make_layout(std::vector<int64_t>{4, 4}, {2, 2, 0}, DPDE_F32)),
            "program star: its values and the grid's are not of the same precision");
  EXPECT_EQ(message(program.table(), make_layout(std::vector<int64_t>{4, 4}, {2, 1, 0})),
            "program star: needs a halo of 2 cells along y, the grid has 1");
  EXPECT_EQ(message(program.table(), make_layout(std::vector<int64_t>{4}, {2, 2, 0})),
            "program star: has 2 axes, the grid has 1");
  EXPECT_EQ(message(program.table(), make_layout(std::vector<int64_t>{4, 4}, {2, 2, 0})),
            "program star: field u is not bound");
  Workspace workspace({.layout = make_layout(std::vector<int64_t>{4, 4}, {2, 2, 0})});
  try {
    workspace.run(program.table(), 0);
    ADD_FAILURE() << "a field of zeros was made up";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "program star: field u is not bound");
  }
  dpde_program old = program.table();
  old.version = 0;
  EXPECT_EQ(message(old, make_layout(std::vector<int64_t>{4, 4}, {2, 2, 0})),
            "program star: made for version 0 of the runtime's tables, this is " + std::to_string(DPDE_ABI_VERSION));
  dpde_program odd = program.table();
  dpde_operation unknown = odd.operations[0];
  unknown.kind = 77;
  odd.operations = &unknown;
  EXPECT_EQ(message(odd, make_layout(std::vector<int64_t>{4, 4}, {2, 2, 0})),
            "program star: an operation of unknown kind 77");
}

}  // namespace
}  // namespace dpde
