// SPDX-License-Identifier: Apache-2.0
// The tangent of a step with all coefficients frozen at one point, also those made of differences of fields. The
// perturbation of a state after the step is a linear form of the perturbations before it at displaced points. Walls are
// not represented. The form is found by executing the tangent's statements once with linear forms in place of numbers.
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

/// A field about the point: its value there, and its slope per cell along each axis.
struct FrozenValue {
  double value = 0;
  std::array<double, 3> slope{};
  FrozenValue() = default;
  FrozenValue(double number) : value(number) {}  // NOLINT: a number is the same everywhere
  bool operator==(const FrozenValue&) const = default;
};

/// The frozen quantities: fields by name, parameters by name (with spacings, without dt), and the coordinates.
struct FrozenPoint {
  std::map<std::string, FrozenValue> fields;
  std::map<std::string, FrozenValue> whole = {};  // solutions and means: see whole_fields.h
  std::map<std::string, double> params;
  std::array<double, 3> place{};
  bool are_coordinates_flat = false;     // they are those of `place` in all cells
  std::array<double, 3> cells{1, 1, 1};  // of the grid
  std::array<double, 3> longest_wave{};  // in cells: the length of a ring, twice that between walls; 0: not known
};

/// One row per state, in the order of LinearStep::states(). Component most_states + i is waves[i], which depends on
/// earlier waves only.
struct LinearisedStep {
  std::vector<LinearForm> rows;
  std::vector<WaveSum> waves = {};
  double displacement = 0;  // in cells, the largest of all interpolations
};

/// Values of the states' stages at a point, in the order of the kernels that compute them; nullopt for a kernel whose
/// values depend on dt. Empty before the first response, which fills it.
using FrozenStages = std::vector<std::optional<std::vector<FrozenValue>>>;

class LinearStep {
 public:
  /// `step` is the program that swaps the states. Returns nullopt and sets `why` if it cannot be analysed (scatters).
  /// `of_constraints`: if a solve's operator takes constants to 0, its solution at the unperturbed state is 0. Only the
  /// states of `group` are perturbed and have rows.
  static std::optional<LinearStep> make(const stencil::Module& module, const std::string& step, std::string& why,
                                        bool of_constraints = false, const StateGroup& group = {});

  const std::vector<std::string>& states() const { return states_; }
  StateGroup group() const { return {states_.begin(), states_.end()}; }
  /// The linearised step of length dt at this point; nullopt if an offset is too far or a value is not finite.
  std::optional<LinearisedStep> response(const FrozenPoint& point, double dt) const;
  /// The same, with stages cached from former responses at this point.
  std::optional<LinearisedStep> response(const FrozenPoint& point, double dt, FrozenStages& stages) const;
  /// Fields that the tangent reads besides perturbations: states, coefficients, coordinates, outputs of networks.
  const std::vector<std::string>& inputs() const { return inputs_; }
  /// The inputs that are outputs of networks, see known_networks.h.
  const std::set<std::string>& known_networks() const { return known_networks_; }
  /// Whether the field depends on the states.
  bool depends_on_states(const std::string& field) const { return varied_.contains(field); }
  const stencil::Module& module() const { return module_; }
  const stencil::Program& program() const { return module_.programs.front(); }
  const std::string& perturbation_of(std::size_t state) const { return perturbations_[state]; }
  const std::string& result_of(std::size_t state) const { return results_[state]; }
  bool is_perturbation(const std::string& field) const { return rates_.contains(field); }
  /// The module with the weighted means of perturbations, which module() lacks: see coupled_means.h.
  const stencil::Module& coupled_module() const { return coupled_ ? *coupled_ : module_; }
  bool couples_means() const { return coupled_.has_value(); }
  /// The same step, with all means of perturbations only in coupled_module().
  LinearStep with_all_coupled() const;
  /// Semi-Lagrangian: the response is no polynomial of dt. Reductions over space: not all means are in the response.
  bool is_semi_lagrangian() const { return follows_flow_; }
  bool reduces() const { return reduces_; }
  /// Whether it solves equations: a perturbation at one point then affects all others.
  bool solves() const { return solves_; }
  /// Whether the response is a rational function of dt by its formulas and all `stages` are known: frozen_kernels.h.
  bool is_rational_in_step(const FrozenStages& stages) const;
  /// Whether a network reads perturbed fields: the program can be run, but has no response.
  bool has_networks() const { return has_networks_; }

 private:
  void find_inputs(const std::set<std::string>& of_networks);

  stencil::Module module_;                        // the tangent, without statements that only the primal's results need
  std::shared_ptr<const FrozenKernels> kernels_;  // of it
  std::optional<stencil::Module> coupled_;
  std::vector<std::string> states_, perturbations_, results_, inputs_;
  std::set<std::string> known_networks_;
  std::set<std::string> varied_, rates_;  // fields that depend on the states, and their perturbations
  bool follows_flow_ = false, reduces_ = false, solves_ = false, has_networks_ = false, of_constraints_ = false;
};

}  // namespace dpde::stability
