// SPDX-License-Identifier: Apache-2.0
#include "loop/from_stencil/uniforms.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "loop/expressions.h"
#include "support/contains.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::loop {

namespace {

/// Equal definitions have equal hashes.
std::size_t hash_of(const Expr& e) {
  std::size_t hash = e->kind.index();
  const auto mix = [&](std::size_t part) { hash = hash * 1'000'003 + part; };
  if (const Literal* literal = as<Literal>(e)) mix(std::hash<double>{}(literal->value));
  if (const Param* param = as<Param>(e)) mix(param->index);
  if (const Counter* counter = as<Counter>(e)) mix(counter->index);
  if (const Uniform* uniform = as<Uniform>(e)) mix(uniform->index);
  for_each_child(e, [&](const Expr& child) { mix(hash_of(child)); });
  return hash;
}

}  // namespace

UniformTable::UniformTable(std::vector<std::string> params, NameSupply taken, Precision real,
                           const std::map<std::string, double>& values)
    : params_(std::move(params)), names_(std::move(taken)), real_(real), param_values_(values) {
  for (const std::string& name : params_) names_.reserve(name);
}

int UniformTable::counter(const std::string& name) {
  const auto found = std::find(counters_.begin(), counters_.end(), name);
  const auto index = static_cast<int>(found - counters_.begin());
  if (found == counters_.end()) counters_.push_back(name);
  return index;
}

Expr UniformTable::param(const std::string& name) {
  if (contains(in_scope_, name)) return make(Counter{counter(name)});
  const auto found = std::find(params_.begin(), params_.end(), name);
  const int index = static_cast<int>(found - params_.begin());
  if (found == params_.end()) {
    params_.push_back(name);
    names_.reserve(name);
  }
  return make(Param{index});
}

std::string UniformTable::name_for(const Expr& definition, const std::string& wish) {
  if (const Param* param = as<Param>(definition)) return params_[param->index];
  if (const Counter* counter = as<Counter>(definition)) return names_.fresh(counters_[counter->index]);
  if (!wish.empty()) return names_.fresh(wish);
  std::string name;
  do {
    name = fmt::format("u{}", next_number_++);
  } while (names_.is_used(name));
  names_.reserve(name);
  return name;
}

int UniformTable::index_of(const Expr& definition, const std::string& wish) {
  if (const Uniform* uniform = as<Uniform>(definition)) return uniform->index;
  const std::size_t hash = hash_of(definition);
  const auto [first, last] = by_hash_.equal_range(hash);
  const auto found =
      std::find_if(first, last, [&](const auto& known) { return uniforms_[known.second].value == definition; });
  if (found != last) return found->second;
  const int index = static_cast<int>(uniforms_.size());
  uniforms_.push_back({name_for(definition, wish), definition});
  values_.push_back(real_ == Precision::f32 ? value_of(definition) : 1);
  by_hash_.emplace(hash, index);
  return index;
}

Expr UniformTable::use(const Expr& definition, const std::string& wish) {
  if (is<Literal>(definition)) return definition;
  return make(Uniform{index_of(definition, wish)});
}

double UniformTable::value_of(const Expr& definition) const {
  const auto value = [&](const Expr& part) { return value_of(part); };
  return match(
      definition->kind, [](const Literal& l) { return l.value; },
      [&](const Uniform& u) { return values_[static_cast<std::size_t>(u.index)]; },
      [&](const Param& p) {
        const auto known = param_values_.find(params_[static_cast<std::size_t>(p.index)]);
        return known == param_values_.end() ? 1.0 : known->second;
      },
      [](const Counter&) { return 1.0; }, [](const Load&) { return 1.0; }, [](const Local&) { return 1.0; },
      [](const Inside&) { return 1.0; }, [](const Interp&) { return 1.0; },
      [&](const Neg& n) { return -value(n.operand); }, [&](const Rounded& r) { return value(r.operand); },
      [&](const Binary& b) { return evaluate_binary(b.op, value(b.left), value(b.right)); },
      [&](const Call& c) { return evaluate_call_of(c.fn, c.arguments, value); },
      [&](const Select& s) { return value(value(s.condition) != 0 ? s.yes : s.no); });
}

void Factors::add_number(double value, bool inverse) {
  const double size = std::abs(value);
  const double product = (inverse ? number_below_ : number_above_) * size;
  if (!std::isnormal(product)) return add_uniform(value, inverse);  // 0 or overflow: evaluated at run time
  if (std::signbit(value)) negate();
  (inverse ? number_below_ : number_above_) = product;
}

Expr Factors::unsigned_definition() const {
  const double quotient = number_above_ / number_below_;
  const bool divides = quotient == std::floor(quotient) && std::isnormal(quotient);
  const double number_above = divides ? quotient : number_above_;
  const double number_below = divides ? 1 : number_below_;
  if (uniform_above_.empty() && uniform_below_.empty() && std::isnormal(quotient)) return quotient;

  std::vector<Expr> above = uniform_above_;
  std::vector<Expr> below = uniform_below_;
  if (number_above != 1) above.insert(above.begin(), number_above);
  if (number_below != 1) below.insert(below.begin(), number_below);
  if (below.empty()) return product(above);
  return make(Binary{BinaryOp::divide, product(above), product(below)});
}

Expr Factors::definition() const { return negative_ ? loop::negate(unsigned_definition()) : unsigned_definition(); }

/// A product of several uniform factors, as 1e-20 twice, may exceed the range of f32 although its product with fields
/// does not. Powers of two are split off until the exponent is at most 63 in size: half the range of f32 (126) is left
/// for parameters that change. Intermediate products with fields are then in range if the whole product is.
std::vector<Expr> Factors::take_powers(const UniformTable& uniforms) {
  constexpr int most = 63;
  std::vector<Expr> powers;
  const double value = uniforms.value_of(unsigned_definition());
  if (!std::isnormal(value)) return powers;
  for (int exponent = std::ilogb(value); std::abs(exponent) > most;) {
    const int taken = exponent > 0 ? most : -most;
    powers.emplace_back(std::scalbn(1.0, taken));
    number_above_ = std::scalbn(number_above_, -taken);
    exponent -= taken;
  }
  return powers;
}

bool Factors::hangs_on_order(const UniformTable& uniforms) const {
  if (uniforms.real() != Precision::f32 || below_.empty() || (above_.size() < 2 && below_.size() < 2)) return false;
  Factors copy = *this;
  return copy.take_powers(uniforms).empty();
}

Expr Factors::varying(UniformTable& uniforms) {
  const std::vector<Expr> powers = uniforms.real() == Precision::f32 ? take_powers(uniforms) : std::vector<Expr>();
  if (!powers.empty()) return negative_ ? loop::negate(between(powers, uniforms)) : between(powers, uniforms);
  std::vector<Expr> above = above_;
  const Expr uniform = unsigned_definition();
  if (!is_literal(uniform, 1)) above.insert(above.begin(), uniforms.use(uniform));
  Expr result = product(above);
  if (!below_.empty()) result = make(Binary{BinaryOp::divide, result, product(below_)});
  return negative_ ? loop::negate(result) : result;
}

/// Multiplies factors and divisors one by one, each followed by a power, so that all intermediate values stay in range.
Expr Factors::between(const std::vector<Expr>& powers, UniformTable& uniforms) const {
  Expr result = uniforms.use(unsigned_definition());
  for (std::size_t i = 0; i < std::max({above_.size(), below_.size(), powers.size()}); ++i) {
    if (i < above_.size()) result = make(Binary{BinaryOp::multiply, result, above_[i]});
    if (i < below_.size()) result = make(Binary{BinaryOp::divide, result, below_[i]});
    if (i < powers.size()) result = make(Binary{BinaryOp::multiply, result, powers[i]});
  }
  return result;
}

}  // namespace dpde::loop
