// SPDX-License-Identifier: Apache-2.0
// Ill-posed equations: the growth rate of waves rises without bound with the wave number k (J. Hadamard). It rises as
// k^2 for the backward heat equation, k^4 for lap(lap(u)) with a wrong sign, k for equations that are elliptic in time.
// No step and no grid helps: finer cells have shorter waves, which grow faster. Instabilities with a bounded growth
// rate are not ill-posed.
#pragma once

#include <optional>
#include <string>

#include "driver/scene/session.h"

namespace dpde::stability {

struct IllPosed {
  int order = 0;      // growth rises as 1/h^order
  double time = 0;    // e-folding time of the shortest wave of the scene's grid
  std::string field;  // the field that grows most
  std::string place;  // the point at which coefficients are frozen; "": all points are alike
};

/// Tests the eigenvalues of the equations' symbol, frozen at each of the scene's points, for waves far shorter than the
/// cells. nullopt if growth is bounded, or there is no symbol.
std::optional<IllPosed> ill_posed(driver::Session& session);

/// "growth rises as 1/h^2 ...", for verdicts and advice after a blow-up.
std::string ill_posed_text(const IllPosed& found);
/// The most frequent error in such equations.
std::string ill_posed_help();

}  // namespace dpde::stability
