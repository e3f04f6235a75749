// SPDX-License-Identifier: Apache-2.0
// Units of quantities: products of powers of the symbols that people write, m/s, kg*m^2, 1/day. What two of them have
// in common is their dimension, seven exponents; a symbol also has a scale, how many SI units it is. Nothing is
// converted.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace dpde {

/// above/below in lowest terms, below > 0.
struct Fraction {
  int above = 0, below = 1;
  double value() const { return static_cast<double>(above) / below; }
  bool operator==(const Fraction&) const = default;
};
/// Of a number that is one with a denominator of at most 12.
std::optional<Fraction> fraction_near(double value);

class Unit {
 public:
  Unit() = default;  // of a pure number
  /// What a table knows: kg, Pa, km, day.
  static std::optional<Unit> of_symbol(const std::string& symbol);

  Unit times(const Unit& other) const;
  Unit to(Fraction power) const;
  Unit per(const Unit& other) const { return times(other.to({-1, 1})); }

  /// Exponents of m, kg, s, A, K, mol, cd.
  using Dimension = std::array<Fraction, 7>;
  Dimension dimension() const;
  /// In SI units.
  double scale() const;
  bool has_dimension_of(const Unit& other) const { return dimension() == other.dimension(); }
  /// Of one dimension and one scale.
  bool is_same_as(const Unit& other) const;
  bool is_pure_number() const { return is_same_as({}); }
  /// As a person would write it: "kg*m/s^2", "1/day"; "1" of a pure number.
  std::string text() const;

 private:
  std::map<std::string, Fraction> powers_;  // of symbols of the table, none 0
};

/// Why a text is no unit: the part of it that is none, and what to write.
struct UnitMistake {
  std::string part, hint;
};
/// m/s, m^2, W/(m*K), s^(1/2), 1/s, 1
std::variant<Unit, UnitMistake> read_unit(std::string_view text);

/// Those that are known, without prefixes.
std::vector<std::string> unit_symbols();

}  // namespace dpde
