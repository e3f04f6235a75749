// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series: d/dx multiplies the wave exp(i k x) by i k. A sum of derivatives with uniform
// coefficients is one multiplier, so that nu*lap(u) - lap(lap(u)) takes one forward and one inverse transform.
#pragma once

#include <functional>
#include <vector>

#include "model/model.h"
#include "stencil/stencil.h"

namespace dpde::stencil {

/// An operand and the symbol that multiplies its waves.
struct WavePart {
  model::Expr operand;
  Expr symbol;
};

/// Translation of derivatives: which of them are multipliers, and the stencil expression of a uniform expression.
struct WaveReading {
  std::function<bool(const model::Expr& derivative)> is_multiplier;  // of a Derivative or an Advect
  std::function<Expr(const model::Expr& uniform)> value;
  bool one_by_one = false;  // each derivative of odd order sets waves of two cells to 0, as if each were a field
};

/// The reading for the derivatives that the scheme computes by Fourier series.
WaveReading waves_of(const model::Scheme& scheme, std::function<Expr(const model::Expr& uniform)> value);

/// Whether `e` is a sum of multipliers of operands, each times a uniform factor.
bool is_of_waves(const model::Expr& e, const WaveReading& reading);
/// The parts of the sum, one per operand. A term without a multiplier is an operand times a uniform factor.
std::vector<WavePart> wave_parts(const model::Expr& e, const WaveReading& reading);

}  // namespace dpde::stencil
