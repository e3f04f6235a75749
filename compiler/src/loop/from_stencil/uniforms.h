// SPDX-License-Identifier: Apache-2.0
// The table of uniforms of a module: values that are the same at all points, each defined once.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "loop/loop.h"
#include "stencil/stencil.h"
#include "support/names/name_supply.h"

namespace dpde::loop {

class UniformTable {
 public:
  /// `taken`: names of fields, lets and sums, which no uniform may have. `real`: what rows hold values in, and so the
  /// uniforms that they read. `values` of parameters say how large these are.
  UniformTable(std::vector<std::string> params, NameSupply taken, Precision real,
               const std::map<std::string, double>& values);

  /// The parameter as a leaf of a uniform's definition; a name seen for the first time becomes a parameter.
  Expr param(const std::string& name);

  /// From now on these names are numbers of passes and no parameters.
  void set_counters(std::vector<std::string> in_scope) { in_scope_ = std::move(in_scope); }
  int counter(const std::string& name);

  /// `definition` (of Literal, Param, Uniform and what is built from them) as it appears in a row: numbers stay
  /// numbers, all else is one Uniform. `wish` names it if it is new and the name is free.
  Expr use(const Expr& definition, const std::string& wish = "");
  int index_of(const Expr& definition, const std::string& wish = "");

  Precision real() const { return real_; }
  /// The value of a definition, with 1 for what is not known.
  double value_of(const Expr& definition) const;
  std::vector<std::string> params() const { return params_; }
  std::vector<std::string> counters() const { return counters_; }
  std::vector<UniformDef> take() { return std::move(uniforms_); }

 private:
  std::string name_for(const Expr& definition, const std::string& wish);

  std::vector<std::string> params_, counters_, in_scope_;
  std::vector<UniformDef> uniforms_;
  std::unordered_multimap<std::size_t, int> by_hash_;  // of definitions -> index
  NameSupply names_;
  int next_number_ = 0;
  Precision real_;
  const std::map<std::string, double>& param_values_;
  std::vector<double> values_;  // of the uniforms
};

/// The uniform part of a product and the rest of it. Numbers are kept apart, so that 2*nu/(3*hx) stays readable.
class Factors {
 public:
  void negate() { negative_ = !negative_; }
  void add_number(double value, bool inverse);
  void add_uniform(const Expr& e, bool inverse) { (inverse ? uniform_below_ : uniform_above_).push_back(e); }
  void add_varying(const Expr& e, bool inverse) { (inverse ? below_ : above_).push_back(e); }

  bool is_uniform() const { return above_.empty() && below_.empty(); }
  /// Whether products of some of the factors may be no floats though all that a person wrote is one, as the square of a
  /// divisor in a derivative.
  bool hangs_on_order(const UniformTable& uniforms) const;
  /// All factors, when they are uniform: a definition of Params and Literals.
  Expr definition() const;
  /// uniform * above / below, in a row. What of the uniform is too large or small for a float stands between them.
  Expr varying(UniformTable& uniforms);

 private:
  Expr unsigned_definition() const;
  std::vector<Expr> take_powers(const UniformTable& uniforms);
  Expr between(const std::vector<Expr>& powers, UniformTable& uniforms) const;

  bool negative_ = false;
  double number_above_ = 1, number_below_ = 1;
  std::vector<Expr> uniform_above_, uniform_below_, above_, below_;
};

}  // namespace dpde::loop
