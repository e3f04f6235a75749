// SPDX-License-Identifier: Apache-2.0
// Derivatives by Fourier series: d/dx multiplies the wave exp(i k x) by i k. A sum of derivatives with coefficients
// that are the same everywhere is one multiplier, so that nu*lap(u) - lap(lap(u)) is one transform there and back.
#pragma once

#include <functional>
#include <vector>

#include "model/model.h"
#include "stencil/stencil.h"

namespace dpde::stencil {

/// What of a model expression is multiplied by which symbol.
struct WavePart {
  model::Expr operand;
  Expr symbol;
};

/// How derivatives are read: which of them are multipliers, and what a uniform expression is at this level.
struct WaveReading {
  std::function<bool(const model::Expr& derivative)> is_multiplier;  // of a Derivative or an Advect
  std::function<Expr(const model::Expr& uniform)> value;
  bool one_by_one = false;  // derivatives of odd orders make 0 of waves of two cells, as where each is a field
};

/// Those that the scheme takes by Fourier series.
WaveReading waves_of(const model::Scheme& scheme, std::function<Expr(const model::Expr& uniform)> value);

/// Whether `e` is a sum of multipliers of something, each times what is uniform.
bool is_of_waves(const model::Expr& e, const WaveReading& reading);
/// Its parts, operands once each. What is no multiplier is an operand, times what is uniform.
std::vector<WavePart> wave_parts(const model::Expr& e, const WaveReading& reading);

}  // namespace dpde::stencil
