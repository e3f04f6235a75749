// SPDX-License-Identifier: Apache-2.0
#include "support/names/units.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

namespace dpde {

namespace {

/// A symbol with the exponents of m, kg, s, A, K, mol, cd, and its value in SI units (SI brochure, 9th edition, tables
/// 2, 4 and 8).
struct Symbol {
  std::string_view name;
  std::array<int, 7> exponents;
  double scale;
  bool takes_prefix;
};
constexpr double pi = 3.14159265358979323846;
constexpr Symbol symbols[] = {
    {"m", {1}, 1, true},
    {"g", {0, 1}, 1e-3, true},
    {"s", {0, 0, 1}, 1, true},
    {"A", {0, 0, 0, 1}, 1, true},
    {"K", {0, 0, 0, 0, 1}, 1, true},
    {"mol", {0, 0, 0, 0, 0, 1}, 1, true},
    {"cd", {0, 0, 0, 0, 0, 0, 1}, 1, true},
    {"rad", {}, 1, true},
    {"sr", {}, 1, false},
    {"deg", {}, pi / 180, false},
    {"Hz", {0, 0, -1}, 1, true},
    {"N", {1, 1, -2}, 1, true},
    {"Pa", {-1, 1, -2}, 1, true},
    {"J", {2, 1, -2}, 1, true},
    {"W", {2, 1, -3}, 1, true},
    {"C", {0, 0, 1, 1}, 1, true},
    {"V", {2, 1, -3, -1}, 1, true},
    {"F", {-2, -1, 4, 2}, 1, true},
    {"ohm", {2, 1, -3, -2}, 1, true},
    {"S", {-2, -1, 3, 2}, 1, true},
    {"Wb", {2, 1, -2, -1}, 1, true},
    {"T", {0, 1, -2, -1}, 1, true},
    {"H", {2, 1, -2, -2}, 1, true},
    {"L", {3}, 1e-3, true},
    {"bar", {-1, 1, -2}, 1e5, true},
    {"eV", {2, 1, -2}, 1.602176634e-19, true},
    {"min", {0, 0, 1}, 60, false},
    {"h", {0, 0, 1}, 3600, false},
    {"day", {0, 0, 1}, 86400, false},
    {"year", {0, 0, 1}, 31557600, false},  // 365.25 days
};

struct Prefix {
  std::string_view name;
  double factor;
};
constexpr Prefix prefixes[] = {{"da", 1e1}, {"T", 1e12},  {"G", 1e9},  {"M", 1e6},  {"k", 1e3},
                               {"h", 1e2},  {"d", 1e-1},  {"c", 1e-2}, {"m", 1e-3}, {"u", 1e-6},
                               {"n", 1e-9}, {"p", 1e-12}, {"f", 1e-15}};

struct Known {
  const Symbol* symbol;
  double factor;
};
const Symbol* find_symbol(std::string_view name) {
  const auto* found = std::ranges::find(symbols, name, &Symbol::name);
  return found == std::end(symbols) ? nullptr : found;
}
/// Symbols without prefix come first: min is not a milli-inch, but mm is a millimetre.
std::optional<Known> find_known(std::string_view name) {
  if (const Symbol* symbol = find_symbol(name)) return Known{symbol, 1};
  for (const Prefix& prefix : prefixes) {
    if (!name.starts_with(prefix.name)) continue;
    const Symbol* symbol = find_symbol(name.substr(prefix.name.size()));
    if (symbol != nullptr && symbol->takes_prefix) return Known{symbol, prefix.factor};
  }
  return std::nullopt;
}

/// In lowest terms; limited to a size far beyond realistic exponents.
Fraction reduced(std::int64_t above, std::int64_t below) {
  constexpr std::int64_t largest = 1000000;
  const std::int64_t common = std::max<std::int64_t>(1, std::gcd(above, below)) * (below < 0 ? -1 : 1);
  return {static_cast<int>(std::clamp(above / common, -largest, largest)),
          static_cast<int>(std::min(below / common, largest))};
}
Fraction sum_of(Fraction a, Fraction b) {
  return reduced(std::int64_t{a.above} * b.below + std::int64_t{b.above} * a.below, std::int64_t{a.below} * b.below);
}
Fraction product_of(Fraction a, Fraction b) {
  return reduced(std::int64_t{a.above} * b.above, std::int64_t{a.below} * b.below);
}

/// "m", "m^2", "m^(1/2)"
std::string power_text(const std::string& symbol, Fraction power) {
  if (power == Fraction{1, 1}) return symbol;
  if (power.below == 1) return fmt::format("{}^{}", symbol, power.above);
  return fmt::format("{}^({}/{})", symbol, power.above, power.below);
}

constexpr const char* known_units =
    "known are m, g, s, A, K, mol, cd, N, Pa, J, W, V, C, F, ohm, S, Wb, T, H, Hz, rad, deg, L, bar, eV, min, h, "
    "day, year, with prefixes as in km; 1 is a pure number";
constexpr int largest_power = 99;

class UnitReader {
 public:
  explicit UnitReader(std::string_view text) : text_(text) {}

  std::variant<Unit, UnitMistake> read() {
    const Unit unit = product();
    skip_blanks();
    if (!mistake_ && at_ < text_.size()) fail(std::string(text_.substr(at_)), written_hint);
    if (mistake_) return *mistake_;
    return unit;
  }

 private:
  static constexpr const char* written_hint = "a unit is written m/s, kg*m/s^2, W/(m*K) or 1/s";
  static constexpr int most_nesting = 8;

  void fail(std::string part, std::string hint) {
    if (!mistake_) mistake_ = {std::move(part), std::move(hint)};
  }
  void skip_blanks() {
    while (at_ < text_.size() && text_[at_] == ' ') ++at_;
  }
  bool accept(char c) {
    skip_blanks();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  Unit product() {
    Unit unit = factor();
    while (!mistake_) {
      if (accept('*'))
        unit = unit.times(factor());
      else if (accept('/'))
        unit = unit.per(factor());
      else
        break;
    }
    return unit;
  }

  Unit factor() {
    Unit unit = atom();
    if (!mistake_ && accept('^')) unit = unit.to(exponent());
    return unit;
  }

  Unit atom() {
    skip_blanks();
    if (accept('(')) {
      if (++nesting_ > most_nesting) fail("(", written_hint);
      Unit inside = mistake_ ? Unit() : product();
      if (!accept(')')) fail(std::string(text_), written_hint);
      --nesting_;
      return inside;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) ++at_;
    const std::string symbol(text_.substr(begin, at_ - begin));
    if (symbol == "1") return {};
    if (symbol.empty() && text_.ends_with("**")) fail(std::string(text_), "a power is written m^2");
    if (symbol.empty()) fail(std::string(text_), written_hint);
    const std::optional<Unit> unit = Unit::of_symbol(symbol);
    if (!unit) fail(symbol, hint_for(symbol));
    return unit.value_or(Unit());
  }

  static std::string hint_for(const std::string& symbol) {
    if (symbol == "degC" || symbol == "degF" || symbol == "celsius")
      return "its zero is not that of K, so that it cannot stand in products: give temperatures in K";
    if (symbol == "Ohm") return "write ohm";
    if (symbol == "sec" || symbol == "second" || symbol == "seconds") return "write s";
    if (symbol == "hr" || symbol == "hour" || symbol == "hours") return "write h";
    return known_units;
  }

  /// 2, -1, (1/2)
  Fraction exponent() {
    const bool has_parens = accept('(');
    const int above = whole();
    const int below = has_parens && accept('/') ? whole() : 1;
    if (has_parens && !accept(')')) fail(std::string(text_), written_hint);
    if (below == 0) fail("0", written_hint);
    return mistake_ ? Fraction{1, 1} : reduced(above, below);
  }
  int whole() {
    const bool is_negative = accept('-');
    skip_blanks();
    int value = 0;
    const char* end = text_.data() + text_.size();
    const auto result = std::from_chars(text_.data() + at_, end, value);
    if (result.ec != std::errc() || value > largest_power) fail(std::string(text_), written_hint);
    at_ = static_cast<std::size_t>(result.ptr - text_.data());
    return is_negative ? -value : value;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int nesting_ = 0;
  std::optional<UnitMistake> mistake_;
};

}  // namespace

std::optional<Fraction> fraction_near(double value) {
  if (!(std::abs(value) <= largest_power)) return std::nullopt;
  for (int below = 1; below <= 12; ++below) {
    const double above = std::round(value * below);
    if (std::abs(above - value * below) < 1e-9) return reduced(static_cast<int>(above), below);
  }
  return std::nullopt;
}

std::optional<Unit> Unit::of_symbol(const std::string& symbol) {
  if (!find_known(symbol)) return std::nullopt;
  Unit unit;
  unit.powers_.emplace(symbol, Fraction{1, 1});
  return unit;
}

Unit Unit::times(const Unit& other) const {
  Unit result = *this;
  for (const auto& [symbol, power] : other.powers_) {
    Fraction& sum = result.powers_[symbol];
    sum = sum_of(sum, power);
    if (sum.above == 0) result.powers_.erase(symbol);
  }
  return result;
}

Unit Unit::to(Fraction power) const {
  Unit result;
  for (const auto& [symbol, own] : powers_) {
    if (power.above != 0) result.powers_.emplace(symbol, product_of(own, power));
  }
  return result;
}

Unit::Dimension Unit::dimension() const {
  Dimension sum;
  for (const auto& [symbol, power] : powers_) {
    const std::optional<Known> known = find_known(symbol);
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] = sum_of(sum[i], product_of({known->symbol->exponents[i], 1}, power));
  }
  return sum;
}

double Unit::scale() const {
  double scale = 1;
  for (const auto& [symbol, power] : powers_) {
    const std::optional<Known> known = find_known(symbol);
    scale *= std::pow(known->factor * known->symbol->scale, power.value());
  }
  return scale;
}

bool Unit::is_same_as(const Unit& other) const {
  constexpr double rounding = 1e-9;  // rounding of products of powers
  return has_dimension_of(other) && std::abs(scale() - other.scale()) <= rounding * other.scale();
}

std::string Unit::text() const {
  std::vector<std::string> above, below;
  for (const auto& [symbol, power] : powers_) {
    if (power.above > 0) above.push_back(power_text(symbol, power));
    if (power.above < 0) below.push_back(power_text(symbol, {-power.above, power.below}));
  }
  std::string text = above.empty() ? "1" : fmt::format("{}", fmt::join(above, "*"));
  if (below.size() == 1) text += "/" + below.front();
  if (below.size() > 1) text += fmt::format("/({})", fmt::join(below, "*"));
  return text;
}

std::vector<std::string> unit_symbols() {
  std::vector<std::string> names;
  for (const Symbol& symbol : symbols) names.emplace_back(symbol.name);
  return names;
}

std::variant<Unit, UnitMistake> read_unit(std::string_view text) { return UnitReader(text).read(); }

}  // namespace dpde
