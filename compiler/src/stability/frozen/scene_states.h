// SPDX-License-Identifier: Apache-2.0
// Field values of a scene at times of its run: coefficients, initial states, states that steps overwrite (at that
// time), outputs of networks, and solutions of solves.
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
    Fields set, whole;  // states that steps overwrite, with outputs of networks; fields of whole_fields.h
  };

  SceneStates(driver::Session& session, const LinearStep& linear);

  /// Fields that the step reads and no step overwrites; a control field has its intervals one after the other.
  const Fields& fixed() const { return fixed_; }
  /// One moment if all are alike, else several from the first step to the last.
  const std::vector<Moment>& moments() const { return moments_; }
  const Moment& nearest(double t) const;
  /// The grid of `whole`; all other fields are on the scene's grid.
  const CoarseGrid& grid_of_whole() const { return grid_of_whole_; }

 private:
  CoarseGrid grid_of_whole_;
  Fields fixed_;
  std::vector<Moment> moments_;
};

/// The time after the first step at which the fraction `part` of the run is over.
double time_within(const driver::Session& session, double part);

}  // namespace dpde::stability
