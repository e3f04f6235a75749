// SPDX-License-Identifier: Apache-2.0
// Equations whose waves grow the faster the shorter they are, without a bound (J. Hadamard): the backward heat equation
// by k^2, a wrong sign of lap(lap(u)) by k^4, equations that are elliptic in time by k. No step and no grid helps: on
// finer cells there are shorter waves, which grow faster. Instabilities of a bounded rate are none of this.
#pragma once

#include <optional>
#include <string>

#include "driver/scene/session.h"

namespace dpde::stability {

struct IllPosed {
  int order = 0;      // growth rises as 1/h^order
  double time = 0;    // in which the shortest wave of the scene's grid grows by a factor of e
  std::string field;  // that grows most
  std::string place;  // where coefficients are frozen; "" where all places are alike
};

/// By the eigenvalues of the equations without a grid at waves far shorter than its cells, frozen at each of the
/// scene's points. nullopt where growth is bounded, or equations cannot be looked at so.
std::optional<IllPosed> ill_posed(driver::Session& session);

/// "growth rises as 1/h^2 ...", for who reads a verdict or asks why a run blew up.
std::string ill_posed_text(const IllPosed& found);
/// What is wrong in most such equations.
std::string ill_posed_help();

}  // namespace dpde::stability
