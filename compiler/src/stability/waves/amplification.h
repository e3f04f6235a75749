// SPDX-License-Identifier: Apache-2.0
// What a linear step makes of the waves exp(i k x): with the angles a = k h (radians a cell) the vector of amplitudes
// is multiplied by the matrix G(a) (von Neumann's analysis; R. D. Richtmyer and K. W. Morton, Difference Methods for
// Initial-Value Problems, 1967, chapter 4).
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "stability/step/linear_step.h"

namespace dpde::stability {

using Angles = std::array<double, 3>;

class Amplification {
 public:
  Amplification(const LinearisedStep& response, int rank);

  int size() const { return size_; }
  /// Of the angles. Else some of it is there only for some waves: means, what is dealiased, what is solved for.
  bool is_sum_of_exponentials() const { return waves_.empty(); }
  Eigen::MatrixXcd at(const Angles& angles) const;
  /// The wave that stands for all that have its matrix: weights may be even along an axis, or the same along two.
  Angles representative(Angles angles) const;
  /// Eigenvalues of that.
  Eigen::VectorXcd eigenvalues(const Angles& angles) const;
  /// Before many waves are looked at: what all of them have in common is then done once. Where the weights of all
  /// places commute, as those of equal diffusion of all states with any reactions between them do, one change of basis
  /// makes G(a) triangular for every wave.
  void expect_many_waves();
  bool has_common_basis() const { return !diagonals_.empty(); }
  double spectral_radius(const Angles& angles) const { return eigenvalues(angles).cwiseAbs().maxCoeff(); }

 private:
  using Phases = std::array<std::vector<std::complex<double>>, 3>;  // of each offset along each axis
  void note_reach(const LinearForm& form);
  using Places = std::map<stencil::Offset, std::vector<double>>;  // weights by columns
  void note_symmetries(const Places& places);
  Phases phases_of(const Angles& angles) const;
  Eigen::MatrixXcd of_mean() const;
  std::complex<double> phase(const Phases& phases, const stencil::Offset& offset) const;
  /// What a form reads of one component: coefficients by the numbers of their offsets among `offsets_`.
  struct ComponentRow {
    int component;
    std::vector<std::pair<std::size_t, double>> weights;
    std::complex<double> at(const std::vector<std::complex<double>>& phases) const;
  };
  using Readings = std::vector<ComponentRow>;
  Readings readings_of(const LinearForm& form);
  std::size_t number_of(const WaveMultiplier& by);
  struct Amplitudes;
  Eigen::MatrixXcd with_waves(const Angles& angles) const;

  /// Places that differ in x alone: what they have in common is multiplied once.
  struct Line {
    int y, z;
    std::vector<int> x;
    std::vector<double> weights;  // of one place behind the other, each by columns
  };
  int size_;
  int rank_;
  std::vector<Line> lines_;
  std::vector<std::pair<stencil::Offset, Eigen::VectorXcd>> diagonals_;  // of the weights of each place, in that basis
  std::array<int, 3> reach_{};                                           // the farthest offset along each axis
  std::array<bool, 3> is_even_{}, is_as_before_{};                       // along each axis; as along the axis before it
  struct Wave {
    std::vector<std::pair<Readings, std::size_t>> terms;  // and the number of the multiplier among `multipliers_`
    Readings divisor;
  };
  std::vector<Wave> waves_;                  // where transforms or solves make some
  std::vector<WaveMultiplier> multipliers_;  // each once
  std::vector<Readings> rows_;
  std::vector<stencil::Offset> offsets_;  // that waves and rows read, each once
};

struct Largest {
  Angles angles{};
  double value = 0;
};
/// The largest value of `f` over all waves: from the best ones of a lattice, of its diagonals and of long waves uphill,
/// until they come to a top that is known.
Largest largest_over_waves(int rank, const std::function<double(const Angles&)>& f);

}  // namespace dpde::stability
