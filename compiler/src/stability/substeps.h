// SPDX-License-Identifier: Apache-2.0
// Substeps into which a Courant number splits the steps of a scene.
#pragma once

#include "driver/scene/session.h"

namespace dpde::stability {

/// The number of equal substeps into which the Courant number splits the first step.
int parts_of(driver::Session& session);

}  // namespace dpde::stability
