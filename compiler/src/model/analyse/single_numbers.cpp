// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/single_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "model/build.h"
#include "model/uses.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::model {

namespace {

using Float = std::numeric_limits<float>;

/// Whether its product with a float may be a float: 0, and numbers whose exponent is at most twice that of floats.
bool is_factor(double value) { return value == 0 || std::abs(std::ilogb(value)) <= 2 * -(Float::min_exponent - 1); }

bool is_float(double value) {
  return value == 0 || (std::abs(value) >= Float::min() && std::abs(value) <= Float::max());
}

class Looking {
 public:
  Looking(const Problem& problem, const Use& use, DiagnosticSink& sink) : problem_(problem), use_(use), sink_(sink) {}

  void run(bool meets_field) {
    const Seen seen = look(use_.formula);
    if (meets_field && seen.is_uniform) check(use_.formula, seen, false);
  }

 private:
  struct Seen {
    bool is_uniform = false;      // contains only numbers, parameters and time
    std::optional<double> value;  // if all of these are known
    bool has_sum = false;         // contains a sum over cells; its factors also multiply the terms and their adjoints
  };

  Seen look(const Expr& e) {
    return match(
        e->kind,
        [](const Number& n) {
          return Seen{true, n.value};
        },
        [&](const Param& p) { return of_param(p); }, [](const Field&) { return Seen{}; },
        [](const Coordinate&) { return Seen{}; }, [](const Noise&) { return Seen{}; },
        [&](const Neg&) { return look_below(e, true); },
        [&](const Binary& b) { return look_below(e, b.op == BinaryOp::multiply || b.op == BinaryOp::divide); },
        [&](const Call&) { return look_below(e, false); }, [&](const Select&) { return look_below(e, false); },
        [&](const Derivative&) { return look_into(e); }, [&](const Advect&) { return look_into(e); },
        [&](const Shift&) { return look_into(e); }, [&](const Interpolate&) { return look_into(e); },
        [&](const BandPass&) { return look_into(e); }, [](const Sample&) { return Seen{}; },  // its position is uniform
        [&](const Reduce& r) {
          look_into(e);
          return Seen{r.is_over_all(), std::nullopt, r.is_over_all()};  // one double
        },
        [&](const Apply&) { return look_into(e); }, [&](const NetworkCall&) { return look_into(e); },
        [&](const Solve&) { return look_into(e); });
  }

  Seen of_param(const Param& p) const {
    const Parameter* known = problem_.find_param(p.name);  // an unknown has its initial value
    return {true, known != nullptr ? std::optional(known->value) : std::nullopt};
  }

  /// Arithmetic: checks uniform operands that are combined with fields.
  Seen look_below(const Expr& e, bool of_factors) {
    std::vector<std::pair<Expr, Seen>> parts;
    for_each_child(e, [&](const Expr& part) { parts.emplace_back(part, look(part)); });
    const bool has_sum = std::ranges::any_of(parts, [](const auto& part) { return part.second.has_sum; });
    if (std::ranges::all_of(parts, [](const auto& part) { return part.second.is_uniform; })) {
      for (const auto& [part, seen] : parts) {
        if (has_sum && of_factors) check(part, seen, false);
      }
      return {true, value_of(e, parts), has_sum};
    }
    for (const auto& [part, seen] : parts) {
      if (seen.is_uniform) check(part, seen, of_factors);
    }
    return {};
  }

  /// Operators take fields.
  Seen look_into(const Expr& e) {
    for_each_child(e, [&](const Expr& part) { look(part); });
    return {};
  }

  static std::optional<double> value_of(const Expr& e, const std::vector<std::pair<Expr, Seen>>& parts) {
    std::vector<double> values;
    for (const auto& [part, seen] : parts) {
      if (!seen.value) return std::nullopt;
      values.push_back(*seen.value);
    }
    if (const Binary* b = as<Binary>(e)) return evaluate_binary(b->op, values[0], values[1]);
    if (const Call* c = as<Call>(e)) return evaluate_call(c->fn, values.front(), values.back());
    if (is<Select>(e)) return values[0] != 0 ? values[1] : values[2];
    return -values[0];
  }

  void check(const Expr& e, const Seen& seen, bool is_of_factors) {
    if (!seen.value || std::isnan(*seen.value) || (is_of_factors ? is_factor(*seen.value) : is_float(*seen.value)))
      return;
    const bool is_small = std::abs(*seen.value) < 1;
    sink_.report("bad-number", e->origin.range.is_known() ? e->origin.range : use_.origin.range,
                 {fmt::format("{:g}", *seen.value)},
                 fmt::format("fields in single precision hold sizes from 1.2e-38 to 3.4e38, and {} there: write real = "
                             "f64, or measure in units in which it is nearer 1",
                             is_small ? "it is 0" : "it is infinite"));
  }

  const Problem& problem_;
  const Use& use_;
  DiagnosticSink& sink_;
};

}  // namespace

void check_numbers_of_floats(const Problem& problem, DiagnosticSink& sink) {
  for_each_formula(problem, [&](const Use& use) {
    Looking looking(problem, use, sink);
    switch (use.kind) {
      using enum UseKind;
      case equation:
      case potential:
      case constraint:
      case correction:
      case event:
      case held_value:
      case output:
      case initial:
      case coefficient:
      case exact:
      case boundary_value: return looking.run(true);
      case held_where:
      case courant_rate:
      case observable:
      case loss:
      case test:
      case test_field: return looking.run(false);
      case control:
      case control_start:
      case unknown_start: return looking.run(false);  // for a field or a parameter
      case boundary_weight:
      case stretch_map:
      case metric:
      case stated_operator: return;  // computed in double precision, or not run
    }
  });
}

}  // namespace dpde::model
