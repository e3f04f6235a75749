// SPDX-License-Identifier: Apache-2.0
// What stands in the cells of a scene at times of its run: coefficients, states as the run begins, those that steps set
// as they are then, what networks give, and what is solved for.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "stability/step/coarse_grid.h"
#include "stability/step/linear_step.h"

namespace dpde::stability {

class SceneStates {
 public:
  using Fields = std::map<std::string, std::vector<double>>;
  struct Moment {
    double time;
    Fields set, whole;  // states that steps set, with what networks give, and fields as of whole_fields.h
  };

  SceneStates(driver::Session& session, const LinearStep& linear);

  /// That the step reads, and no step sets; of a control field one interval after the other.
  const Fields& fixed() const { return fixed_; }
  /// One where all are alike, else from the first step to the last.
  const std::vector<Moment>& moments() const { return moments_; }
  const Moment& nearest(double t) const;
  /// Of `whole`; all else is in all cells of the scene.
  const CoarseGrid& grid_of_whole() const { return grid_of_whole_; }

 private:
  CoarseGrid grid_of_whole_;
  Fields fixed_;
  std::vector<Moment> moments_;
};

/// Behind the first step, where `part` of the run is over.
double time_within(const driver::Session& session, double part);

}  // namespace dpde::stability
