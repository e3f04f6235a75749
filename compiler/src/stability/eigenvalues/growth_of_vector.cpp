// SPDX-License-Identifier: Apache-2.0
// Follows the growing vector of a step to steps of other lengths. A few steps of noise do not show its growth there;
// the vector does, as it is nearly the same in other steps.
#include <algorithm>
#include <cmath>

#include "stability/eigenvalues/ritz_pairs.h"
#include "stability/step/coupled_means.h"
#include "stability/step/step_search.h"

namespace dpde::stability {

namespace {

constexpr int most_near_vector = 8;

}  // namespace

std::optional<double> CoupledRuns::growth_of_vector(const TangentRuns& runs, double step,
                                                    const Eigen::MatrixXd& vector) const {
  const KrylovSpace space = runs.on_krylov_space(params_of(step / parts_), vector, most_near_vector);
  const std::optional<RitzPair> nearest = nearest_pair(space, vector);
  if (!nearest) return std::nullopt;
  return (std::log(std::abs(nearest->value)) - by_events_) * parts_;
}

/// The growing vector of a step starts the search in the next, shorter one. The growth rate of the equations is assumed
/// equal in all these steps; is_stable() computes it anew.
double CoupledRuns::begins_to_grow(double unstable, double precision) const {
  const int most = most_of_space(grown_);
  if (flow_ || !tells_eigenvalues_ || grown_.size() == 0 || most < fewest_of_space) return 0;
  if (told_.step != unstable) told_ = {unstable, std::max(0.0, growth_by_right(unstable, grown_).value_or(0)), grown_};
  Eigen::MatrixXd vector = told_.vector;
  const auto beyond = [&](double step) {
    const KrylovSpace space = space_of(runs_, step, vector);
    const std::optional<OfSpace> found = growth_in(space, most);
    if (!found || !(found->growth - by_events_ > found->told)) return -least_told;
    if (const std::optional<RitzPair> largest = largest_pair(space, vector)) vector = largest->vector;
    return found->growth - by_events_ - 2 * told_.by_right * step / unstable;
  };
  return least_positive(beyond, unstable, precision);
}

}  // namespace dpde::stability
