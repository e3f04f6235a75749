// SPDX-License-Identifier: Apache-2.0
// Lists the arrays of FieldSolve, OperatorProbe, LinearSolver and its parts, in the order of their allocation and
// release.
#include "dpde/runtime/solve_memory.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "dpde/runtime/error.h"
#include "solve/matrix/half_rows.h"
#include "solve/solver/linear_solver.h"
#include "solve/solver/solve_inputs.h"

namespace dpde {
namespace {

constexpr double bytes_of_number = 8, entry_of_factor = 12;  // bytes
constexpr double vectors_of_cg = 3, vectors_of_bicgstab = 9;

class SolveArrays {
 public:
  explicit SolveArrays(const SolveShape& shape) : shape_(shape) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int64_t n = shape.cells[axis], reach = shape.reach[axis];
      cells_ *= static_cast<double>(n);
      if (n > 1) ++axes_;
      if (n > 1) entries_ += static_cast<double>(reach < 0 ? n - 1 : std::min(2 * reach, n - 1));
      has_neighbours_ = has_neighbours_ && reach >= 0 && reach <= 1;
    }
  }

  SolveMemory memory() {
    note(2);  // values and their image
    if (!shape_.is_constant) keep(entries_);
    note(shape_.is_constant ? 0 : 2);
    keep(0.5);  // cells of the null space
    solver();
    keep(1);                   // right side of the solver
    keep(2 + shape_.guesses);  // vectors of the solve: right side, solution and guesses
    if (shape_.changes) keep(renewal());
    return {bytes_of_number * cells_ * kept_, bytes_of_number * cells_ * peak_};
  }

 private:
  /// In doubles a cell, as everywhere here.
  void keep(double doubles) {
    kept_ += doubles;
    note(0);
  }
  void note(double doubles) { peak_ = std::max(peak_, kept_ + doubles); }

  int method() const {
    if (shape_.method != DPDE_SOLVE_AUTOMATIC) return shape_.method;
    const bool is_line = shape_.cells[1] == 1 && shape_.cells[2] == 1;
    if (is_line && has_neighbours_) return DPDE_SOLVE_TRIDIAGONAL;
    if (shape_.is_constant) return DPDE_SOLVE_FOURIER;
    if (cells_ <= small_system) return DPDE_SOLVE_DIRECT;
    return has_neighbours_ ? DPDE_SOLVE_CG : DPDE_SOLVE_BICGSTAB;
  }

  void solver() {
    switch (method()) {
      case DPDE_SOLVE_TRIDIAGONAL: return keep(4);
      case DPDE_SOLVE_FOURIER: return waves();
      case DPDE_SOLVE_DIRECT: return factors();
      case DPDE_SOLVE_MULTIGRID: return cycles(true, shape_.has_floats);
      case DPDE_SOLVE_CG:
        cycles(has_neighbours_, shape_.has_floats, shape_.has_floats ? 2 : vectors_of_cg);
        return keep(has_neighbours_ ? (shape_.has_floats ? vectors_of_cg : 0) : vectors_of_cg + 1);
      case DPDE_SOLVE_GMRES: preconditioner(false); return keep(vectors_of_gmres + 3);
      case DPDE_SOLVE_BICGSTAB: preconditioner(shape_.has_floats); return keep(vectors_of_bicgstab);
      default: throw Error(ErrorKind::run, "the memory of this method of solves is not known");
    }
  }

  /// GridWaves, and the factors of modes; complex conjugate modes share one.
  void waves() {
    const bool has_rings = shape_.periodic[0] || shape_.periodic[1] || shape_.periodic[2];
    const auto first = static_cast<double>(shape_.cells[0]);
    const double gap = 1 + 10 / std::max(first, 10.0);
    const bool become_complex = !shape_.periodic[0] && shape_.periodic[1] && shape_.cells[2] > 1;
    const double all = gap + (become_complex ? 2 * gap : 0) + (has_rings ? 0.5 : 1) * gap;
    keep(all);
    if (!shape_.has_floats) return;
    note(4);  // arrays for the accuracy test
    keep(all / 2);
  }

  /// A vector in half rows, with the extra spaces between them (solve/matrix/half_rows.h), on a level's grid; `line`:
  /// numbers in a cache line.
  double packed(const std::array<std::int64_t, 3>& cells, std::int64_t line = numbers_of_line<double>) const {
    const HalfRows row(cells[0], shape_.periodic[0], line);
    return static_cast<double>(row.stride() * cells[1] * cells[2]) / cells_;
  }

  /// Multigrid: MultigridLevel of a fine and a coarse grid, then CycleLevel of all levels.
  void cycles(bool are_there, bool are_floats, double vectors = 2) {
    if (!are_there) return;
    const std::int64_t line = are_floats ? numbers_of_line<float> : numbers_of_line<double>;
    const double part = are_floats ? 0.5 : 1;  // of a double
    double fine = packed(shape_.cells, line), coarse = 0;
    std::array<std::int64_t, 3> cells = shape_.cells;
    while (cells[0] * cells[1] * cells[2] > 64) {  // cells of the coarsest grid
      for (std::int64_t& along : cells) along = (along + 1) / 2;
      coarse += packed(cells, line);
    }
    const double level = are_floats ? 6 : 5, cycle = 1 + (shape_.is_constant ? 0 : axes_ + 2);
    note(level * (1 + std::exp2(-axes_)) + (shape_.is_constant ? 0 : part * fine));
    keep(part * (cycle * (fine + coarse) + 2 * coarse));
    keep(part * vectors * fine);  // packed right sides and solutions, or those of cg
  }

  /// NullSpaceMemory, and MultigridLevel of a fine and a coarse grid, which are kept from the second operator on.
  double renewal() const {
    const bool has_levels = has_neighbours_ && method() != DPDE_SOLVE_DIRECT && method() != DPDE_SOLVE_TRIDIAGONAL;
    const double level = 6, of_null_space = 1.25;
    return of_null_space + (has_levels ? level * (1 + std::exp2(-axes_)) : 0);
  }

  void preconditioner(bool by_floats) {
    if (has_neighbours_) return cycles(true, by_floats);
    note(2 * entries_ * (entry_of_factor + bytes_of_number) / bytes_of_number);  // by rows, and by columns
    keep(2 * entries_ * entry_of_factor / bytes_of_number);
  }

  /// In 2-D about 31/4*n*log2(n) entries (George, SIAM J. Numer. Anal. 10, 1973, 345).
  void factors() {
    const double of_plane = 7.75 * std::log2(std::max(cells_, 2.0));
    const double entries = axes_ < 2 ? 2 * entries_ : of_plane;
    note(entries_ * (entry_of_factor + bytes_of_number) / bytes_of_number +
         2 * entries * entry_of_factor / bytes_of_number);
    keep((2 * entries + entries_) * entry_of_factor / bytes_of_number + 3);
  }

  const SolveShape& shape_;
  double cells_ = 1, entries_ = 1;
  int axes_ = 0;
  bool has_neighbours_ = true;  // and no other entries
  double kept_ = 0, peak_ = 0;
};

}  // namespace

/// Whether the program computes a coefficient, or steps change one.
bool has_changing_coefficients(const dpde_solve& solve, const dpde_program& program) {
  const std::span coefficients(solve.coefficients, static_cast<std::size_t>(solve.coefficient_count));
  const std::span swaps(program.swaps, static_cast<std::size_t>(program.swap_count));
  return std::ranges::any_of(coefficients, [&](int32_t field) {
    return field >= program.input_count || std::ranges::find(swaps, field, &dpde_swap::state) != swaps.end();
  });
}

SolveShape shape_of(const dpde_solve& solve, const dpde_layout& given) {
  const dpde_layout layout = with_three_axes(given);
  SolveShape shape;
  std::copy_n(layout.cells, 3, shape.cells.begin());
  std::copy_n(solve.reach, 3, shape.reach.begin());
  shape.periodic = periodic_axes(solve, given);
  shape.is_constant = solve.coefficient_count == 0;
  shape.method = solve.method;
  shape.guesses = solve.guess_count;
  shape.has_floats = layout.real == DPDE_F32;
  return shape;
}

SolveMemory memory_of(const SolveShape& shape) { return SolveArrays(shape).memory(); }

}  // namespace dpde
