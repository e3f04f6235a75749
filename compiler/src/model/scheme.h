// SPDX-License-Identifier: Apache-2.0
// Contents of a scheme block: how each part of the equations is discretised.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "model/methods.h"
#include "support/vocabulary.h"

namespace dpde::model {

constexpr int spectral = 0;  // an order that means Fourier series
enum class Advection { central, upwind, weno, muscl, semi_lagrangian, maccormack, maccormack_steady };
enum class Limiter { minmod, van_leer, mc };
/// The steepest slope that the limiter allows, in units of the smaller of the two neighbouring differences.
constexpr double steepest_slope(Limiter limiter) { return limiter == Limiter::minmod ? 1 : 2; }
/// Whether the method traces characteristics backwards instead of taking differences.
constexpr bool is_semi_lagrangian(Advection advect) { return advect >= Advection::semi_lagrangian; }
/// Whether the method also traces forwards, and clamps the result.
constexpr bool is_maccormack(Advection advect) { return advect >= Advection::maccormack; }
/// How advect(v, f) is discretised.
struct Transport {
  Advection advect = Advection::central;
  int order = 2;  // central: 2, 4, 6, 8 or spectral; upwind: 1, 3, 5 or 7; weno: 3 or 5; muscl, maccormack: 2;
                  // semi_lagrangian: 1 or 3 (linear or cubic interpolation)
  Limiter limiter = Limiter::minmod;  // of muscl
  bool operator==(const Transport&) const = default;
};
/// Whether it uses Fourier series.
constexpr bool is_spectral(const Transport& transport) {
  return transport.advect == Advection::central && transport.order == spectral;
}
/// Initial guess of iterative solves; automatic: the stored solution, if the method is iterative.
enum class Guess { automatic, none, last, extrapolate };
inline bool is_asked_for(Guess guess) { return guess == Guess::last || guess == Guess::extrapolate; }
/// How often a step enforces constraints; automatic: as each constraint says, else after each stage.
enum class Project : unsigned char { automatic, stage, step };
/// Terms that implicit schemes solve for; nonlinear ones by Newton's method.
enum class Implicit { linear, all_but_advect, all };
/// Splitting: a step consists of several consecutive substeps, each for some terms of the right-hand sides. strang:
/// half steps of all parts but the last, a full step of the last, and the half steps again in reverse order.
struct Split {
  enum class Kind { none, lie, strang };
  /// advect: terms with an advect; diffusion: terms that implicit schemes solve for; sources: all others.
  enum class Terms { advect, sources, diffusion };
  struct Part {
    Terms terms;
    std::vector<std::string> states = {};  // states whose equations it covers; empty: all
    bool operator==(const Part&) const = default;

    bool is_of(const std::string& state) const { return states.empty() || has(state); }
    bool has(const std::string& state) const { return std::ranges::find(states, state) != states.end(); }
  };
  Kind kind = Kind::none;
  std::vector<Part> parts = {};
  bool operator==(const Split&) const = default;
};
struct Scheme {
  std::string name = "default";
  Transport transport;                          // key advect
  std::map<std::string, Transport> transports;  // of states with their own line in the scheme
  int derivative_order = 2;                     // key dx: 2, 4, 6, 8 or spectral
  int laplacian_order = 2;                      // key lap: the same, for second derivatives
  TimeScheme time = time_method("rk4");
  Precision real = Precision::f64;
  Precision networks = Precision::f32;  // precision inside networks
  bool dealias = false;                 // removes waves of three cells or shorter from the states
  Project project = Project::automatic;
  Split split = {};
  SolveBy solve = {};
  Guess guess = Guess::automatic;
  Implicit implicit = Implicit::linear;
  bool operator==(const Scheme&) const = default;

  const Transport& transport_of(const std::string& state) const {
    const auto found = transports.find(state);
    return found == transports.end() ? transport : found->second;
  }
  /// Whether any advect does.
  bool is_semi_lagrangian() const { return any_transport(model::is_semi_lagrangian); }
  bool has_clamp() const { return any_transport(is_maccormack); }
  bool has_limiter() const { return steepest_slope() > 0; }
  /// Whether any advect has solution-dependent weights. A wave analysis then freezes these weights.
  bool has_weights() const {
    return has_limiter() || any_transport([](Advection advect) { return advect == Advection::weno; });
  }
  /// The steepest slope that any limiter allows; 0 without limiters.
  double steepest_slope() const {
    double steepest = 0;
    const auto look_at = [&](const Transport& one) {
      if (one.advect == Advection::muscl) steepest = std::max(steepest, model::steepest_slope(one.limiter));
    };
    look_at(transport);
    for (const auto& [state, own] : transports) look_at(own);
    return steepest;
  }
  bool is_split() const { return split.kind != Split::Kind::none; }

 private:
  bool any_transport(bool (*is_so)(Advection)) const {
    bool found = is_so(transport.advect);
    for (const auto& [state, own] : transports) found = found || is_so(own.advect);
    return found;
  }
};

/// Their words in the language.
const char* name_of(Split::Terms terms);
const char* name_of(Guess guess);
const char* name_of(Project project);
/// The scheme with central differences instead of semi-Lagrangian methods.
Scheme with_differences(Scheme scheme);

}  // namespace dpde::model
