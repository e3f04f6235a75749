// SPDX-License-Identifier: Apache-2.0
// The elementary functions of cells (dpde/elementary.h) against the C library's in long double: errors in units of the
// last place of the exact value, on random arguments of every size and on hard ones. The limits are those that
// compiler/src/codegen/README.md states.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "codegen/elementary_functions.h"
#include "dpde/elementary_cells.h"
#include "dpde/runtime/float_mode.h"

namespace dpde {
namespace {

using Reference = long double (*)(long double);

/// The distance of neighbours of T around the exact value.
template <class T>
long double last_place(long double exact) {
  using Limits = std::numeric_limits<T>;
  int exponent = 0;
  std::frexp(exact, &exponent);
  return std::ldexp(1.0L, std::max(exponent, Limits::min_exponent) - Limits::digits);
}

/// In units of the last place; values beyond the largest number count as infinite.
template <class T>
double error_of(T value, long double exact) {
  if (std::isnan(exact) || std::isnan(value))
    return std::isnan(exact) && std::isnan(value) ? 0 : std::numeric_limits<double>::infinity();
  const T nearest = static_cast<T>(exact);
  if (std::isinf(nearest) || std::isinf(value)) return nearest == value ? 0 : std::numeric_limits<double>::infinity();
  if (value == 0 && exact == 0)
    return std::signbit(value) == std::signbit(exact) ? 0 : std::numeric_limits<double>::infinity();
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / last_place<T>(exact));
}

/// Of every exponent, both signs: more of those around 1, where cells are.
template <class T>
std::vector<T> arguments() {
  using Limits = std::numeric_limits<T>;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(-1, 1);
  std::vector<T> result{0,
                        Limits::infinity(),
                        Limits::quiet_NaN(),
                        Limits::max(),
                        Limits::min(),
                        Limits::denorm_min(),
                        Limits::epsilon(),
                        1,
                        T(0.625),
                        T(22)};
  for (int exponent = Limits::min_exponent - Limits::digits; exponent < Limits::max_exponent; ++exponent) {
    const int count = std::abs(exponent) < 12 ? 3000 : 40;
    for (int i = 0; i < count; ++i) result.push_back(static_cast<T>(std::ldexp(part(random), exponent)));
  }
  for (int i = 0; i < 20000; ++i) result.push_back(static_cast<T>(part(random) * (i % 2 == 0 ? 750 : 110)));
  for (int i = 0; i < 20000; ++i) result.push_back(static_cast<T>(1 + part(random) * std::ldexp(1.0, -i / 1000)));
  // Next to multiples of pi/2, the small ones and those of every size.
  for (int i = 1; i < 20000; ++i) {
    const uint64_t multiple = i < 10000 ? static_cast<uint64_t>(i) : random() >> (random() % 64);
    const T near = static_cast<T>(static_cast<long double>(multiple) * std::acos(0.0L));
    result.insert(result.end(), {near, std::nextafter(near, T(0)), std::nextafter(near, Limits::max())});
  }
  const std::size_t count = result.size();
  for (std::size_t i = 0; i < count; ++i) result.push_back(-result[i]);
  return result;
}

template <class Function, class T>
void expect_error_below(const char* name, Reference reference, double limit) {
  double worst = 0;
  T at = 0;
  for (const T x : arguments<T>()) {
    const double error = error_of(elementary::one<Function>(x), reference(x));
    if (error > worst) worst = error, at = x;
  }
  EXPECT_LE(worst, limit) << name << " of " << sizeof(T) << " bytes at " << at;
  EXPECT_GT(worst, 0.3) << name;  // or nothing was compared
  ::testing::Test::RecordProperty(name + std::to_string(sizeof(T)), std::to_string(worst));
}

/// `limits(function, name, reference, largest error of doubles, of floats)` for each function of one argument.
template <class Limits>
void for_each_function(const Limits& limits) {
  limits(elementary::Sin(), "sin", std::sin, 0.9, 0.9);
  limits(elementary::Cos(), "cos", std::cos, 0.9, 0.9);
  limits(elementary::Tan(), "tan", std::tan, 2.2, 2.2);
  limits(elementary::Asin(), "asin", std::asin, 2.0, 2.0);
  limits(elementary::Acos(), "acos", std::acos, 2.0, 2.0);
  limits(elementary::Atan(), "atan", std::atan, 2.0, 2.0);
  limits(elementary::Exp(), "exp", std::exp, 1.0, 1.0);
  limits(elementary::Log(), "log", std::log, 0.8, 0.8);
  limits(elementary::Erf(), "erf", std::erf, 1.3, 1.2);
  limits(elementary::Tanh(), "tanh", std::tanh, 1.4, 1.4);
  limits(elementary::Sinh(), "sinh", std::sinh, 1.8, 1.8);
  limits(elementary::Cosh(), "cosh", std::cosh, 1.9, 1.8);
}

TEST(Elementary, AreAllMeasured) {
  std::set<std::string_view> measured, expected;
  for_each_function([&](auto, const char* name, Reference, double, double) { measured.insert(name); });
  for (const Fn fn : every_function()) {
    if (codegen::is_elementary(fn)) expected.insert(name_of(fn));
  }
  EXPECT_EQ(measured, expected);
}

TEST(Elementary, ErrorsInTheLastPlace) {
  for_each_function([](auto function, const char* name, Reference reference, double of_doubles, double of_floats) {
    expect_error_below<decltype(function), double>(name, reference, of_doubles);
    expect_error_below<decltype(function), float>(name, reference, of_floats);
  });
}

/// Bases and exponents whose powers have every size; and what is special.
template <class T>
std::vector<std::pair<T, T>> pairs() {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> part(-1, 1);
  const double most = std::log(static_cast<double>(std::numeric_limits<T>::max()));
  std::vector<std::pair<T, T>> result;
  for (int i = 0; i < 200000; ++i) {
    const T base = static_cast<T>(std::exp(part(random) * (i % 3 == 0 ? 0.05 : i % 3 == 1 ? 2 : most)));
    const double largest = 1.05 * most / std::abs(std::log(static_cast<double>(base)));
    result.emplace_back(base, static_cast<T>(part(random) * (i % 2 == 0 ? largest : 3)));
  }
  const T infinity = std::numeric_limits<T>::infinity(), nan = std::numeric_limits<T>::quiet_NaN();
  const std::vector<T> special{0,
                               T(-0.0),
                               1,
                               -1,
                               T(0.5),
                               T(-0.5),
                               2,
                               3,
                               -2,
                               -3,
                               T(1.5),
                               T(-1.5),
                               infinity,
                               -infinity,
                               nan,
                               std::numeric_limits<T>::denorm_min(),
                               std::numeric_limits<T>::max(),
                               T(1e10),
                               T(-1e10)};
  for (const T base : special) {
    for (const T exponent : special) result.emplace_back(base, exponent);
  }
  return result;
}

template <class T>
void expect_error_of_pow_below(double limit) {
  double worst = 0;
  std::pair<T, T> at;
  for (const auto& [base, exponent] : pairs<T>()) {
    const double error = error_of(elementary::one<elementary::Pow>(base, exponent),
                                  std::pow(static_cast<long double>(base), static_cast<long double>(exponent)));
    if (error > worst) worst = error, at = {base, exponent};
  }
  EXPECT_LE(worst, limit) << at.first << " ^ " << at.second;
  EXPECT_GT(worst, 0.3);
  ::testing::Test::RecordProperty("pow" + std::to_string(sizeof(T)), std::to_string(worst));
}

/// While programs run subnormal numbers are 0. What is normal keeps its errors, and what is not is 0 or the smallest
/// normal number.
template <class Function, class T>
void expect_error_without_subnormals(const char* name, Reference reference, double limit) {
  const T smallest = std::numeric_limits<T>::min();
  double worst = 0;
  T at = 0;
  for (const T x : arguments<T>()) {
    if (x != 0 && std::abs(x) < smallest) continue;
    T value;
    {
      const FloatScope without_subnormals;
      value = elementary::one<Function>(x);
    }
    const long double exact = reference(x);
    if (exact != 0 && std::abs(exact) < static_cast<long double>(smallest)) {
      EXPECT_TRUE(value == 0 || std::abs(value) == smallest) << name << " of " << x;
      continue;
    }
    const double error = error_of(value, exact);
    if (error > worst) worst = error, at = x;
  }
  EXPECT_LE(worst, limit) << name << " of " << sizeof(T) << " bytes at " << at;
}

TEST(Elementary, ErrorsInTheLastPlaceWithoutSubnormals) {
  for_each_function([](auto function, const char* name, Reference reference, double of_doubles, double of_floats) {
    expect_error_without_subnormals<decltype(function), double>(name, reference, of_doubles);
    expect_error_without_subnormals<decltype(function), float>(name, reference, of_floats);
  });
}

TEST(Elementary, ErrorsOfPowersInTheLastPlace) {
  expect_error_of_pow_below<double>(1.5);
  expect_error_of_pow_below<float>(0.51);
}

TEST(Elementary, WhatIsExactInTheLibraryIsExactHere) {
  EXPECT_EQ(elementary::one<elementary::Cos>(0.0), 1.0);
  EXPECT_EQ(elementary::one<elementary::Exp>(0.0), 1.0);
  EXPECT_EQ(elementary::one<elementary::Exp>(-0.0f), 1.0f);
  EXPECT_EQ(elementary::one<elementary::Log>(1.0), 0.0);
  EXPECT_EQ(elementary::one<elementary::Cosh>(0.0), 1.0);
  EXPECT_EQ(elementary::one<elementary::Tanh>(30.0), 1.0);
  EXPECT_EQ(elementary::one<elementary::Pow>(2.0, 10.0), 1024.0);
  EXPECT_EQ(elementary::one<elementary::Pow>(1.0, 1e300), 1.0);
  EXPECT_EQ(elementary::one<elementary::Acos>(1.0), 0.0);
  EXPECT_EQ(elementary::one<elementary::Atan>(std::numeric_limits<double>::infinity()), std::acos(0.0));
  EXPECT_TRUE(std::signbit(elementary::one<elementary::Atan>(-0.0)));
  EXPECT_TRUE(std::signbit(elementary::one<elementary::Asin>(-0.0)));
  EXPECT_TRUE(std::signbit(elementary::one<elementary::Sin>(-0.0)));
  EXPECT_TRUE(std::signbit(elementary::one<elementary::Tanh>(-0.0)));
}

}  // namespace
}  // namespace dpde
