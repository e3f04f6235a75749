// SPDX-License-Identifier: Apache-2.0
// Whether conditions a*u + b*du/dn = c at walls are ones: with a and b of opposite signs cells may be too coarse, and
// where both are 0 nothing is said.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

struct WallMisfit {
  bool is_empty = false;  // a and b are 0
  std::string condition;  // what is none, and when: the first words of empty-condition or of condition-too-coarse
  std::string reason;     // why cells are too coarse
  std::string hint;
};
/// At the place; `when` goes on behind the condition.
void report(const WallMisfit& misfit, const std::string& when, SourceRange range, DiagnosticSink& sink);

/// A condition on `field` at a side across an axis, or at both.
struct WeightedSide {
  std::string field;
  int axis = 0;
  std::string side;  // x.low, x
  Expr a = 0.0, b = 0.0;
  SourceRange range;
};

using KnownValues = std::map<std::string, std::optional<double>>;

/// For these values of parameters, at all times of the run. Weights that hold others are not looked at.
std::optional<WallMisfit> misfit_of_wall(const Problem& problem, const WeightedSide& side, KnownValues values);

/// A misfit, and where its condition is written.
struct WallMisfitAt {
  WallMisfit misfit;
  SourceRange range;
};
/// Of the first condition of the scene that has one, among those that hold a parameter that is sought.
std::optional<WallMisfitAt> misfit_of_walls(const Problem& problem, const KnownValues& values);

}  // namespace dpde::model
