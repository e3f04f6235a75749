// SPDX-License-Identifier: Apache-2.0
// Searches random lines for points where switches change sides (piecewise.cpp) and where a divisor is 0
// (jumps_at_poles.cpp).
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "support/maths/piecewise.h"

namespace dpde {

/// Jumps below this part of the formula's size are ignored as guards, e.g. if(abs(x) > 1e-8, sin(x)/x, 1).
constexpr double smallest_jump = 1e-7;
/// If a value is continuous across a switch, its difference across the switch falls with the distance: even for a tenth
/// root to 0.16 when the distance falls by this factor. Smooth functions hardly change at either distance.
constexpr double most_left_of_continuous = 0.3, distance = 0x1p26;
/// Where a divisor cancels, as in 1 - cos(z)^2, values near its zero are rounding. They are then taken farther away,
/// where rounding is at most this part of the difference of both sides. Over `cancelled_distance` a tenth root changes
/// by 0.74 of its value; 0.6, i.e. most_left_of_continuous for both sides, would count as converged.
constexpr double most_rounding = 0.01, cancelled_distance = 0x1p8;
constexpr int enough = 12;  // tests of a switch or a pole
constexpr int most_tried = 4 * enough;
constexpr int bisections = 100;
/// Number of adjacent numbers s on each side for which base + s*direction rounds to the same value.
constexpr double widest_place = 8;

class JumpSearch {
 public:
  using Id = Piecewise::Id;
  explicit JumpSearch(const Piecewise& formula);
  std::optional<Id> run();
  /// See find_sign.
  std::optional<double> sign();
  /// See touches_zero.
  bool touches_zero();

 private:
  /// Values of all nodes at a point of a line, and the side of each switch.
  struct Look {
    std::vector<double> values, sides;
    double result() const { return values.back(); }
  };
  static double jump_between(const Look& one, const Look& other) { return std::abs(other.result() - one.result()); }
  /// Adjacent points on both sides of a zero.
  struct Place {
    double before, behind;
    double gap() const { return behind - before; }
  };

  /// Interval that may contain a zero of a divisor; `widest`: bound of the gap of its Place.
  struct Bracket {
    double from, to, widest;
    bool crosses;
  };

  void choose_line(bool positive, bool one_moves);
  double start_of(const Piecewise::Symbol& symbol, bool positive);
  double spread() { return std::pow(10.0, exponent_(random_)); }
  Look look(double s) const;
  void evaluate(const Piecewise::Node& node, Id id, double s, Look& look) const;
  std::optional<Id> search_line();
  std::optional<Id> search_between(double from, const Look& at_from, double to, const Look& at_to);
  bool is_open(const Look& one, const Look& other) const;
  bool is_alike(const Look& one, const Look& other) const;
  Place beside_one_place(double before, double behind) const;
  std::optional<Id> judge(double low_side, double high_side);
  static std::vector<Id> operands_of(const Piecewise::Node& node);
  std::vector<bool> needed(const Look& look) const;
  bool is_defined(const Look& look, const std::vector<bool>& needed) const;
  bool is_possible(double s) const;
  bool is_visible(double before, const Look& low, double behind, const Look& high) const;

  bool is_judged(Id id) const { return judged_[id] >= enough || tried_[id] >= most_tried; }
  std::optional<Id> search_poles(const std::vector<double>& at, const std::vector<Look>& looks);
  static std::vector<double> places();
  std::vector<Bracket> brackets(Id pole, const std::vector<double>& at, const std::vector<Look>& looks) const;
  std::optional<Place> zero_in(Id pole, const Bracket& bracket);
  std::vector<Id> parts_of_divisor(Id pole) const;
  double divisor(Id pole, const std::vector<double>& values) const;
  double divisor(Id pole, double s);
  std::optional<Place> crossing(Id pole, double from, double to, double widest);
  std::optional<Place> change_of_a_part(Id pole, double from, double to, double most, double widest);
  double margin(Id id, const std::vector<double>& values) const;
  std::optional<Place> touching(Id pole, double from, double to, double most_left, double widest);
  using Height = std::function<double(double)>;
  std::optional<Place> around_zero(Id pole, const Place& place, double widest, const Height& height);
  std::optional<Place> move_nearer(Id pole, const Place& place, bool crosses);
  bool jumps_at_pole(Id pole, Place place, bool crosses, double widest);
  bool jumps_at_pole(Id pole, const Place& place, double widest) const;
  std::vector<double> rounding(const Look& look) const;
  double rounding_at(Id id, double s) const { return rounding(look(s))[id]; }
  std::optional<Place> beyond_rounding(const Place& place, double widest) const;
  bool may_be_reached(Id pole, const Place& place) const;
  bool may_hide_kink(const Look& look, const std::vector<bool>& needed) const;
  bool is_possible_at_pole(Id pole, double s, bool at_kink) const;
  bool hangs_on_unknown_sign(Id pole) const;
  bool has_kink(const Look& low, const Look& high, const Look& beside, const std::vector<bool>& needed) const;
  bool is_of_the_run(Id pole, const Look& look) const;

  const Piecewise& formula_;
  std::vector<Id> switches_, comparisons_, poles_;  // comparisons: of varying values, in conditions
  std::vector<int> judged_;                         // tests of each switch, pole and comparison
  std::vector<int> tried_;                          // for each pole, candidate points tried
  std::map<Id, std::vector<Id>> divisors_;          // nodes of each pole's divisor
  Look of_divisor_;                                 // sample in which only nodes of a divisor are evaluated
  std::vector<double> hints_;
  std::vector<double> base_, direction_;  // of the symbols, along the line
  bool one_moves_ = false;
  double typical_ = 0;  // typical size of the formula along the line
  std::mt19937_64 random_{20240229};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> part_of_one_, exponent_{-1.5, 1.5};
};

}  // namespace dpde
