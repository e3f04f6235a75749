// SPDX-License-Identifier: Apache-2.0
// Whether conditions a*u + b*du/dn = c at walls are ones on the scene's grid: with a and b of opposite signs cells may
// be too coarse.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "model/model.h"

namespace dpde::model {

/// In words, as condition-too-coarse has them.
struct WallMisfit {
  std::string condition, reason, hint;
};

using KnownValues = std::map<std::string, std::optional<double>>;

/// Of the condition on `field` at a wall across an axis, for these values of parameters, at all times of the run.
/// Weights that hold others are not looked at.
std::optional<WallMisfit> misfit_of_wall(const Problem& problem, const std::string& field, int axis, const Expr& a,
                                         const Expr& b, KnownValues values);

/// Of the first condition of the scene that has one, among those that hold a parameter that is sought.
std::optional<WallMisfit> misfit_of_walls(const Problem& problem, const KnownValues& values);

}  // namespace dpde::model
