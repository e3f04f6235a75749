// SPDX-License-Identifier: Apache-2.0
// Loop expressions as C++ expressions with the fewest parentheses. Conditions are C++ bools; all other values are
// double, or float in single precision. Values are converted where a number is needed for a bool, or the reverse.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "loop/loop.h"

namespace dpde::codegen {

/// C++ names of the leaves.
struct CppLeaves {
  std::vector<std::string> params, counters, uniforms, lets;
  std::vector<std::string> loads;  // one for each stream, with the index: u_m1[i]
  std::vector<bool> let_is_truth;
  std::string elementary = "";  // prefix of the names of sin, exp, pow, ...
  std::function<std::string(const loop::Inside&)> inside;
  /// Returns the call that interpolates; the displacements are given as text.
  std::function<std::string(const loop::Interp&, const std::vector<std::string>&)> interp;
};

class CppExpression {
 public:
  CppExpression(const CppLeaves& leaves, Precision real) : leaves_(leaves), real_(real) {}

  /// `e` as a number, in parentheses if it binds weaker than `least` (precedence of vocabulary.h).
  std::string number(const loop::Expr& e, int least = 0) const;
  /// `e` as a bool.
  std::string truth(const loop::Expr& e, int least = 0) const;
  /// Whether `e` is a condition: comparison, and, or, inside, or a let of such.
  bool is_truth(const loop::Expr& e) const;

 private:
  struct Piece {
    std::string text;
    int precedence;
  };
  Piece number_piece(const loop::Expr& e) const;
  Piece truth_piece(const loop::Expr& e) const;
  Piece binary(const loop::Binary& b) const;
  Piece power(const loop::Binary& b) const;
  Piece rounded(const loop::Rounded& r) const;
  Piece negation(const loop::Neg& n) const;
  std::string call(const loop::Call& c) const;
  std::string interp(const loop::Interp& i) const;
  static std::string enclosed(const Piece& piece, int least);

  const CppLeaves& leaves_;
  Precision real_;
};

/// "double" or "float"
std::string_view cpp_real(Precision real);
/// A number, rounded to `real`, as a C++ literal of that type that reads back to the same value.
std::string cpp_number(double value, Precision real);

/// Whether a Rounded product needs its own function to prevent contraction. Other operands are already calls.
bool is_rounded_product(const loop::Rounded& r);

/// Whether it is x^2 or x^3 of a leaf, which is written as a product.
bool is_small_power(const loop::Binary& b);

}  // namespace dpde::codegen
