// SPDX-License-Identifier: Apache-2.0
// The amplification matrix of a linear step: for the wave exp(i k x) with angles a = k h (radians per cell) a step
// multiplies the vector of amplitudes by G(a) (von Neumann's analysis; R. D. Richtmyer and K. W. Morton, Difference
// Methods for Initial-Value Problems, 1967, chapter 4).
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
  /// Whether G is a sum of exponentials of the angles. Means, dealiasing and solves contribute only to some waves.
  bool is_sum_of_exponentials() const { return waves_.empty(); }
  Eigen::MatrixXcd at(const Angles& angles) const;
  /// The representative of all waves with the same eigenvalues: weights may be even along an axis, or equal along two.
  Angles representative(Angles angles) const;
  /// Eigenvalues of G at the representative.
  Eigen::VectorXcd eigenvalues(const Angles& angles) const;
  /// To be called before many waves are evaluated. If the weight matrices of all offsets commute, one change of basis
  /// makes G(a) triangular for every wave. Equal diffusion of all states with any reactions is an example.
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
  /// The part of a form in one component: indices into `offsets_` and coefficients.
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

  /// Offsets that differ in x alone: the phase along y and z is applied once.
  struct Line {
    int y, z;
    std::vector<int> x;
    std::vector<double> weights;  // a matrix per offset, one after the other, each by columns
  };
  int size_;
  int rank_;
  std::vector<Line> lines_;
  std::vector<std::pair<stencil::Offset, Eigen::VectorXcd>>
      diagonals_;                                   // of the weights at each offset, in the common basis
  std::array<int, 3> reach_{};                      // the farthest offset along each axis
  std::array<bool, 3> is_even_{}, is_as_before_{};  // for each axis: even along it; equal to the axis before
  struct Wave {
    std::vector<std::pair<Readings, std::size_t>> terms;  // and the number of the multiplier among `multipliers_`
    Readings divisor;
  };
  std::vector<Wave> waves_;                  // of transforms and solves
  std::vector<WaveMultiplier> multipliers_;  // each once
  std::vector<Readings> rows_;
  std::vector<stencil::Offset> offsets_;  // the offsets that waves and rows read, each once
};

struct Largest {
  Angles angles{};
  double value = 0;
};
/// The largest value of `f` over all waves. Samples a lattice, its diagonals and long waves, and climbs from the best
/// samples until a climb meets a known maximum.
Largest largest_over_waves(int rank, const std::function<double(const Angles&)>& f);

}  // namespace dpde::stability
