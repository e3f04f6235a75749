// SPDX-License-Identifier: Apache-2.0
// Geometric multigrid for operators that couple each cell with its neighbours along the axes, symmetrically and with
// one sign: diffusion with variable coefficients, obstacles and walls, with or without a zeroth-order term (Brandt
// 1977; cell centred: Wesseling 1988). solve/multigrid/multigrid_level.h has the equations of the levels.
//
// A V-cycle smooths on the way down and up, by default red cells, then black ones (solve/multigrid/smoother.h).
// Interpolation is linear. A symmetric cycle, as a preconditioner of CG, smooths in reverse on the way up, and its
// restriction is the transpose of interpolation. A cycle that is used alone converges faster with the plain sum of
// residuals (to 1e-6 on 512^2 and 128^3: 6 and 7 cycles in place of 8 and 10). The coarsest level is factorised.
//
// Vectors are in half rows (solve/matrix/half_rows.h), times the sign that makes the diagonal positive: pack and
// unpack.
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
  bool is_symmetric = false;        // symmetric cycle, to precondition CG
  bool is_known_symmetric = false;  // the operator is symmetric, whatever the rounding of its entries
  SmootherKind smoother = SmootherKind::automatic;
  Team team = 1;
};

/// Work memory for making levels, two at a time; kept after the first change of coefficients.
struct MultigridWork {
  MultigridLevel level, coarse;
  double sign = 1;
};

/// With levels of floats or doubles (`Real`). Float levels are those of the operator times a power of two, which brings
/// it into their range; cycles and `unpack` compensate for it.
template <class Real>
class MultigridOf {
 public:
  /// Empty if the operator has another form, with the reason in `why`. `rows`: StencilMatrix or ConstantRows.
  template <class Rows>
  static std::optional<MultigridOf> of(const Rows& rows, const NullSpace& null_space, const MultigridOptions& options,
                                       std::string& why) {
    return made_of(rows, false, null_space, options, why);
  }
  /// For the symmetric part of the neighbours' entries; preconditions operators that have other entries too.
  template <class Rows>
  static std::optional<MultigridOf> of_symmetric_part(const Rows& rows, const NullSpace& null_space,
                                                      const MultigridOptions& options, std::string& why) {
    return made_of(rows, true, null_space, options, why);
  }

  /// Rebuilds in place for a matrix of the same grid, with the same options. False if form, smoother or levels change;
  /// the object is then unusable.
  bool renew(const StencilMatrix& matrix, const NullSpace& null_space, bool is_known_symmetric);

  std::size_t size() const { return levels_.front().size(); }  // of a vector
  void pack_right(std::span<const double> b, std::span<Real> vector) const { pack_right(b, 1, vector); }
  /// factor*b
  void pack_right(std::span<const double> b, double factor, std::span<Real> vector) const;
  /// The same for rows along x that are read one by one; removes the null space and returns |vector|.
  double pack_rows(const ReadRowsOf<double>& b, double factor, std::span<Real> vector);
  void pack(std::span<const double> x, std::span<Real> vector) const;
  void unpack(std::span<const Real> vector, std::span<double> x) const { unpack(vector, 1, false, x); }
  /// x = factor*vector, or x += that.
  void unpack(std::span<const Real> vector, double factor, bool is_added, std::span<double> x) const;

  /// One cycle from the guess 0: x is about A^-1*b.
  void cycle(std::span<const Real> b, std::span<Real> x) { descend(0, b.data(), x.data()); }
  /// Cycles until |b - A*x| is at most tolerance*|b|, or `rounding`*|x|.
  IterationReport iterate(std::span<const Real> b, std::span<Real> x, double tolerance, double rounding, int most);
  /// The same for floats from the guess 0: stops when the residual is rounding of x. `size`: |b|.
  IterationReport iterate_from_zero(std::span<const Real> b, double size, std::span<Real> x, double tolerance,
                                    int most);
  /// Removes rounding in the null space from the image. Otherwise residuals that are updated recursively would
  /// accumulate it, since no correction removes it, until it dominates.
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
  /// Makes all levels from the finest of `work`, which is freed level by level in the first setup. False if the levels
  /// change, or if the coarsest cannot be factorised: `why`.
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
  std::size_t singular_cells_ = 0;  // number of cells, if the only singular part is the whole grid
  std::vector<std::vector<std::uint32_t>> singular_parts_;  // otherwise: indices of their cells in a vector
  double sign_ = 1, scale_ = 1;                             // factors of the operator
  bool is_part_ = false;
  SmootherKind smoother_ = SmootherKind::red_black;
  MultigridOptions options_;
  std::unique_ptr<MultigridWork> work_;  // from the first renewal on
};

extern template class MultigridOf<double>;
extern template class MultigridOf<float>;
using Multigrid = MultigridOf<double>;

}  // namespace dpde
