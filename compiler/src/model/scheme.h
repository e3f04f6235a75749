// SPDX-License-Identifier: Apache-2.0
// What a scheme block says: how each part of the equations is discretised.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "model/methods.h"
#include "support/vocabulary.h"

namespace dpde::model {

constexpr int spectral = 0;  // in place of an order: by Fourier series
enum class Advection { central, upwind, weno, muscl, semi_lagrangian, maccormack, maccormack_steady };
enum class Limiter { minmod, van_leer, mc };
/// The steepest slope that it takes, in units of the smaller of the rises beside it.
constexpr double steepest_slope(Limiter limiter) { return limiter == Limiter::minmod ? 1 : 2; }
/// Whether it goes back along the flow, and is no difference.
constexpr bool is_semi_lagrangian(Advection advect) { return advect >= Advection::semi_lagrangian; }
/// Whether it steps back as well, and clamps.
constexpr bool is_maccormack(Advection advect) { return advect >= Advection::maccormack; }
/// How advect(v, f) is discretised.
struct Transport {
  Advection advect = Advection::central;
  int order = 2;  // central: 2, 4, 6, 8 or spectral; upwind: 1, 3, 5 or 7; weno: 3 or 5; muscl, maccormack: 2;
                  // semi_lagrangian: 1 or 3 (linear or cubic interpolation)
  Limiter limiter = Limiter::minmod;  // of muscl
  bool operator==(const Transport&) const = default;
};
/// By Fourier series.
constexpr bool is_spectral(const Transport& transport) {
  return transport.advect == Advection::central && transport.order == spectral;
}
/// What solves by steps begin with; automatic: with what is known from before where the method is one by steps.
enum class Guess { automatic, none, last, extrapolate };
inline bool is_asked_for(Guess guess) { return guess == Guess::last || guess == Guess::extrapolate; }
/// How often a step makes constraints true; automatic: as they say, else behind each stage.
enum class Project : unsigned char { automatic, stage, step };
/// Which terms those solve for; all but the linear ones by Newton's method.
enum class Implicit { linear, all_but_advect, all };
/// A step as several, one behind the other, each of a part of the right sides. strang: halves of all but the last, that
/// one, and the halves again in the other order.
struct Split {
  enum class Kind { none, lie, strang };
  /// The terms with an advect; those that implicit schemes solve for; all others.
  enum class Terms { advect, sources, diffusion };
  struct Part {
    Terms terms;
    std::vector<std::string> states = {};  // whose equations it is of; none: of all
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
  std::map<std::string, Transport> transports;  // of states for which the scheme names another one
  int derivative_order = 2;                     // key dx: 2, 4, 6, 8 or spectral
  int laplacian_order = 2;                      // key lap: the same, for second derivatives
  TimeScheme time = time_method("rk4");
  Precision real = Precision::f64;
  Precision networks = Precision::f32;  // what they compute in
  bool dealias = false;                 // states hold no waves of three cells or fewer
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
  /// Whether any advect weighs its differences by the solution: an analysis of waves freezes what they are.
  bool has_weights() const {
    return has_limiter() || any_transport([](Advection advect) { return advect == Advection::weno; });
  }
  /// The steepest of what limits slopes; 0: nothing does.
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

/// The words for them.
const char* name_of(Split::Terms terms);
const char* name_of(Guess guess);
const char* name_of(Project project);
/// The scheme with central differences in the place of what follows the flow.
Scheme with_differences(Scheme scheme);

}  // namespace dpde::model
