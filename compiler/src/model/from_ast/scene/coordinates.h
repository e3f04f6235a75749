// SPDX-License-Identifier: Apache-2.0
// Vector operators in orthogonal coordinates; all metric terms are in this file. A unit of axis i has length h_i, and
// e_i is the unit vector along it, so vector components are physical. V is the product of all h (and of the way around
// an axis of symmetry); A_i = V/h_i is the area of a face across axis i; both are per unit of the coordinates:
//
//   grad f                   d_i f / h_i
//   div v                    sum of d_i(A_i v_i) / V
//   lap f                    sum of d_i(A_i/h_i d_i f) / V
//   curl v, along k          (d_i(h_j v_j) - d_j(h_i v_i)) / (h_i h_j)
//   v . grad f               components v_i/h_i
//   (v . grad f)_i of a vector    + sum over j of f_j (v_i d_j h_i - v_j d_i h_j) / (h_i h_j)
//   grad f of a vector       (i, j): d_j f_i/h_j - f_j d_i h_j / (h_i h_j); (i, i): + sum of f_j d_j h_i / (h_i h_j)
//   div S of a tensor        sum of d_j(A_j S_ij) / V + sum over j of (S_ji d_j h_i - S_jj d_i h_j) / (h_i h_j)
//   lap f of a vector        D_j = d_j + (e_i turn by kappa_j per unit of coordinate j): sum of D_j(A_j/h_j D_j f) / V
//
//   s k x v                  (-s A_j v_j / h_i, s A_i v_i / h_j)
//
// (G. Batchelor, An introduction to fluid dynamics, appendix 2.) Factors that do not depend on coordinate i are taken
// out of d_i. A remaining d_i acts on a flux on faces, whose area is exact there: 0 at poles. So sums of V times it
// telescope.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "model/analyse/placement.h"
#include "model/model.h"

namespace dpde::model {

class Coordinates {
 public:
  /// Reads the problem at each call. `origin`: of the results.
  Coordinates(const Problem& problem, Origin origin)
      : problem_(problem), placements_(problem), origin_(std::move(origin)) {}

  Expr slope(const Expr& f, int axis) const;
  Expr laplacian(const Expr& f) const;
  Expr divergence(const std::vector<Expr>& v) const;
  /// The component along the third axis: d_a v_b - d_b v_a, with lengths.
  Expr rotation(const std::vector<Expr>& v, int a, int b) const;
  /// Products of components on faces are interpolated to the cell with volume weights.
  Expr dot(const std::vector<Expr>& a, const std::vector<Expr>& b) const;
  /// s k x v on two axes. For v on faces and s on nodes, the sum over all faces of its product with v is 0, so it does
  /// no work. If s is advected by v without divergence, the square of s is conserved: the terms for flow without
  /// divergence of A. Arakawa, Y.-J. G. Hsu, Mon. Wea. Rev. 118 (1990) 1960.
  std::vector<Expr> cross(const Expr& s, const std::vector<Expr>& v) const;
  std::vector<Expr> speeds(std::vector<Expr> v) const;
  /// The components of v . grad f.
  std::vector<Expr> advection(const std::vector<Expr>& v, const std::vector<Expr>& f) const;
  /// The components of a vector on two axes, all at the same placement.
  std::vector<Expr> vector_laplacian(const std::vector<Expr>& f) const;
  /// Without an axis of symmetry, row by row: the derivative of component i of v along direction j, and the divergence
  /// of each row.
  std::vector<Expr> vector_gradient(const std::vector<Expr>& v) const;
  std::vector<Expr> tensor_divergence(const std::vector<Expr>& s) const;
  /// Converts d_x a d_y b - d_y a d_x b from coordinates to lengths.
  Expr per_area(const Expr& bracket) const;
  Expr per_volume(const Expr& e) const;
  Expr times_volume(const Expr& e) const;
  /// mean, integral or another reduction, weighted by cell sizes.
  Expr reduction(const Reduce& reduce) const;

 private:
  int axes() const { return static_cast<int>(problem_.axes.size()); }
  Expr scale(int axis) const;
  /// The factors of A_i that depend on coordinate i.
  Expr face(int axis) const;
  /// d_i(A_i flux) / V.
  Expr outflow(const Expr& flux, int axis) const;
  Expr diffusion(const Expr& f, int axis) const;
  /// Whether its components have different placements.
  bool is_spread(const std::vector<Expr>& v) const;
  /// The part of the rotation from the component along axis a: d_b(h_a v_a)/(h_a h_b).
  Expr turn_of(const Expr& component, int a, int b) const;
  /// s times v across an axis, at the placement that `cross` requires.
  Expr carried(const Expr& s, const Expr& across, bool has_s_inside) const;
  /// The component on faces across the axis.
  Expr on_faces(const Expr& component, int axis) const;
  /// Interpolated to placement `home`, unless it is there.
  Expr beside(const Expr& e, const std::optional<Placement>& home) const;
  /// f d_by h_of / (h_of h_by)
  Expr turned(const Expr& f, int of, int by) const;
  Expr times(const Expr& a, const Expr& b) const;
  Expr over(const Expr& a, const Expr& b) const;
  Expr d(const Expr& e, int axis) const;

  const Problem& problem_;
  Placements placements_;
  Origin origin_;
};

}  // namespace dpde::model
