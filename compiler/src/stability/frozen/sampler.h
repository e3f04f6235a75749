// SPDX-License-Identifier: Apache-2.0
// Places and times of a scene, frozen: which of its fields the response depends on, and where these are extreme.
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

/// Whether the response is another one where this is: NaN in it makes NaN of it.
bool depends_on(const LinearStep& linear, const FrozenPoint& point, double step,
                const std::function<void(FrozenPoint&)>& spoil);

/// A field that is not known.
FrozenValue unknown_field();

/// The i-th of cells that are spread evenly, also over each axis: steps of the golden ratio, which meet each cell once.
std::size_t spread(std::size_t i, std::size_t cells);

class Sampler {
 public:
  Sampler(driver::Session& session, const LinearStep& linear);

  /// Where what the response depends on is smallest and largest, and some between.
  std::set<std::size_t> cells() const;
  /// Where and when control fields that the response depends on are smallest and largest.
  std::vector<ScenePoint> extremes_of_controls() const;
  /// Along each axis, of each field that is solved for.
  std::set<std::size_t> steepest_cells() const;
  bool varies_in_space() const;
  bool varies_in_time() const;
  /// For the response.
  bool is_alike(const FrozenPoint& a, const FrozenPoint& b) const;
  ScenePoint at(std::size_t cell, double t) const;
  /// Places that differ in what may choose between formulas: a mask is 0 at some and 1 at others.
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
