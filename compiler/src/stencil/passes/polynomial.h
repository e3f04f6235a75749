// SPDX-License-Identifier: Apache-2.0
// Sums of products, for the algebra of updates: sum over k of coefficient[k] * product of atoms^exponent. An atom is an
// indivisible expression: a read, a function, a sum that is not multiplied out. Coefficients are sums of products of
// uniform atoms.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

using Powers = std::map<int, int>;  // atom -> exponent, none 0
using Coefficient = std::map<Powers, double>;
using Polynomial = std::map<Powers, Coefficient>;
inline const Coefficient unit_coefficient = {{{}, 1.0}};

struct Atom {
  Expr value;  // if there is no definition
  bool uniform = false;
  std::optional<Polynomial> definition;
};

/// True if `e` is uniform in space.
bool is_uniform(const Expr& e);

class Atoms {
 public:
  int of(const Expr& value, bool uniform);
  int of(const Polynomial& definition);
  const Atom& operator[](int index) const { return atoms_[index]; }
  int size() const { return static_cast<int>(atoms_.size()); }

 private:
  std::vector<Atom> atoms_;
  std::unordered_multimap<std::size_t, int> by_hash_;  // of values of atoms without a definition -> index
};

Coefficient negated(Coefficient coefficient);
Polynomial negated(Polynomial p);
Coefficient sum(Coefficient a, const Coefficient& b);
Polynomial sum(Polynomial a, const Polynomial& b);
Powers product(Powers a, const Powers& b);
Coefficient product(const Coefficient& a, const Coefficient& b);
Polynomial product(const Polynomial& a, const Polynomial& b);
/// `monomial` without one factor `atom`.
Powers without(Powers monomial, int atom);

/// Expands expressions to polynomials. A product is multiplied out over the terms of a sum that read one of the
/// `carried` fields; the rest of the sum is an atom (so that differences of other fields stay exact).
class Expansion {
 public:
  Expansion(const Kernel& kernel, Atoms& atoms) : kernel_(kernel), atoms_(atoms) {}

  Polynomial expand(const Expr& e, const std::set<std::string>& carried);
  /// False once the expansion of nested lets or sums has taken too long; results of `expand` are then invalid.
  bool is_complete() const { return work_ <= most_work; }
  /// Fields u with a term u[k] * (number + ...) in `e`: an update u + dt*(...) has rounding errors of the size of u's,
  /// so that c*u[k] may be added to it in any order while |c| is at most about 1.
  std::set<std::string> carried_fields(const Expr& e);
  /// Numeric weights of fields at offset 0 in an update such as u + dt*(...) or (u + 2*v)/3 + dt*(...).
  std::map<std::string, double> weights(const Expr& e);

 private:
  Polynomial expand_binary(const Expr& e, const Binary& b, const std::set<std::string>& carried);
  void add_weights(const Expr& e, double scale, std::map<std::string, double>& weights);
  Polynomial closed(const Polynomial& p, const std::set<std::string>& carried);
  bool is_open(const Powers& monomial, const std::set<std::string>& carried) const;
  Polynomial atom(const Expr& e) { return {{{{atoms_.of(e, false), 1}}, {{{}, 1.0}}}}; }
  Coefficient uniform(const Expr& e);
  std::optional<Coefficient> uniform_binary(const Binary& b);
  std::optional<Coefficient> inverse(const Expr& e);
  Polynomial times(const Polynomial& a, const Polynomial& b);

  static constexpr std::size_t most_work = 100'000;  // nodes visited and terms multiplied
  const Kernel& kernel_;
  Atoms& atoms_;
  std::size_t work_ = 0;
};

}  // namespace dpde::stencil
