// SPDX-License-Identifier: Apache-2.0
// Geometric multigrid for operators that couple each cell with its neighbours along the axes, symmetrically and with
// one sign: diffusion with coefficients, obstacles and walls, with or without a term of its own (Brandt 1977; of cells
// in place of nodes, Wesseling 1988). solve/multigrid_level.h has the equations of the levels.
//
// One V-cycle smooths on the way down and up, by red cells, then black ones, or as solve/smoother.h has it.
// Interpolation is linear. A symmetric cycle, to precondition CG, smooths in reverse on the way up, and its restriction
// is the transpose of interpolation. A cycle that is used alone comes nearer with the plain sum of residuals (to 1e-6
// on 512^2 and 128^3: 6 and 7 cycles for 8 and 10). The coarsest level has factors.
//
// Vectors are in half rows (solve/half_rows.h), times the sign that makes the diagonal positive: pack and unpack.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "solve/matrix/null_space.h"
#include "solve/matrix/stencil_matrix.h"
#include "solve/matrix/symmetric_factors.h"
#include "solve/multigrid/cycle_level.h"
#include "solve/multigrid/multigrid_level.h"
#include "solve/operator/krylov.h"
#include "solve/rows/constant_rows.h"

namespace dpde {

struct MultigridOptions {
  double rounding = 0x1p-52;        // as in SolveOptions
  bool is_symmetric = false;        // to precondition CG
  bool is_known_symmetric = false;  // the operator, whatever rounding of its entries says
  SmootherKind smoother = SmootherKind::automatic;
  Team team = 1;
};

/// What levels are made of, two at a time: kept once coefficients have changed.
struct MultigridWork {
  MultigridLevel level, coarse;
  double sign = 1;
};

/// Of levels of floats or doubles (`Real`). Those of floats are of the operator times a power of two that brings it
/// into their range, which cycles and `unpack` take into account.
template <class Real>
class MultigridOf {
 public:
  /// Nothing where the operator has another form: `why` is what it has. `rows`: StencilMatrix or ConstantRows.
  template <class Rows>
  static std::optional<MultigridOf> of(const Rows& rows, const NullSpace& null_space, const MultigridOptions& options,
                                       std::string& why) {
    return made_of(rows, false, null_space, options, why);
  }
  /// Of the symmetric part of the neighbours' entries; for preconditioners of operators that have others too.
  template <class Rows>
  static std::optional<MultigridOf> of_symmetric_part(const Rows& rows, const NullSpace& null_space,
                                                      const MultigridOptions& options, std::string& why) {
    return made_of(rows, true, null_space, options, why);
  }

  /// In place of what it was made of: a matrix of the same grid, with the same options. False where they have another
  /// form, smoother or other levels; then it is of no use.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space, bool is_known_symmetric);

  std::size_t size() const { return levels_.front().size(); }  // of a vector
  void pack_right(std::span<const double> b, std::span<Real> vector) const { pack_right(b, 1, vector); }
  /// factor*b
  void pack_right(std::span<const double> b, double factor, std::span<Real> vector) const;
  /// The same of rows along x that come one by one, without what no image has; |vector|.
  double pack_rows(const ReadRowsOf<double>& b, double factor, std::span<Real> vector);
  void pack(std::span<const double> x, std::span<Real> vector) const;
  void unpack(std::span<const Real> vector, std::span<double> x) const { unpack(vector, 1, false, x); }
  /// x = factor*vector, or x += that.
  void unpack(std::span<const Real> vector, double factor, bool is_added, std::span<double> x) const;

  /// One cycle, for the guess 0: x is about A^-1*b.
  void cycle(std::span<const Real> b, std::span<Real> x) { descend(0, b.data(), x.data()); }
  /// Cycles until |b - A*x| is at most the tolerance times |b|, or `rounding` times |x|.
  IterationReport iterate(std::span<const Real> b, std::span<Real> x, double tolerance, double rounding, int most);
  /// The same of floats, for the guess 0, without rounding of images: until what is left is that of x. `size`: |b|.
  IterationReport iterate_from_zero(std::span<const Real> b, double size, std::span<Real> x, double tolerance,
                                    int most);
  /// Without what rounding leaves of the null space in the image: residuals that are carried along would keep it, as no
  /// correction takes it away, until it hides the rest.
  void multiply(std::span<const Real> x, std::span<Real> y) const;
  double residual(std::span<const Real> b, std::span<const Real> x);  // |b - A*x|
  SmootherKind smoother() const { return smoother_; }
  int levels() const { return static_cast<int>(levels_.size()); }

 private:
  struct Goal {
    double tolerance, rounding, size, squares;  // |b|; |b - A*x|^2 at the beginning
    int most;
    bool is_guess_zero;
  };
  template <class Rows>
  static std::optional<MultigridOf> made_of(const Rows& rows, bool is_part, const NullSpace& null_space,
                                            const MultigridOptions& options, std::string& why);
  /// All levels of the finest of `work`, which is given up level by level where there were none. False where there are
  /// others, or no factors: `why`.
  bool set_levels(MultigridWork& work, const char*& why);
  bool set_level(std::size_t number, MultigridLevel& level, bool is_new);
  bool set_coarsest(MultigridLevel& level, const char*& why);
  void know_null_space(const NullSpace& null_space);
  IterationReport go_on(std::span<const Real> b, std::span<Real> x, const Goal& goal);
  bool is_at_end(std::span<const Real> x, const Goal& goal, double left, double before) const;
  void descend(std::size_t level, const Real* b, Real* x);

  Team team_;
  std::vector<CycleLevel<Real>> levels_;
  SymmetricFactors coarsest_;
  std::vector<double> coarsest_b_, coarsest_x_;
  std::size_t singular_cells_ = 0;  // where the one singular part is the whole grid: their number
  std::vector<std::vector<std::uint32_t>> singular_parts_;  // else: where their cells are in a vector
  double sign_ = 1, scale_ = 1;                             // what the operator is multiplied by
  bool is_part_ = false;
  SmootherKind smoother_ = SmootherKind::red_black;
  MultigridOptions options_;
  std::unique_ptr<MultigridWork> work_;  // from the first renewal on
};

extern template class MultigridOf<double>;
extern template class MultigridOf<float>;
using Multigrid = MultigridOf<double>;

}  // namespace dpde
