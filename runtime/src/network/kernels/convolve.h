// SPDX-License-Identifier: Apache-2.0
// Convolutions and their derivatives on planes in memory.
#pragma once

#include "network/plan.h"
#include "network/view.h"

namespace dpde::nn {

/// Weights of the network, doubles, to where kernels read them.
template <class Real>
void pack(const Product& product, const double* weights, Real* packed);

/// What is added up where: cells `first` .. `first + cells - 1` along each axis.
struct Range {
  Axes first{}, cells{};
};

/// Begin and end of sums: with biases, with values of the cells that are written, with an activation (-1: none).
template <class Real>
struct Ends {
  const Real* bias = nullptr;
  View<Real> base{};
  int32_t activation = -1;
  Real factor = 0;
};

/// Channel c of the product goes to plane first_plane + c*plane_step of `result`.
template <class Real>
struct Target {
  View<Real> result;
  int64_t first_plane = 0, plane_step = 1;
};

template <class Real>
void convolve(const Team& team, const Product& product, const Real* packed, const View<Real>& source,
              const Target<Real>& target, const Range& range, const Ends<Real>& ends);

/// Added to `bars`, those of the network.
template <class Real>
void add_weight_gradient(const Team& team, const Product& forward, const View<Real>& source, const View<Real>& seeds,
                         double* bars);

/// Phases of a convolution from its input, and the transpose.
template <class Real>
void make_phases(const Team& team, const Convolution& convolution, const View<Real>& input, const View<Real>& phases);
template <class Real>
void add_phases_adjoint(const Team& team, const Convolution& convolution, const View<Real>& phases_bar,
                        const View<Real>& input_bar);

}  // namespace dpde::nn
