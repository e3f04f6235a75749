// SPDX-License-Identifier: Apache-2.0
#include "solve/solver/first_guess.h"

#include <algorithm>
#include <cmath>

namespace dpde {

/// min |b - A*G*m| over the multiples m of the guesses G is R*m = Q'*b with A*G = Q*R, by modified Gram-Schmidt; the
/// residual is never larger than for 0 (P. F. Fischer, Comput. Methods Appl. Mech. Eng. 163, 1998, 193). Images that
/// are only rounding after orthogonalisation are dropped.
void FirstGuess::find(const GridOperator& a, std::span<const double> b, std::span<double> guesses,
                      const Rounding& rounding, std::span<double> x, const Team& team) {
  const auto cells = static_cast<Eigen::Index>(x.size()), count = static_cast<Eigen::Index>(guesses.size()) / cells;
  images_.resize(cells, count - 1);
  factor_.setZero(count, count + 1);  // last column: Q'*b
  Eigen::Map<Eigen::MatrixXd> columns(guesses.data(), cells, count);
  Eigen::Map<Eigen::VectorXd> sum(x.data(), cells);
  const Eigen::Map<const Eigen::VectorXd> right(b.data(), cells);
  const auto image = [&](Eigen::Index i) {  // the first is stored in x until that is known
    return Eigen::Map<Eigen::VectorXd>(i == 0 ? x.data() : images_.col(i - 1).data(), cells);
  };
  for (Eigen::Index i = 0; i < count; ++i) {
    const std::span<double> column(columns.col(i).data(), x.size()), of_column(image(i).data(), x.size());
    a.null_space().remove(column, team);  // its image is only rounding
    a.multiply(column, of_column, team);
    const double size = image(i).norm(), by_rounding = rounding.of_image * columns.col(i).norm();
    for (Eigen::Index k = 0; k < i; ++k) {
      factor_(k, i) = image(k).dot(image(i));
      image(i) -= factor_(k, i) * image(k);
    }
    const double left = image(i).norm();
    const bool is_new = std::isfinite(left) && left > std::max(std::sqrt(rounding.of_entries) * size, by_rounding);
    factor_(i, i) = is_new ? left : 0;
    image(i) *= is_new ? 1 / left : 0;
    factor_(i, count) = image(i).dot(right);
  }
  sum.setZero();
  for (Eigen::Index i = count - 1; i >= 0; --i) {
    if (factor_(i, i) == 0) continue;
    const double multiple = factor_(i, count) / factor_(i, i);
    if (!std::isfinite(multiple)) return sum.setZero(), void();
    sum += multiple * columns.col(i);
    factor_.col(count).head(i) -= multiple * factor_.col(i).head(i);
  }
}

}  // namespace dpde
