// SPDX-License-Identifier: Apache-2.0
// Convolutions and their derivatives on planes.
#pragma once

#include "network/plan.h"
#include "network/view.h"

namespace dpde::nn {

/// Copies weights of the network, doubles, to the layout of the kernels.
template <class Real>
void pack(const Product& product, const double* weights, Real* packed);

/// The range of results: cells `first` .. `first + cells - 1` along each axis.
struct Range {
  Axes first{}, cells{};
};

/// Initial value of the sums (bias, and `base` at the same cells) and final activation (-1: none).
template <class Real>
struct Ends {
  const Real* bias = nullptr;
  View<Real> base{};
  int32_t activation = -1;
  Real factor = 0;
};

/// Channel c of the product is written to plane first_plane + c*plane_step of `result`.
template <class Real>
struct Target {
  View<Real> result;
  int64_t first_plane = 0, plane_step = 1;
};

template <class Real>
void convolve(const Team& team, const Product& product, const Real* packed, const View<Real>& source,
              const Target<Real>& target, const Range& range, const Ends<Real>& ends);

/// Adds to `bars`, the adjoints of the network's weights.
template <class Real>
void add_weight_gradient(const Team& team, const Product& forward, const View<Real>& source, const View<Real>& seeds,
                         double* bars);

/// Rearranges a convolution's input into phases, and the transpose.
template <class Real>
void make_phases(const Team& team, const Convolution& convolution, const View<Real>& input, const View<Real>& phases);
template <class Real>
void add_phases_adjoint(const Team& team, const Convolution& convolution, const View<Real>& phases_bar,
                        const View<Real>& input_bar);

}  // namespace dpde::nn
