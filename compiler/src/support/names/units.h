// SPDX-License-Identifier: Apache-2.0
// Units as products of powers of common symbols: m/s, kg*m^2, 1/day. Their dimension is given by seven exponents; their
// scale is the value in SI units. Values are never converted.
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
/// The fraction with a denominator of at most 12 that equals the number; nullopt if there is none.
std::optional<Fraction> fraction_near(double value);

class Unit {
 public:
  Unit() = default;  // dimensionless
  /// A symbol of the table: kg, Pa, km, day.
  static std::optional<Unit> of_symbol(const std::string& symbol);

  Unit times(const Unit& other) const;
  Unit to(Fraction power) const;
  Unit per(const Unit& other) const { return times(other.to({-1, 1})); }

  /// Exponents of m, kg, s, A, K, mol, cd.
  using Dimension = std::array<Fraction, 7>;
  Dimension dimension() const;
  /// Value in SI units.
  double scale() const;
  bool has_dimension_of(const Unit& other) const { return dimension() == other.dimension(); }
  /// Whether dimension and scale are equal.
  bool is_same_as(const Unit& other) const;
  bool is_pure_number() const { return is_same_as({}); }
  /// Readable form: "kg*m/s^2", "1/day"; "1" if dimensionless.
  std::string text() const;

 private:
  std::map<std::string, Fraction> powers_;  // nonzero powers of symbols in the table
};

/// Why a text is no unit: the invalid part, and advice.
struct UnitMistake {
  std::string part, hint;
};
/// m/s, m^2, W/(m*K), s^(1/2), 1/s, 1
std::variant<Unit, UnitMistake> read_unit(std::string_view text);

/// The known symbols, without prefixes.
std::vector<std::string> unit_symbols();

}  // namespace dpde
