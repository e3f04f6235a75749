// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/ring_spectrum.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "stability/eigenvalues/eigenvalues.h"

namespace dpde::stability {

namespace {

constexpr double rounding_of_ring =
    1e-13;  // allowed difference between cells of a ring, relative to the largest entry of a pair of states

/// The layout of the cells of a ring in a vector.
struct Ring {
  Eigen::Index length, stride, cells, others;
  /// The i-th cell of the ring that `other` is on, of all states and lines.
  Eigen::Index place(Eigen::Index other, Eigen::Index i) const {
    return other / stride * stride * length + other % stride + i * stride;
  }
};

/// Whether entries between cells of two lines depend on their distance alone.
bool is_same_from_each(const Eigen::MatrixXd& step, const Ring& ring, Eigen::Index row, Eigen::Index column) {
  const Eigen::Index first_row = ring.place(row, 0), first_column = ring.place(column, 0), n = ring.cells;
  const double largest = step.block(first_row / n * n, first_column / n * n, n, n).cwiseAbs().maxCoeff();
  for (Eigen::Index d = 0; d < ring.length; ++d) {
    for (Eigen::Index i = 1; i < ring.length; ++i) {
      const double other = step(ring.place(row, (i + d) % ring.length), ring.place(column, i));
      if (!(std::abs(other - step(ring.place(row, d), first_column)) <= rounding_of_ring * largest)) return false;
    }
  }
  return true;
}

/// The block of `step` for each distance between two cells of the ring.
std::optional<std::vector<Eigen::MatrixXd>> by_distance(const Eigen::MatrixXd& step, const Ring& ring) {
  std::vector<Eigen::MatrixXd> parts(static_cast<std::size_t>(ring.length), Eigen::MatrixXd(ring.others, ring.others));
  for (Eigen::Index column = 0; column < ring.others; ++column) {
    for (Eigen::Index row = 0; row < ring.others; ++row) {
      if (!is_same_from_each(step, ring, row, column)) return std::nullopt;
      for (Eigen::Index d = 0; d < ring.length; ++d)
        parts[static_cast<std::size_t>(d)](row, column) = step(ring.place(row, d), ring.place(column, 0));
    }
  }
  return parts;
}

}  // namespace

std::optional<Eigen::VectorXcd> eigenvalues_on_ring(const Eigen::MatrixXd& step, const std::array<int, 3>& cells,
                                                    std::size_t axis) {
  const Eigen::Index count = static_cast<Eigen::Index>(cells[0]) * cells[1] * cells[2];
  Ring ring{cells[axis], 1, count, step.rows() / cells[axis]};
  for (std::size_t a = 0; a < axis; ++a) ring.stride *= cells[a];
  const auto parts = by_distance(step, ring);
  if (!parts) return std::nullopt;
  Eigen::VectorXcd result(step.rows());
  Eigen::Index known = 0;
  for (Eigen::Index k = 0; 2 * k <= ring.length; ++k) {
    Eigen::MatrixXcd wave = Eigen::MatrixXcd::Zero(ring.others, ring.others);
    for (Eigen::Index d = 0; d < ring.length; ++d) {
      const double angle = -2 * std::numbers::pi * static_cast<double>(k * d) / static_cast<double>(ring.length);
      wave += std::polar(1.0, angle) * (*parts)[static_cast<std::size_t>(d)];
    }
    const bool is_own_opposite = k == 0 || 2 * k == ring.length;
    const Eigen::VectorXcd values =
        is_own_opposite ? eigenvalues(Eigen::MatrixXd(wave.real())) : eigenvalues(Eigen::MatrixXcd(wave));
    result.segment(known, ring.others) = values;
    known += ring.others;
    if (is_own_opposite) continue;
    result.segment(known, ring.others) = values.conjugate();
    known += ring.others;
  }
  return result;
}

}  // namespace dpde::stability
