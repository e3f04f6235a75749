// SPDX-License-Identifier: Apache-2.0
// Random expressions of the model level. Each has a given placement and uses quantities with values there, so that few
// are refused. Values stay of order one.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "random/text_tree.h"
#include "support/split_mix.h"

namespace dpde::testing {

/// For each axis: whether the value lies half a cell above the centre.
using Place = std::array<bool, 3>;
inline constexpr Place centre{};

/// A field, coefficient, control field or let, or a vector of them.
struct Quantity {
  enum class On { one_place, faces };  // the components of a vector; a number has one place
  std::string name;
  bool is_vector = false;
  On on = On::one_place;
  Place place = centre;   // of a number, or of all components
  bool is_rated = false;  // has an equation
  bool is_given = false;  // a coefficient or control field: between walls it has no derivative where it is staggered
};

Place place_of(const Quantity& quantity, int axis);

struct Axis {
  std::string name;
  bool is_periodic = false;
  bool is_stretched = false;
};

/// The names that expressions may use.
struct Names {
  std::vector<Axis> axes;
  std::vector<Quantity> quantities;
  std::vector<std::string> numbers;    // params and controls
  std::vector<std::string> functions;  // of two numbers
  std::vector<std::string> operators;  // of one field
  bool reductions = false, derivatives = true, time = true;
};

class ModelExpressions {
 public:
  ModelExpressions(SplitMix& random, const Names& names) : random_(random), names_(names) {}

  Part number(double low, double high);
  /// The same at all cells.
  Part uniform();
  Part scalar(const Place& place, int depth);
  /// An operand of a derivative or interpolation.
  Part differentiable(const Place& place, int depth);
  Part vector(const Quantity& like, int depth);
  /// An expression of coordinates and numbers only.
  Part formula();
  /// An advection velocity: a number, a vector or a tuple.
  Part velocity();
  /// A right-hand side for the scalar `self` at a placement.
  Part term(const Part& self, const Place& place);
  Part vector_term(const Quantity& self);
  Part derivative(const Place& place, int depth);
  Part reduction(const Place& place, int depth);

 private:
  Part leaf(const Place& place);
  Part function(const Place& place, int depth);
  Part interpolated(const Place& place, int depth);
  Part tuple_at(const Quantity& like, int depth);
  std::vector<Part> components_at(const Place& place);
  std::vector<const Quantity*> vectors();
  Place any_place();
  Place toggled(Place place, int axis) const { return place[axis] = !place[axis], place; }
  bool may_be_read(const Quantity& quantity, int axis) const;
  int rank() const { return static_cast<int>(names_.axes.size()); }
  const std::string& axis_name(int axis) const { return names_.axes[static_cast<std::size_t>(axis)].name; }
  template <class T>
  const T& any(const std::vector<T>& list) {
    return list[static_cast<std::size_t>(random_.below(static_cast<int>(list.size())))];
  }

  SplitMix& random_;
  const Names& names_;
  int derived_ = 0;  // nesting depth in operators that read neighbours
};

}  // namespace dpde::testing
