// SPDX-License-Identifier: Apache-2.0
// The table of uniforms of a module: values that are constant in space, each defined once.
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
  /// `taken`: names of fields, lets and sums, which uniforms must not have. `real`: precision of values in rows, and of
  /// uniforms as rows read them. `values`: known values of parameters, for the magnitude of uniforms.
  UniformTable(std::vector<std::string> params, NameSupply taken, Precision real,
               const std::map<std::string, double>& values);

  /// The parameter as a leaf of a uniform's definition; a name seen for the first time becomes a parameter.
  Expr param(const std::string& name);

  /// From now on these names are counters, not parameters.
  void set_counters(std::vector<std::string> in_scope) { in_scope_ = std::move(in_scope); }
  int counter(const std::string& name);

  /// `definition` (an expression of Literal, Param and Uniform) as it appears in a row: a number stays a number, any
  /// other expression becomes one Uniform. `wish` names it if it is new and the name is free.
  Expr use(const Expr& definition, const std::string& wish = "");
  int index_of(const Expr& definition, const std::string& wish = "");

  Precision real() const { return real_; }
  /// The value of a definition, with 1 for unknown parameters.
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
  /// Whether products of some of the factors may exceed the range of f32 although the whole expression does not, such
  /// as the square of a divisor in a derivative.
  bool hangs_on_order(const UniformTable& uniforms) const;
  /// All factors, if they are uniform: a definition of Params and Literals.
  Expr definition() const;
  /// uniform * above / below, in a row. If the uniform exceeds the range of f32, powers of two are split off and
  /// multiplied between the other factors.
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
