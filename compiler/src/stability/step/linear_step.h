// SPDX-License-Identifier: Apache-2.0
// The tangent of a step with coefficients as they are at one point, those made of differences of fields too: the
// perturbation of a state behind the step is a sum of perturbations before it at displaced points. Walls are not seen.
// It is found by running the tangent's statements once, with sums of displaced perturbations in place of numbers.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "adjoint/adjoint.h"
#include "stability/state_groups.h"
#include "stability/waves/wave_sum.h"
#include "stencil/stencil.h"

namespace dpde::stability {

class FrozenKernels;

/// A field about the point: its value there, and by how much it changes from cell to cell along each axis.
struct FrozenValue {
  double value = 0;
  std::array<double, 3> slope{};
  FrozenValue() = default;
  FrozenValue(double number) : value(number) {}  // NOLINT: a number is the same everywhere
  bool operator==(const FrozenValue&) const = default;
};

/// What an analysis takes as it is: fields by name, numbers by name (spacings too, not dt), the place for coordinates.
struct FrozenPoint {
  std::map<std::string, FrozenValue> fields;
  std::map<std::string, FrozenValue> whole = {};  // what depends on all places: see whole_fields.h
  std::map<std::string, double> params;
  std::array<double, 3> place{};
  std::array<double, 3> cells{1, 1, 1};  // of the grid
  std::array<double, 3> longest_wave{};  // in cells: rings once, between walls twice; 0: the grid is not known
};

/// One row a state, in the order of LinearStep::states(). Component most_states + i is waves[i], made of those before.
struct LinearisedStep {
  std::vector<LinearForm> rows;
  std::vector<WaveSum> waves = {};
  double displacement = 0;  // in cells, of the farthest interpolation
};

/// What stages of the states are at a point, in the order in which kernels make them; nothing of a kernel whose values
/// depend on the step. Empty before the first response, which fills it.
using FrozenStages = std::vector<std::optional<std::vector<FrozenValue>>>;

class LinearStep {
 public:
  /// `step` swaps the states. What cannot be analysed (scatters) leaves `why` and no value.
  /// `of_constraints`: what the program solves for is 0 at a state that is not perturbed, where the operator takes
  /// constants to 0. Of the states of `group` alone: others are not perturbed, and their rows are left out.
  static std::optional<LinearStep> make(const stencil::Module& module, const std::string& step, std::string& why,
                                        bool of_constraints = false, const StateGroup& group = {});

  const std::vector<std::string>& states() const { return states_; }
  StateGroup group() const { return {states_.begin(), states_.end()}; }
  /// Of a step of size dt from this point. nullopt where offsets are too far or a value is not finite.
  std::optional<LinearisedStep> response(const FrozenPoint& point, double dt) const;
  /// The same, with what former responses at this point have found.
  std::optional<LinearisedStep> response(const FrozenPoint& point, double dt, FrozenStages& stages) const;
  /// Fields that the tangent reads beside perturbations: states, coefficients, coordinates, what networks give.
  const std::vector<std::string>& inputs() const { return inputs_; }
  /// Those of them that networks give, see known_networks.h.
  const std::set<std::string>& known_networks() const { return known_networks_; }
  /// What is another field as the states change.
  bool depends_on_states(const std::string& field) const { return varied_.contains(field); }
  const stencil::Module& module() const { return module_; }
  const stencil::Program& program() const { return module_.programs.front(); }
  const std::string& perturbation_of(std::size_t state) const { return perturbations_[state]; }
  const std::string& result_of(std::size_t state) const { return results_[state]; }
  bool is_perturbation(const std::string& field) const { return rates_.contains(field); }
  /// With means of perturbations that count by other fields, which the module has not: see coupled_means.h.
  const stencil::Module& coupled_module() const { return coupled_ ? *coupled_ : module_; }
  bool couples_means() const { return coupled_.has_value(); }
  /// The same with all means of perturbations among these.
  LinearStep with_all_coupled() const;
  /// It follows the flow, or reduces over space: the response is not a polynomial of dt, or sees no means.
  bool is_semi_lagrangian() const { return follows_flow_; }
  bool reduces() const { return reduces_; }
  /// It solves equations: the response of one point reaches all others.
  bool solves() const { return solves_; }
  /// By its text a rational function of dt, where all `stages` of a response are known: see frozen_kernels.h.
  bool is_rational_in_step(const FrozenStages& stages) const;
  /// A network reads what is perturbed: the program can be run, and has no response.
  bool has_networks() const { return has_networks_; }

 private:
  void find_inputs(const std::set<std::string>& of_networks);

  stencil::Module module_;                        // the tangent alone, without what only the primal's results need
  std::shared_ptr<const FrozenKernels> kernels_;  // of it
  std::optional<stencil::Module> coupled_;
  std::vector<std::string> states_, perturbations_, results_, inputs_;
  std::set<std::string> known_networks_;
  std::set<std::string> varied_, rates_;  // fields that depend on the states, and their perturbations
  bool follows_flow_ = false, reduces_ = false, solves_ = false, has_networks_ = false, of_constraints_ = false;
};

}  // namespace dpde::stability
