// SPDX-License-Identifier: Apache-2.0
// A scene's equations about a frozen point, by other differences or steps than the scene's own.
#pragma once

#include <optional>
#include <string>

#include "driver/session.h"
#include "model/model.h"
#include "stability/linear_step.h"

namespace dpde::stability {

/// The states' perturbations in a step of a problem, lowered anew; not of hand-written programs. Where ways of the flow
/// end on walls it is the step as it is away from these, on rings.
std::optional<LinearStep> linear_step(const model::Problem& problem);
/// Those in the step that was compiled; `why` as of LinearStep::make.
std::optional<LinearStep> linear_step(const driver::Session& session, std::string& why);

/// The problem by one step of Euler's method, without events and steps of their own: u + dt*L u, L being the equations
/// as the scheme's differences have them.
model::Problem by_euler(model::Problem problem);

/// L about the point, 1/time, of such a step. nullopt where it is not finite.
std::optional<Response> generator_of(const LinearStep& euler, const FrozenPoint& point);

/// The point with the values of its fields everywhere about it.
FrozenPoint flat(FrozenPoint point);

/// The sum of the magnitudes of all coefficients.
double magnitude_of(const Response& rows);

}  // namespace dpde::stability
