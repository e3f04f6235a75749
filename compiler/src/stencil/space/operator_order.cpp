// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/operator_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "stencil/analyse/laurent.h"
#include "stencil/build.h"
#include "stencil/space/discretise.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

constexpr int samples = 8;  // sets of fields for which the order is measured
constexpr int waves = 4;    // of each field

/// A sum of exponentials for each field, and a number for each parameter without a value.
class Sample {
 public:
  Sample(const model::Problem& problem, const std::vector<Let>& lets, unsigned seed) : problem_(problem), seed_(seed) {
    for (const Let& let : lets) lets_.emplace(let.name, value(let.value));
  }

  Laurent value(const Expr& e) {
    return match(
        e->kind, [](const Literal& l) { return monomial(l.value); }, [&](const Param& p) { return parameter(p.name); },
        [&](const Local& l) { return lets_.at(l.name); }, [&](const Access& a) { return field(a.field, a.offset); },
        [](const Interp&) { return no_series(); }, [](const Inside&) { return monomial(1); },
        [&](const Neg& n) { return -value(n.operand); }, [&](const Binary& b) { return operation(b); },
        [&](const Call& c) {
          std::vector<Laurent> arguments;
          for (const Expr& argument : c.arguments) arguments.push_back(value(argument));
          return call(c.fn, arguments);
        },
        [&](const Select& s) { return holds(s.condition) ? value(s.yes) : value(s.no); });
  }
  /// Whether the truth of all conditions so far is known.
  bool is_known() const { return is_known_; }

 private:
  Laurent operation(const Binary& b) {
    switch (b.op) {
      case BinaryOp::add: return value(b.left) + value(b.right);
      case BinaryOp::subtract: return value(b.left) - value(b.right);
      case BinaryOp::multiply: return value(b.left) * value(b.right);
      case BinaryOp::divide: return value(b.left) / value(b.right);
      case BinaryOp::power: return power(value(b.left), value(b.right));
      case BinaryOp::less:
      case BinaryOp::less_equal:
      case BinaryOp::greater:
      case BinaryOp::greater_equal:
      case BinaryOp::equal:
      case BinaryOp::not_equal:
      case BinaryOp::logical_and:
      case BinaryOp::logical_or: return monomial(compare(b) ? 1 : 0);
    }
    unreachable("operator");
  }

  bool holds(const Expr& e) {
    const Binary* b = as<Binary>(e);
    return b && compare(*b);
  }

  bool compare(const Binary& b) {
    if (b.op == BinaryOp::logical_and) return holds(b.left) && holds(b.right);
    if (b.op == BinaryOp::logical_or) return holds(b.left) || holds(b.right);
    const Laurent difference = value(b.left) - value(b.right);
    is_known_ = is_known_ && difference.is_known();
    const int sign = sign_of(difference);
    switch (b.op) {
      case BinaryOp::less: return sign < 0;
      case BinaryOp::less_equal: return sign <= 0;
      case BinaryOp::greater: return sign > 0;
      case BinaryOp::greater_equal: return sign >= 0;
      case BinaryOp::equal: return sign == 0;
      case BinaryOp::not_equal: return sign != 0;
      case BinaryOp::add:
      case BinaryOp::subtract:
      case BinaryOp::multiply:
      case BinaryOp::divide:
      case BinaryOp::power:
      case BinaryOp::logical_and:
      case BinaryOp::logical_or: break;
    }
    unreachable("comparison");
  }

  /// All spacings decrease together, in a fixed ratio.
  double spacing_of(std::size_t axis) const {
    const double extent = problem_.axes[0].high - problem_.axes[0].low;
    return extent * problem_.axes[axis].spacing() / problem_.axes[0].spacing();
  }

  Laurent parameter(const std::string& name) {
    for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
      if (name == "h" + problem_.axes[axis].name) return monomial(spacing_of(axis), 1);
    }
    const model::Parameter* known = problem_.find_param(name);
    return monomial(known && !problem_.find_control(name) ? known->value : number(name, 0.5, 1.5));
  }

  Laurent field(const std::string& name, const Offset& offset) {
    for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
      const model::Axis& along = problem_.axes[axis];
      if (name != along.name) continue;
      const double place = along.low + number(name, 0.2, 0.8) * (along.high - along.low);
      return monomial(place) + monomial(offset[axis] * spacing_of(axis), 1);
    }
    auto known = fields_.find(name);
    if (known == fields_.end()) known = fields_.emplace(name, new_field()).first;
    return exponentials(known->second, offset);
  }

  struct Wave {
    double height = 0;
    std::array<double, max_rank> slope{};  // from cell to cell, in h
  };
  /// Values have either sign; in every other sample they are positive.
  struct FieldOfWaves {
    double mean;
    std::array<Wave, waves> parts;
  };

  FieldOfWaves new_field() {
    FieldOfWaves field{seed_ % 2 == 0 ? 2.5 : 0.0, {}};
    for (Wave& wave : field.parts) {
      wave.height = uniform(0.2, 0.5) * (uniform(0, 1) < 0.5 ? -1 : 1);
      for (std::size_t axis = 0; axis < problem_.axes.size(); ++axis) {
        const double relative = problem_.axes[axis].spacing() / problem_.axes[0].spacing();
        wave.slope[axis] = uniform(0.5, 1.5) * (uniform(0, 1) < 0.5 ? -1 : 1) * std::min(1.0, relative);
      }
    }
    return field;
  }

  static Laurent exponentials(const FieldOfWaves& field, const Offset& offset) {
    Laurent result = monomial(field.mean);
    for (const Wave& wave : field.parts) {
      double way = 0;
      for (std::size_t axis = 0; axis < offset.size(); ++axis) way += offset[axis] * wave.slope[axis];
      double term = wave.height;
      for (int power = 0; power < laurent_terms; ++power) {
        LaurentTerm& sum = result.terms[static_cast<std::size_t>(power)];
        sum = {sum.value + term, sum.scale + std::abs(term)};
        term *= way / (power + 1);
      }
    }
    return result;
  }

  double number(const std::string& name, double low, double high) {
    const auto known = numbers_.find(name);
    return known != numbers_.end() ? known->second : numbers_.emplace(name, uniform(low, high)).first->second;
  }

  /// A uniform random number, the same on every machine.
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) / 4294967296.0);
  }

  const model::Problem& problem_;
  const unsigned seed_;
  bool is_known_ = true;
  std::mt19937 random_{seed_ + 1};
  std::map<std::string, FieldOfWaves> fields_;
  std::map<std::string, double> numbers_;
  std::map<std::string, Laurent> lets_;
};

MeasuredOrder order_of(const Laurent& s) {
  const int first = valuation(s);
  if (first < 0) return {MeasuredOrder::Kind::none, -first, ""};
  for (int power = std::max(first, 1); power < s.end(); ++power) {
    if (!s.terms[static_cast<std::size_t>(power - s.low)].is_zero()) return {MeasuredOrder::Kind::found, power, ""};
  }
  return {MeasuredOrder::Kind::exact, 0, ""};
}

/// Whether the measured order `a` is worse than `b`.
bool is_worse(const MeasuredOrder& a, const MeasuredOrder& b) {
  const auto rank = [](const MeasuredOrder& m) {
    return m.kind == MeasuredOrder::Kind::none    ? -m.order
           : m.kind == MeasuredOrder::Kind::found ? m.order
                                                  : laurent_terms;
  };
  return rank(a) < rank(b);
}

std::string reason_not_to_measure(const model::Problem& problem, const model::Expr& body) {
  const auto holds = [&](auto is_kind) { return any_part(body, is_kind); };
  if (holds([](const model::Expr& e) { return is<model::Reduce>(e); })) return "it holds a reduction";
  if (holds([](const model::Expr& e) { return is<model::NetworkCall>(e); })) return "a network is in it";
  if (holds([](const model::Expr& e) { return is<model::Solve>(e); })) return "a solve is in it";
  if (holds([](const model::Expr& e) { return is<model::Sample>(e); })) return "it holds a sample";
  if (holds([](const model::Expr& e) { return is<model::BandPass>(e); })) return "it holds a part of the waves";
  const bool has_places =
      holds([](const model::Expr& e) { return is<model::Derivative, model::Advect, model::Interpolate>(e); });
  if (has_places && model::Placements(problem).is_staggered())
    return "it holds derivatives, and the scene has staggered fields";
  const bool transports = holds([](const model::Expr& e) { return is<model::Advect>(e); });
  if (transports && problem.scheme.is_semi_lagrangian()) return "it holds a semi-Lagrangian advect";
  return "";
}

MeasuredOrder measure(const model::Problem& problem, const model::Expr& body) {
  if (const std::string why = reason_not_to_measure(problem, body); !why.empty())
    return {MeasuredOrder::Kind::unknown, 0, why};
  const model::Scheme scheme = model::with_differences(problem.scheme);
  Discretiser at_point(scheme, NameSupply(), static_cast<int>(problem.axes.size()));
  const Expr value = at_point(body);
  if (at_point.gave_up()) return {MeasuredOrder::Kind::unknown, 0, "its differences are too many"};
  std::optional<MeasuredOrder> worst;
  for (unsigned seed = 0; seed < samples; ++seed) {
    Sample sample(problem, at_point.lets(), seed);
    const Laurent s = sample.value(value);
    const bool is_finite =
        std::all_of(s.terms.begin(), s.terms.end(), [](const auto& c) { return std::isfinite(c.scale); });
    if (!s.is_known() || !sample.is_known() || !is_finite)
      continue;  // log of a negative number and the like: tries the next fields
    const MeasuredOrder found = order_of(s);
    if (!worst || is_worse(found, *worst)) worst = found;
  }
  return worst.value_or(
      MeasuredOrder{MeasuredOrder::Kind::unknown, 0, "it has no smooth value for the fields that were tried"});
}

/// Whether its order may depend on a parameter that the scene sets.
bool holds_parameter(const model::Problem& problem, const model::StatedOrder& stated) {
  return std::any_of(stated.body.begin(), stated.body.end(), [&](const model::Expr& body) {
    return any_part(body, [&](const model::Expr& e) {
      const auto* param = as<model::Param>(e);
      return param && problem.find_param(param->name) != nullptr;
    });
  });
}

}  // namespace

MeasuredOrder measure_order(const model::Problem& problem, const model::StatedOrder& stated) {
  MeasuredOrder worst{MeasuredOrder::Kind::exact, 0, ""};
  for (const model::Expr& part : stated.body) {
    const MeasuredOrder found = measure(problem, part);
    if (found.kind == MeasuredOrder::Kind::unknown) return found;
    if (is_worse(found, worst)) worst = found;
  }
  return worst;
}

bool check_stated_orders(const model::Problem& problem, DiagnosticSink& sink) {
  std::set<std::string> reported;
  bool good = true;
  for (const model::StatedOrder& stated : problem.operators) {
    if (stated.order == 0 || reported.contains(stated.name)) continue;
    const MeasuredOrder found = measure_order(problem, stated);
    const std::string order = std::to_string(stated.order);
    if (found.kind == MeasuredOrder::Kind::none) {
      sink.report("stated-order", stated.origin.range,
                  {stated.name, order,
                   fmt::format("its result grows as 1/h{} when the cells get smaller",
                               found.order == 1 ? "" : fmt::format("^{}", found.order))},
                  "the weights of a derivative add up to 0, and each spacing divides once for each order of the "
                  "derivative; order 0 states nothing");
    } else if (found.kind == MeasuredOrder::Kind::found && found.order < stated.order) {
      sink.report("stated-order", stated.origin.range,
                  {stated.name, order,
                   fmt::format("its error goes as h{}", found.order == 1 ? "" : fmt::format("^{}", found.order))},
                  fmt::format("write order {}, or mend its weights (as fractions: 1/3, not 0.3333)", found.order));
    } else if (found.kind == MeasuredOrder::Kind::found && found.order > stated.order &&
               !holds_parameter(problem, stated)) {
      sink.report("stated-order-low", stated.origin.range, {stated.name, order, std::to_string(found.order)},
                  fmt::format("write order {}", found.order));
      reported.insert(stated.name);
      continue;
    } else {
      continue;
    }
    reported.insert(stated.name);
    good = false;
  }
  return good;
}

}  // namespace dpde::stencil
