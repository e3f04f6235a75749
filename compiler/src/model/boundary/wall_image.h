// SPDX-License-Identifier: Apache-2.0
// Whether conditions a*u + b*du/dn = c at walls determine ghost cells. With a and b of opposite signs cells may be too
// coarse; with a = b = 0 there is no condition.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::model {

struct WallMisfit {
  bool is_empty = false;  // a and b are 0
  std::string condition;  // first words of empty-condition or condition-too-coarse
  std::string reason;     // why cells are too coarse
  std::string hint;
};
/// Reports it at the position `range`; `when` continues the words of the condition.
void report(const WallMisfit& misfit, const std::string& when, SourceRange range, DiagnosticSink& sink);

/// A condition on `field` at a side across an axis, or at both sides.
struct WeightedSide {
  std::string field;
  int axis = 0;
  std::string side;  // x.low, x
  Expr a = 0.0, b = 0.0;
  SourceRange range;
};

using KnownValues = std::map<std::string, std::optional<double>>;

/// For these parameter values, at all times of the run. Weights with other parameters are not checked. `ghosts`: how
/// many values beyond the side a step reads.
std::optional<WallMisfit> misfit_of_wall(const Problem& problem, const WeightedSide& side, KnownValues values,
                                         int ghosts = 1);

/// A misfit, and the position of its condition.
struct WallMisfitAt {
  WallMisfit misfit;
  SourceRange range;
};
/// How many cells beyond each axis a run reads of a state.
using GhostCounts = std::map<std::string, std::vector<int>>;
enum class Walls { all, with_unknowns };
/// The first misfit of the scene, among all conditions or those with an unknown parameter.
std::optional<WallMisfitAt> misfit_of_walls(const Problem& problem, const KnownValues& values,
                                            const GhostCounts& ghosts, Walls which);

}  // namespace dpde::model
