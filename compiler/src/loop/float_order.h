// SPDX-License-Identifier: Apache-2.0
// Whether products can be computed in single precision as they stand. Nobody knows how large fields are; here all have
// one size, M, and so have numbers that are far from 1: what a formula divides or is scaled by. Derivatives are of the
// size of 1/M. A part of a product of the size of M^2 need not be a float where M is one.
#pragma once

#include <functional>
#include <optional>

#include "stencil/stencil.h"

namespace dpde::loop {

/// The size of an expression: M^power.
struct FloatSize {
  std::optional<double> value = {};  // where it is the same in all cells
  double power = 0;                  // else
  bool stays = true;                 // no part of it is beyond M, or 1/M
};
/// Of a parameter or a local.
using SizeOfLeaf = std::function<FloatSize(const stencil::Expr&)>;

FloatSize float_size(const stencil::Expr& e, const SizeOfLeaf& leaf);

}  // namespace dpde::loop
