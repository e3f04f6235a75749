// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/polynomial.h"

#include <algorithm>
#include <functional>

#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

template <class Map>
void add_to(Map& map, const typename Map::key_type& key, const typename Map::mapped_type& value) {
  const auto [found, is_new] = map.emplace(key, value);
  if (is_new) return;
  if constexpr (std::is_same_v<typename Map::mapped_type, double>) {
    found->second += value;
    if (found->second == 0) map.erase(found);
  } else {
    found->second = sum(found->second, value);
    if (found->second.empty()) map.erase(found);
  }
}

/// Equal expressions have equal hashes.
std::size_t hash_of(const Expr& e) {
  std::size_t hash = e->kind.index();
  const auto mix = [&](std::size_t part) { hash = hash * 1'000'003 + part; };
  const std::hash<std::string> name;
  if (const Literal* literal = as<Literal>(e)) mix(std::hash<double>{}(literal->value));
  if (const Param* param = as<Param>(e)) mix(name(param->name));
  if (const Local* local = as<Local>(e)) mix(name(local->name));
  if (const Access* access = as<Access>(e)) {
    mix(name(access->field));
    for (const int cells : access->offset) mix(cells);
  }
  for_each_child(e, [&](const Expr& child) { mix(hash_of(child)); });
  return hash;
}

}  // namespace

/// Stops at the first value that varies. Visits right operands first: sums are deep on the left, and passes call this
/// at each level.
bool is_uniform(const Expr& e) {
  if (is<Access, Local, Interp, Inside>(e)) return false;
  if (const Binary* b = as<Binary>(e)) return is_uniform(b->right) && is_uniform(b->left);
  return !any_child(e, [](const Expr& child) { return !is_uniform(child); });
}

int Atoms::of(const Expr& value, bool uniform) {
  const std::size_t hash = hash_of(value);
  const auto [first, last] = by_hash_.equal_range(hash);
  const auto found = std::find_if(first, last, [&](const auto& known) { return atoms_[known.second].value == value; });
  if (found != last) return found->second;
  by_hash_.emplace(hash, size());
  atoms_.push_back({value, uniform, std::nullopt});
  return size() - 1;
}

int Atoms::of(const Polynomial& definition) {
  for (int i = 0; i < size(); ++i) {
    if (atoms_[i].definition == definition) return i;
  }
  atoms_.push_back({0.0, false, definition});
  return size() - 1;
}

Coefficient negated(Coefficient coefficient) {
  for (auto& [monomial, number] : coefficient) number = -number;
  return coefficient;
}

Polynomial negated(Polynomial p) {
  for (auto& [monomial, coefficient] : p) coefficient = negated(std::move(coefficient));
  return p;
}

Coefficient sum(Coefficient a, const Coefficient& b) {
  for (const auto& [monomial, number] : b) add_to(a, monomial, number);
  return a;
}

Polynomial sum(Polynomial a, const Polynomial& b) {
  for (const auto& [monomial, coefficient] : b) add_to(a, monomial, coefficient);
  return a;
}

Powers product(Powers a, const Powers& b) {
  for (const auto& [atom, exponent] : b) {
    const int total = a[atom] += exponent;
    if (total == 0) a.erase(atom);
  }
  return a;
}

Coefficient product(const Coefficient& a, const Coefficient& b) {
  Coefficient result;
  for (const auto& [x, m] : a) {
    for (const auto& [y, n] : b) add_to(result, product(x, y), m * n);
  }
  return result;
}

Polynomial product(const Polynomial& a, const Polynomial& b) {
  Polynomial result;
  for (const auto& [x, m] : a) {
    for (const auto& [y, n] : b) add_to(result, product(x, y), product(m, n));
  }
  return result;
}

Powers without(Powers monomial, int atom) { return product(std::move(monomial), {{atom, -1}}); }

std::set<std::string> Expansion::carried_fields(const Expr& e) {
  std::set<std::string> fields;
  for (const auto& [monomial, coefficient] : expand(e, {})) {
    if (monomial.size() != 1 || monomial.begin()->second != 1 || !coefficient.contains({})) continue;
    const Atom& atom = atoms_[monomial.begin()->first];
    const Access* access = atom.definition ? nullptr : as<Access>(atom.value);
    if (access) fields.insert(access->field);
  }
  return fields;
}

std::map<std::string, double> Expansion::weights(const Expr& e) {
  std::map<std::string, double> weights;
  add_weights(e, 1, weights);
  return weights;
}

/// Adds the weights of terms that are a number times a value at offset 0; ignores other terms.
void Expansion::add_weights(const Expr& e, double scale, std::map<std::string, double>& weights) {
  if (const Access* access = as<Access>(e)) {
    if (access->offset == Offset{}) weights[access->field] += scale;
    return;
  }
  if (const Neg* n = as<Neg>(e)) return add_weights(n->operand, -scale, weights);
  const Binary* b = as<Binary>(e);
  if (!b) return;
  if (b->op == BinaryOp::add || b->op == BinaryOp::subtract) {
    add_weights(b->left, scale, weights);
    add_weights(b->right, b->op == BinaryOp::add ? scale : -scale, weights);
  } else if (const Literal* divisor = as<Literal>(b->right); divisor && b->op == BinaryOp::divide) {
    add_weights(b->left, scale / divisor->value, weights);
  } else if (const Literal* factor = as<Literal>(b->left); factor && b->op == BinaryOp::multiply) {
    add_weights(b->right, scale * factor->value, weights);
  }
}

Polynomial Expansion::expand(const Expr& e, const std::set<std::string>& carried) {
  ++work_;
  if (!is_complete()) return {};
  if (is_uniform(e)) {
    const Coefficient value = uniform(e);
    return value.empty() ? Polynomial{} : Polynomial{{{}, value}};
  }
  if (const Local* l = as<Local>(e)) {
    const auto let =
        std::find_if(kernel_.lets.begin(), kernel_.lets.end(), [&](const Let& x) { return x.name == l->name; });
    require(let != kernel_.lets.end(), "a let is defined before its use");
    return expand(let->value, carried);
  }
  if (const Neg* n = as<Neg>(e)) return negated(expand(n->operand, carried));
  if (const Binary* b = as<Binary>(e)) return expand_binary(e, *b, carried);
  return atom(e);
}

Polynomial Expansion::expand_binary(const Expr& e, const Binary& b, const std::set<std::string>& carried) {
  const std::optional<Coefficient> below =
      b.op == BinaryOp::divide && is_uniform(b.right) ? inverse(b.right) : std::nullopt;
  const Literal* exponent = as<Literal>(b.right);
  const bool square = b.op == BinaryOp::power && exponent && exponent->value == 2;
  const bool both = b.op == BinaryOp::add || b.op == BinaryOp::subtract || b.op == BinaryOp::multiply;
  if (!both && !below && !square) return atom(e);
  Polynomial left = expand(b.left, carried);  // first: atoms are numbered in order of appearance
  if (below) return times(closed(left, carried), Polynomial{{{}, *below}});
  if (square) return times(closed(left, {}), closed(left, {}));
  const Polynomial right = expand(b.right, carried);
  if (b.op == BinaryOp::multiply) return times(closed(left, carried), closed(right, carried));
  return sum(std::move(left), b.op == BinaryOp::add ? right : negated(right));
}

Polynomial Expansion::times(const Polynomial& a, const Polynomial& b) {
  work_ += a.size() * b.size();
  return is_complete() ? product(a, b) : Polynomial{};
}

bool Expansion::is_open(const Powers& monomial, const std::set<std::string>& carried) const {
  return std::any_of(monomial.begin(), monomial.end(), [&](const auto& factor) {
    const Atom& atom = atoms_[factor.first];
    const Access* access = atom.definition ? nullptr : as<Access>(atom.value);
    return access && carried.contains(access->field);
  });
}

/// `p` with all its terms that are not open combined into one atom, with their common coefficient outside.
Polynomial Expansion::closed(const Polynomial& p, const std::set<std::string>& carried) {
  Polynomial open, rest;
  for (const auto& term : p) (is_open(term.first, carried) ? open : rest).insert(term);
  if (rest.size() < 2) return p;
  const Coefficient first = rest.begin()->second;
  const bool shared = std::all_of(rest.begin(), rest.end(), [&](const auto& term) {
    return term.second == first || negated(term.second) == first;
  });
  if (!shared) return sum(std::move(open), {{{{atoms_.of(rest), 1}}, unit_coefficient}});
  Polynomial signs;
  for (const auto& [monomial, coefficient] : rest)
    signs[monomial] = coefficient == first ? unit_coefficient : negated(unit_coefficient);
  return sum(std::move(open), {{{{atoms_.of(signs), 1}}, first}});
}

std::optional<Coefficient> Expansion::uniform_binary(const Binary& b) {
  const bool both = b.op == BinaryOp::add || b.op == BinaryOp::subtract || b.op == BinaryOp::multiply;
  const bool square = b.op == BinaryOp::power && is_literal(b.right, 2);
  if (!both && !square && b.op != BinaryOp::divide) return std::nullopt;
  const Coefficient left = uniform(b.left);
  if (square) return product(left, left);
  if (b.op == BinaryOp::divide) {
    const std::optional<Coefficient> below = inverse(b.right);
    return below ? std::optional(product(left, *below)) : std::nullopt;
  }
  const Coefficient right = uniform(b.right);
  if (b.op == BinaryOp::multiply) return product(left, right);
  return sum(left, b.op == BinaryOp::add ? right : negated(right));
}

Coefficient Expansion::uniform(const Expr& e) {
  if (const Literal* l = as<Literal>(e)) return l->value == 0 ? Coefficient{} : Coefficient{{{}, l->value}};
  if (const Neg* n = as<Neg>(e)) return negated(uniform(n->operand));
  if (const Binary* b = as<Binary>(e)) {
    const std::optional<Coefficient> sum = uniform_binary(*b);
    if (sum) return *sum;
  }
  return {{{{atoms_.of(e, true), 1}}, 1.0}};
}

/// 1/e, unless e is 0.
std::optional<Coefficient> Expansion::inverse(const Expr& e) {
  const Coefficient value = uniform(e);
  if (value.empty()) return std::nullopt;
  if (value.size() > 1) return Coefficient{{{{atoms_.of(e, true), -1}}, 1.0}};
  Powers below;
  for (const auto& [atom, exponent] : value.begin()->first) below[atom] = -exponent;
  const double number = 1 / value.begin()->second;
  if (!std::isnormal(number)) return std::nullopt;
  return Coefficient{{below, number}};
}

}  // namespace dpde::stencil
