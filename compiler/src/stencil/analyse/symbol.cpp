// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/symbol.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "stencil/build.h"
#include "support/contains.h"
#include "support/names/wave_names.h"

namespace dpde::stencil {

namespace {

using Terms = std::vector<Monomial>;

void add(Terms& sum, const Monomial& term) {
  const auto same = std::ranges::find_if(
      sum, [&](const Monomial& m) { return m.powers == term.powers && m.vanishes == term.vanishes; });
  if (same == sum.end()) {
    sum.push_back(term);
  } else {
    same->coefficient = same->coefficient + term.coefficient;
  }
}

std::optional<Terms> product_of_sums(const Terms& a, const Terms& b) {
  Terms result;
  for (const Monomial& left : a) {
    for (const Monomial& right : b) {
      Monomial term{left.coefficient * right.coefficient, left.powers, left.vanishes};
      for (std::size_t axis = 0; axis < max_rank; ++axis) {
        term.powers[axis] += right.powers[axis];
        term.vanishes[axis] = term.vanishes[axis] || right.vanishes[axis];
        if (term.powers[axis] > highest_power) return std::nullopt;
      }
      add(result, term);
    }
  }
  return result;
}

Terms times(Terms p, const auto& f) {
  for (Monomial& term : p) term.coefficient = f(term.coefficient);
  return p;
}

std::optional<Terms> power_of(const Terms& base, const Expr& exponent) {
  const Literal* number = as<Literal>(exponent);
  if (number == nullptr || number->value != std::floor(number->value) || number->value < 1 ||
      number->value > highest_power)
    return std::nullopt;
  std::optional<Terms> result = base;
  for (int i = 1; i < static_cast<int>(number->value) && result; ++i) result = product_of_sums(*result, base);
  return result;
}

std::optional<Terms> of_binary(const Binary& b) {
  const std::optional<Terms> left = polynomial_of(b.left);
  if (!left) return std::nullopt;
  if (b.op == BinaryOp::power) return power_of(*left, b.right);
  const std::optional<Terms> right = polynomial_of(b.right);
  if (!right) return std::nullopt;
  if (b.op == BinaryOp::multiply) return product_of_sums(*left, *right);
  if (b.op == BinaryOp::divide) {
    if (holds_wave_number(b.right)) return std::nullopt;
    return times(*left, [&](const Expr& c) { return c / b.right; });
  }
  if (b.op != BinaryOp::add && b.op != BinaryOp::subtract) return std::nullopt;
  Terms sum = *left;
  const bool subtracts = b.op == BinaryOp::subtract;
  for (const Monomial& term : *right)
    add(sum, {subtracts ? -term.coefficient : term.coefficient, term.powers, term.vanishes});
  return sum;
}

}  // namespace

namespace {

/// Index of `e` in wave_names.
std::optional<int> number_of(const Expr& e) {
  const Param* p = as<Param>(e);
  if (p == nullptr) return std::nullopt;
  const auto found = std::ranges::find(wave_names, p->name);
  if (found == std::end(wave_names)) return std::nullopt;
  return static_cast<int>(found - std::begin(wave_names));
}

}  // namespace

Expr wave_number(int axis) { return param(std::string(wave_names[axis])); }
Expr slope_number(int axis) { return param(std::string(wave_names[max_rank + axis])); }

std::optional<int> wave_axis(const Expr& e) {
  const std::optional<int> number = number_of(e);
  return number ? std::optional(*number % max_rank) : std::nullopt;
}

bool is_slope_number(const Expr& e) { return number_of(e).value_or(0) >= max_rank; }

bool holds_wave_number(const Expr& e) {
  return any_part(e, [&](const Expr& part) { return wave_axis(part); });
}

bool holds_params(const Expr& e) {
  return any_part(e, [&](const Expr& part) { return (is<Param>(part) && !wave_axis(part)); });
}

std::optional<Terms> polynomial_of(const Expr& e) {
  if (const auto axis = wave_axis(e)) {
    Monomial term{1.0};
    term.powers[static_cast<std::size_t>(*axis)] = 1;
    term.vanishes[static_cast<std::size_t>(*axis)] = is_slope_number(e);
    return Terms{term};
  }
  if (!holds_wave_number(e)) return Terms{{e}};
  if (const Neg* neg = as<Neg>(e)) {
    const std::optional<Terms> operand = polynomial_of(neg->operand);
    if (!operand) return std::nullopt;
    return times(*operand, [](const Expr& c) { return -c; });
  }
  const Binary* b = as<Binary>(e);
  return b != nullptr ? of_binary(*b) : std::nullopt;
}

Expr expression_of(const Terms& polynomial) {
  Expr sum = 0.0;
  for (const Monomial& term : polynomial) {
    Expr waves = 1.0;
    for (int axis = 0; axis < max_rank; ++axis) {
      const bool vanishes = term.vanishes[static_cast<std::size_t>(axis)];
      const int n = term.powers[static_cast<std::size_t>(axis)] - (vanishes ? 1 : 0);
      if (vanishes) waves = waves * slope_number(axis);
      if (n > 0) waves = waves * (n == 1 ? wave_number(axis) : power(wave_number(axis), n));
    }
    sum = sum + term.coefficient * waves;
  }
  return sum;
}

bool holds_odd_powers(const Expr& symbol) {
  const auto is_odd = [](int power) { return power % 2 != 0; };
  const std::optional<Terms> polynomial = polynomial_of(symbol);
  return polynomial && std::ranges::any_of(
                           *polynomial, [&](const Monomial& term) { return std::ranges::any_of(term.powers, is_odd); });
}

Expr with_slopes(const Expr& symbol) {
  std::optional<Terms> polynomial = polynomial_of(symbol);
  if (!polynomial) return symbol;  // verify_stencil reports it
  Terms result;
  for (Monomial term : *polynomial) {
    for (std::size_t axis = 0; axis < max_rank; ++axis)
      term.vanishes[axis] = term.vanishes[axis] || term.powers[axis] % 2 != 0;
    add(result, term);
  }
  return expression_of(result);
}

namespace {

/// The symbol for -k: terms of odd order change sign.
Expr with_opposite_waves(const Expr& symbol) {
  std::optional<Terms> polynomial = polynomial_of(symbol);
  if (!polynomial) return symbol;  // verify_stencil reports it
  for (Monomial& term : *polynomial) {
    if ((term.powers[0] + term.powers[1] + term.powers[2]) % 2 != 0) term.coefficient = -term.coefficient;
  }
  return expression_of(*polynomial);
}

}  // namespace

Multiplier transposed(Multiplier multiplier) {
  multiplier.argument = with_opposite_waves(multiplier.argument);
  multiplier.factor = with_opposite_waves(multiplier.factor);
  return multiplier;
}

void for_each_symbol(const Transform& transform, const std::function<void(const Expr&)>& f) {
  for (const Transform::Term& term : transform.terms) {
    if (term.by.function) f(term.by.argument);
    f(term.by.factor);
  }
}

std::vector<std::string> params_of(const Transform& transform) {
  std::vector<std::string> params;
  for_each_symbol(transform, [&](const Expr& symbol) {
    visit(symbol, [&](const Expr& part) {
      const Param* p = as<Param>(part);
      if (p != nullptr && !wave_axis(part) && !contains(params, p->name)) params.push_back(p->name);
    });
  });
  return params;
}

std::array<bool, max_rank> axes_of(const Expr& symbol) {
  std::array<bool, max_rank> axes{};
  visit(symbol, [&](const Expr& part) {
    if (const auto axis = wave_axis(part)) axes[static_cast<std::size_t>(*axis)] = true;
  });
  return axes;
}

std::array<bool, max_rank> axes_of(const Transform& transform, std::size_t rank) {
  std::array<bool, max_rank> axes{};
  const auto cuts = [](const Transform::Term& term) { return term.by.within_two_thirds; };
  if (std::ranges::any_of(transform.terms, cuts)) std::fill_n(axes.begin(), rank, true);
  for_each_symbol(transform, [&](const Expr& symbol) {
    const std::array<bool, max_rank> own = axes_of(symbol);
    for (std::size_t axis = 0; axis < max_rank; ++axis) axes[axis] = axes[axis] || own[axis];
  });
  return axes;
}

}  // namespace dpde::stencil
