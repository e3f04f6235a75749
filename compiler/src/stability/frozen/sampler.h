// SPDX-License-Identifier: Apache-2.0
// Samples points and times of a scene: the fields that the response depends on, and the points where they are extreme.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "stability/frozen/frozen_points.h"
#include "stability/frozen/scene_states.h"

namespace dpde::stability {

/// Whether the response depends on the quantity that `spoil` sets to NaN: the response is then NaN.
bool depends_on(const LinearStep& linear, const FrozenPoint& point, double step,
                const std::function<void(FrozenPoint&)>& spoil);

/// NaN, for a field that is not known.
FrozenValue unknown_field();

/// The i-th cell of a sequence that is spread evenly, also over each axis, by steps of the golden ratio. It visits each
/// cell once.
std::size_t spread(std::size_t i, std::size_t cells);

class Sampler {
 public:
  Sampler(driver::Session& session, const LinearStep& linear);

  /// The cells where fields of the response are smallest and largest, and some between.
  std::set<std::size_t> cells() const;
  /// The points and times where control fields of the response are smallest and largest.
  std::vector<ScenePoint> extremes_of_controls() const;
  /// For each solution of a solve, the cell where it is steepest along each axis.
  std::set<std::size_t> steepest_cells() const;
  bool varies_in_space() const;
  bool varies_in_time() const;
  /// Whether both points have the same response.
  bool is_alike(const FrozenPoint& a, const FrozenPoint& b) const;
  ScenePoint at(std::size_t cell, double t) const;
  /// Points that differ in fields that may select between formulas, as a mask of 0 and 1.
  const std::vector<ScenePoint>& different_points() const { return different_; }

 private:
  using Fields = SceneStates::Fields;
  template <class Tell>
  void for_each_field(const Tell& tell) const;
  void find_dependences(const LinearStep& linear);
  void add_dependences(const LinearStep& linear, const FrozenPoint& point, double step);
  void add_extremes(std::span<const double> values, bool is_whole, std::set<std::size_t>& cells) const;
  std::span<const double> now(const std::string& name, std::span<const double> values, double t) const;
  bool is_clamped(const std::string& name) const;
  using Place = CoarseGrid::Place;
  FrozenValue about(std::span<const double> values, std::size_t cell) const;
  FrozenValue about_whole(std::span<const double> values, std::size_t cell) const;
  template <class Value>
  FrozenValue about_place(const Value& value, std::size_t cell, double (*slope)(double up, double down)) const;
  Place place_of(std::size_t cell) const;
  void add_along_axes(std::set<std::size_t>& cells) const;

  driver::Session& session_;
  SceneStates states_;
  std::map<std::string, int> intervals_;  // of control fields, in steps
  std::vector<ScenePoint> different_;
  std::set<std::string> varied_, varied_whole_;  // fields that the response depends on somewhere
  bool reads_places_ = false;
  bool follows_flow_;
};

}  // namespace dpde::stability
