// SPDX-License-Identifier: Apache-2.0
// One recursion over the model expression, with the point of evaluation in half cells.
#include "stencil/space/discretise.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "model/build.h"
#include "stencil/build.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

bool is_odd(int half_cells) { return half_cells % 2 != 0; }
int cell_below(int half_cells) { return (half_cells - (is_odd(half_cells) ? 1 : 0)) / 2; }

bool is_field(const model::Expr& e) { return as<model::Field>(e) != nullptr; }

/// Whether `e` reads a field at its placement; interpolated values can be read anywhere.
bool reads_in_place(const model::Expr& e) {
  if (as<model::Interpolate>(e)) return false;
  if (const model::Reduce* reduce = as<model::Reduce>(e)) return !reduce->is_over_all();
  if (as<model::NetworkCall>(e) || as<model::Solve>(e)) return true;
  return is_field(e) || any_child(e, [&](const model::Expr& part) { return reads_in_place(part); });
}

model::Placement parity(const std::array<int, max_rank>& place) {
  model::Placement placement{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) placement[axis] = is_odd(place[axis]);
  return placement;
}

bool holds_derivative(const model::Expr& e) {
  if (as<model::NetworkCall>(e) || as<model::Solve>(e) || as<model::BandPass>(e))
    return false;  // these become separate fields
  return as<model::Derivative>(e) || as<model::Advect>(e) ||
         any_child(e, [&](const model::Expr& part) { return holds_derivative(part); });
}

Reduction reduction_of(model::Reduce::Kind kind) {
  switch (kind) {
    case model::Reduce::Kind::mean: return Reduction::mean;
    case model::Reduce::Kind::sum:
    case model::Reduce::Kind::integral: return Reduction::sum;
    case model::Reduce::Kind::max: return Reduction::max;
    case model::Reduce::Kind::min: return Reduction::min;
  }
  unreachable("reduction");
}

/// Sum of weight * value. Four and more values are paired by distance, 8*(u[+1] - u[-1]) - (u[+2] - u[-2]), so that the
/// sum is exactly 0 for a constant.
Expr weighted_sum(const std::vector<Tap>& taps, const std::vector<Expr>& values) {
  const std::size_t count = taps.size();
  bool paired = count >= 4;
  for (std::size_t i = 0; i < count; ++i) {
    const Tap& other = taps[count - 1 - i];
    paired = paired && other.place == -taps[i].place && std::abs(other.weight) == std::abs(taps[i].weight);
  }
  Expr sum = 0.0;
  const auto add = [&](std::int64_t weight, const Expr& value) {
    sum = sum + scaled(static_cast<double>(weight), value);
  };
  if (!paired) {
    for (std::size_t i = 0; i < count; ++i) add(taps[i].weight, values[i]);
    return sum;
  }
  for (const bool positive : {true, false}) {
    for (std::size_t i = count / 2; i-- > 0;) {  // from the nearest pair outwards
      const std::size_t j = count - 1 - i;
      if ((taps[j].weight > 0) != positive) continue;
      add(taps[j].weight, taps[i].weight == taps[j].weight ? values[i] + values[j] : values[j] - values[i]);
    }
  }
  if (count % 2 != 0) add(taps[count / 2].weight, values[count / 2]);
  return sum;
}

/// Whether `e` midway between cells is computed from its parts there instead of averaged as a whole. True for sums, for
/// products with a factor that is known there, for derivatives (more accurate there) and for formulas (exact).
bool has_parts_midway(const model::Expr& e) {
  if (as<model::Apply>(e) || as<model::NetworkCall>(e) || as<model::Solve>(e)) return false;
  if (holds_derivative(e) || !reads_in_place(e)) return true;
  if (as<model::Neg>(e)) return true;
  const model::Binary* b = as<model::Binary>(e);
  if (!b) return false;
  if (b->op == BinaryOp::add || b->op == BinaryOp::subtract) return true;
  if (b->op == BinaryOp::multiply) return !reads_in_place(b->left) || !reads_in_place(b->right);
  return b->op == BinaryOp::divide && !reads_in_place(b->right);
}

bool is_leaf(const Expr& e) {
  if (const Neg* neg = as<Neg>(e)) return is_leaf(neg->operand);
  return is<Literal, Param, Local, Access>(e);
}

}  // namespace

std::string axis_letter(int axis) { return std::string(1, "xyz"[axis]); }
Expr spacing(int axis) { return param(std::string("h").append(axis_letter(axis))); }

Expr scaled(const Expr& factor, const Expr& product) {
  if (const Neg* neg = as<Neg>(product)) return -scaled(factor, neg->operand);
  const Binary* b = as<Binary>(product);
  const bool is_product = b && (b->op == BinaryOp::multiply || b->op == BinaryOp::divide);
  if (!is_product || is<Literal>(b->left)) return factor * product;
  return binary(b->op, scaled(factor, b->left), b->right);
}

Environment::Environment() : time(param("t")) {}

Discretiser::Discretiser(const model::Scheme& scheme, NameSupply names, int rank, Environment reading,
                         model::Placements placements)
    : scheme_(scheme),
      names_(std::move(names)),
      rank_(rank),
      reading_(std::move(reading)),
      placements_(std::move(placements)) {
  if (placements_.is_staggered()) base_.reset();
  require(!scheme_.is_semi_lagrangian(), "advection along the flow is no difference");
}

/// Sets the base placement during its lifetime.
class Discretiser::Within {
 public:
  Within(Discretiser& of, std::optional<model::Placement> base) : of_(of), before_(std::exchange(of.base_, base)) {}
  ~Within() { of_.base_ = before_; }
  Within(const Within&) = delete;
  Within& operator=(const Within&) = delete;

 private:
  Discretiser& of_;
  std::optional<model::Placement> before_;
};

Expr Discretiser::operator()(const model::Expr& e, const model::Placement& placement) {
  Place place{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) place[axis] = placement[axis] ? 1 : 0;
  return at(e, place).value();
}

Expr Discretiser::shared(const std::string& wish, const Expr& value) {
  if (is_leaf(value)) return value;
  lets_.push_back({names_.fresh(wish), value});
  return local(lets_.back().name);
}

Expr Discretiser::Quotient::value() const {
  Expr bottom = number;
  for (int axis = 0; axis < max_rank; ++axis) {
    if (powers[axis] > 0) bottom = bottom * power(spacing(axis), powers[axis]);
  }
  return top / bottom;
}

bool Discretiser::is_midway(const Place& place, int axis) const {
  return base_ && is_odd(place[axis]) != (*base_)[static_cast<std::size_t>(axis)];
}

Discretiser::Quotient Discretiser::at(const model::Expr& e, const Place& place) {
  if (base_) return at_base(e, place);
  const model::Placement wanted = parity(place);
  const bool is_base = !reads_in_place(e) || placements_.only(e) == wanted;
  const Within within(*this, is_base ? std::optional(wanted) : std::nullopt);
  return at_base(e, place);
}

Discretiser::Quotient Discretiser::at_base(const model::Expr& e, const Place& place) {
  if (++parts_ > max_parts) return Quotient{0.0};
  if (as<model::Reduce>(e)) return reduced_at(e, place);
  for (int axis = 0; axis < max_rank; ++axis) {
    if (is_midway(place, axis) && !has_parts_midway(e)) return at_halfway(e, place, axis);
  }
  return at_place(e, place);
}

/// at() inside a difference, where no lets are made for parts: lets are values at the current cell. Results are cached
/// unless they create fields.
Discretiser::Quotient Discretiser::inside_difference(const model::Expr& e, const Place& place) {
  const Where where{&e.node(), place, base_};
  if (const auto known = known_.find(where); known != known_.end()) {
    if (!gave_up()) parts_ += known->second.parts;
    return known->second.value;
  }
  const auto things_made = [this] { return lets_.size() + preparations_.size() + operands_.size(); };
  const std::size_t made_before = things_made();
  const int parts_before = parts_;
  ++nesting_;
  const Quotient value = at(e, place);
  --nesting_;
  if (things_made() == made_before && !gave_up()) known_.emplace(where, Known{e, value, parts_ - parts_before});
  return value;
}

/// `e` as a whole, averaged over the cells on both sides along `axis`.
Discretiser::Quotient Discretiser::at_halfway(const model::Expr& e, const Place& place, int axis) {
  return combine(midpoint(scheme_.derivative_order), axis, e, place);
}

Discretiser::Quotient Discretiser::at_place(const model::Expr& e, const Place& place) {
  const auto value = [&](const model::Expr& part) { return at(part, place).value(); };
  return match(
      e->kind, [](const model::Number& n) { return Quotient{n.value}; },
      [&](const model::Param& p) { return Quotient{p.name == "t" ? reading_.time : param(p.name)}; },
      [&](const model::Field& f) {
        const auto value = reading_.values.find(f.name);
        if (value != reading_.values.end()) return Quotient{value->second};
        const auto found = reading_.fields.find(f.name);
        Offset offset{};
        const model::Placement own = placements_.of(f.name);
        for (int axis = 0; axis < max_rank; ++axis)
          offset[axis] = (place[axis] - (own[static_cast<std::size_t>(axis)] ? 1 : 0)) / 2;
        return Quotient{access(found == reading_.fields.end() ? f.name : found->second, offset)};
      },
      [&](const model::Coordinate& c) { return coordinate_at(c, place); },
      [](const model::Noise& n) { return Quotient{access(model::noise_name(n.seed), Offset{})}; },
      [&](const model::Neg& n) {
        Quotient result = at(n.operand, place);
        result.top = -result.top;
        return result;
      },
      [&](const model::Binary& b) { return binary_at(b, place); },
      [&](const model::Call& c) {
        std::vector<Expr> arguments;
        for (const model::Expr& argument : c.arguments) arguments.push_back(value(argument));
        return Quotient{call(c.fn, std::move(arguments))};
      },
      [&](const model::Select& s) {
        const Expr condition = value(s.condition);
        const Expr yes = value(s.yes);
        return Quotient{select(condition, yes, value(s.no))};
      },
      [&](const model::Derivative& d) {
        return derivative_at(d, place, d.order % 2 == 0 ? scheme_.laplacian_order : scheme_.derivative_order);
      },
      [&](const model::Advect& a) { return advect_at(a, place); },
      [&](const model::Shift& s) {
        Place there = place;
        for (std::size_t axis = 0; axis < s.offset.size(); ++axis) there[axis] += 2 * s.offset[axis];
        return inside_difference(s.operand, there);
      },
      [&](const model::Interpolate&) { return interpolated_at(e, place); },
      [&](const model::BandPass& b) { return Quotient{band_at(b, place)}; },
      [&](const model::Sample& s) { return Quotient{sample(s, place)}; },
      [&](const model::Apply&) { return Quotient{applied_at(e, place)}; },
      [&](const model::NetworkCall& i) { return Quotient{inferred_at(i, place)}; },
      [&](const model::Solve&) {
        return Quotient{access(stored_solve(e), Offset{place[0] / 2, place[1] / 2, place[2] / 2})};
      },
      [](const model::Reduce&) -> Quotient { unreachable("a reduction is taken before its parts"); });
}

/// Along the reduced axes the result is uniform; along the others a displacement applies to the operand.
Discretiser::Quotient Discretiser::reduced_at(const model::Expr& e, Place place) {
  const model::Reduce& reduce = *as<model::Reduce>(e);
  const bool staggered = placements_.is_staggered();
  const model::Placement own = staggered
                                   ? placements_.operand_placement(reduce, parity(place)).value_or(model::Placement{})
                                   : model::Placement{};
  for (std::size_t axis = 0; axis < place.size(); ++axis) {
    if (reduce.over[axis]) place[axis] = own[axis] ? 1 : 0;
  }
  for (int axis = 0; axis < max_rank; ++axis) {
    const bool goes_over = reduce.over[static_cast<std::size_t>(axis)];
    if (!goes_over && is_midway(place, axis) && !has_parts_midway(e)) return at_halfway(e, place, axis);
  }
  Reduce statement{"", reduction_of(reduce.reduction), stored_operand(reduce.operand, place), {}};
  std::copy_n(reduce.over.begin(), rank_, statement.over.begin());
  Expr value = access(stored_reduction(std::move(statement)));
  for (int axis = 0; axis < rank_ && reduce.reduction == model::Reduce::Kind::integral; ++axis) {
    if (reduce.over[static_cast<std::size_t>(axis)]) value = value * spacing(axis);
  }
  return Quotient{value};
}

Discretiser::Quotient Discretiser::interpolated_at(const model::Expr& e, const Place& place) {
  const model::Expr& operand = as<model::Interpolate>(e)->operand;
  const model::Placement own = placements_.natural(operand).value_or(parity(place));
  for (int axis = 0; axis < max_rank; ++axis) {
    if (is_odd(place[axis]) == own[static_cast<std::size_t>(axis)]) continue;
    return combine(midpoint(scheme_.derivative_order), axis, e, place);
  }
  const Within within(*this, std::nullopt);
  return at(operand, place);
}

/// A component of the velocity, interpolated to the point of the transported field.
Discretiser::Quotient Discretiser::velocity_at(const model::Expr& e, const Place& place) {
  const auto own = base_ ? std::nullopt : placements_.natural(e);
  return at(own && *own != parity(place) ? model::interpolate(e) : e, place);
}

/// Interpolation at a displacement from the current cell: the sampled value does not depend on the point of evaluation.
Expr Discretiser::sample(const model::Sample& e, const Place& place) {
  const auto found = reading_.fields.find(e.field);
  Interp result{found == reading_.fields.end() ? e.field : found->second, {}, {}, e.along};
  for (int axis = 0; axis < static_cast<int>(e.place.size()); ++axis) {
    const Expr way = at(e.place[axis], place).value() - access(axis_letter(axis));
    const bool on_faces = placements_.of(e.field)[static_cast<std::size_t>(axis)];
    result.displacement.push_back(on_faces ? way / spacing(axis) - 0.5 : way / spacing(axis));
  }
  return interp(std::move(result));
}

Discretiser::Quotient Discretiser::binary_at(const model::Binary& e, const Place& place) {
  if (const auto sum = sum_of_waves(e, place)) return *sum;
  const Quotient left = at(e.left, place);
  const Quotient right = at(e.right, place);
  if (e.op == BinaryOp::divide) {
    Quotient result = left;
    result.top = left.top / right.value();
    return result;
  }
  if (e.op != BinaryOp::multiply) return Quotient{binary(e.op, left.value(), right.value())};
  Quotient result{left.top * right.top, left.number * right.number};
  for (int axis = 0; axis < max_rank; ++axis) result.powers[axis] = left.powers[axis] + right.powers[axis];
  return result;
}

Discretiser::Quotient Discretiser::coordinate_at(const model::Coordinate& e, const Place& place) {
  Offset offset{};
  // the coordinate does not change along the other axes
  offset[e.axis] = cell_below(place[e.axis]);
  const Expr centre = access(axis_letter(e.axis), offset);
  return Quotient{is_odd(place[e.axis]) ? centre + spacing(e.axis) / 2.0 : centre};
}

/// Whether `e` is naturally midway between cells along `axis`: it contains an odd number of first derivatives.
bool Discretiser::belongs_midway(const model::Expr& e, int axis) const {
  if (const model::Derivative* d = as<model::Derivative>(e); d && d->axis == axis) {
    return belongs_midway(d->operand, axis) != (d->order == 1);
  }
  if (const auto* here = as<model::Interpolate>(e))  // of an operand at this placement: to the faces
    return placements_.natural(here->operand).value_or(*base_) == *base_;
  if (as<model::Apply>(e) || as<model::NetworkCall>(e)) return false;
  if (const model::Reduce* reduce = as<model::Reduce>(e); reduce && reduce->over[static_cast<std::size_t>(axis)])
    return false;
  if (const model::Advect* a = as<model::Advect>(e)) {
    const bool is_central = model::transport_of(scheme_, *a).advect == model::Advection::central;
    if (is_central && !is_literal(a->velocity[axis], 0)) return true;
  }
  return any_child(e, [&](const model::Expr& child) { return belongs_midway(child, axis); });
}

Discretiser::Quotient Discretiser::derivative_at(const model::Derivative& e, const Place& place, int accuracy) {
  if (accuracy == model::spectral) return waves_at(model::Expr(model::Node{e}), place);
  if (!base_) return placed_derivative(e, place, accuracy);
  const bool midway = is_midway(place, e.axis);
  if (e.order == 1 && (midway || belongs_midway(e.operand, e.axis))) {
    return combine(staggered_difference(accuracy), e.axis, e.operand, place);
  }
  if (midway) return at_halfway(model::Expr(model::Node{e}), place, e.axis);
  const model::Field* field = as<model::Field>(e.operand);
  if (field && nesting_ == 0) return Quotient{named_derivative(e, field->name, place, accuracy)};
  return combine(central_difference(e.order, accuracy), e.axis, e.operand, place);
}

Discretiser::Quotient Discretiser::placed_derivative(const model::Derivative& e, const Place& place, int accuracy) {
  const bool staggered = e.order == 1 && placements_.can_be_at(e.operand, model::toggled(parity(place), e.axis));
  return combine(staggered ? staggered_difference(accuracy) : central_difference(e.order, accuracy), e.axis, e.operand,
                 place);
}

Expr Discretiser::named_derivative(const model::Derivative& e, const std::string& field, const Place& place,
                                   int accuracy) {
  std::string wish = field + "_";
  for (int i = 0; i < e.order; ++i) wish += axis_letter(e.axis);
  std::string& name = derivative_lets_[wish + " " + std::to_string(accuracy)];
  if (name.empty()) {
    const Expr value = combine(central_difference(e.order, accuracy), e.axis, e.operand, place).value();
    name = names_.fresh(wish);
    lets_.push_back({name, value});
  }
  return local(name);
}

Discretiser::Quotient Discretiser::combine(const Difference& difference, int axis, const model::Expr& e,
                                           const Place& place) {
  std::vector<Tap> taps = difference.taps;
  // u[+1] - u[-1], not -u[-1] + u[+1]
  if (difference.derivative % 2 != 0 && taps.size() < 4 && taps.front().weight < 0)
    std::reverse(taps.begin(), taps.end());
  std::vector<Quotient> values;
  bool same = true;
  for (const Tap& tap : taps) {
    Place there = place;
    there[axis] += tap.place;
    values.push_back(inside_difference(e, there));
    same = same && values.back().same_bottom(values.front());
  }
  if (!same) {
    for (Quotient& value : values) value = Quotient{value.value()};
  }
  std::vector<Expr> tops;
  for (const Quotient& value : values) tops.push_back(value.top);
  Quotient result{weighted_sum(taps, tops), values[0].number * static_cast<double>(difference.denominator),
                  values[0].powers};
  result.powers[axis] += difference.derivative;
  return result;
}

Discretiser::Quotient Discretiser::advect_at(const model::Advect& e, const Place& place) {
  const model::Transport& transport = model::transport_of(scheme_, e);
  if (transport.advect != model::Advection::central) return upwind_at(e, place);
  std::vector<Quotient> terms;
  for (int axis = 0; axis < static_cast<int>(e.velocity.size()); ++axis) {
    if (is_literal(e.velocity[axis], 0)) continue;
    const Quotient speed = velocity_at(e.velocity[axis], place);
    const bool has_base = base_ || placements_.only(e.operand) == parity(place);
    const Within within(*this, base_ ? base_ : has_base ? std::optional(parity(place)) : std::nullopt);
    const Quotient slope = derivative_at(model::Derivative{e.operand, axis, 1}, place, transport.order);
    Quotient term{speed.top * slope.top, speed.number * slope.number};
    for (int a = 0; a < max_rank; ++a) term.powers[a] = speed.powers[a] + slope.powers[a];
    terms.push_back(term);
  }
  if (terms.empty()) return Quotient{0.0};
  if (terms.size() == 1) return terms.front();
  Expr sum = 0.0;
  for (const Quotient& term : terms) sum = sum + term.value();
  return Quotient{sum};
}

}  // namespace dpde::stencil
