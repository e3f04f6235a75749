// SPDX-License-Identifier: Apache-2.0
#include "support/vocabulary.h"

#include "support/assert.h"

namespace dpde {

std::string_view spelling(BinaryOp op) {
  switch (op) {
    case BinaryOp::add: return "+";
    case BinaryOp::subtract: return "-";
    case BinaryOp::multiply: return "*";
    case BinaryOp::divide: return "/";
    case BinaryOp::power: return "^";
    case BinaryOp::less: return "<";
    case BinaryOp::less_equal: return "<=";
    case BinaryOp::greater: return ">";
    case BinaryOp::greater_equal: return ">=";
    case BinaryOp::equal: return "==";
    case BinaryOp::not_equal: return "!=";
    case BinaryOp::logical_and: return "and";
    case BinaryOp::logical_or: return "or";
  }
  unreachable("operator");
}

int precedence(BinaryOp op) {
  switch (op) {
    case BinaryOp::logical_or: return 1;
    case BinaryOp::logical_and: return 2;
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal: return 3;
    case BinaryOp::add:
    case BinaryOp::subtract: return 4;
    case BinaryOp::multiply:
    case BinaryOp::divide: return 5;
    case BinaryOp::power: return 7;
  }
  unreachable("operator");
}

std::string_view name_of(Fn fn) {
  switch (fn) {
    case Fn::sin: return "sin";
    case Fn::cos: return "cos";
    case Fn::tan: return "tan";
    case Fn::asin: return "asin";
    case Fn::acos: return "acos";
    case Fn::atan: return "atan";
    case Fn::sinh: return "sinh";
    case Fn::cosh: return "cosh";
    case Fn::tanh: return "tanh";
    case Fn::exp: return "exp";
    case Fn::log: return "log";
    case Fn::sqrt: return "sqrt";
    case Fn::abs: return "abs";
    case Fn::sign: return "sign";
    case Fn::floor: return "floor";
    case Fn::fraction: return "fraction";
    case Fn::min: return "min";
    case Fn::max: return "max";
  }
  unreachable("function");
}

std::optional<Fn> find_fn(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Fn::max); ++i) {
    if (name_of(static_cast<Fn>(i)) == name) return static_cast<Fn>(i);
  }
  return std::nullopt;
}

std::string_view name_of(Reduction reduction) {
  switch (reduction) {
    case Reduction::mean: return "mean";
    case Reduction::sum: return "sum";
    case Reduction::max: return "max";
    case Reduction::min: return "min";
  }
  unreachable("reduction");
}

std::optional<Reduction> find_reduction(std::string_view name) {
  for (int i = 0; i <= static_cast<int>(Reduction::min); ++i) {
    if (name_of(static_cast<Reduction>(i)) == name) return static_cast<Reduction>(i);
  }
  return std::nullopt;
}

std::string_view name_of(Precision real) { return real == Precision::f32 ? "f32" : "f64"; }

int bytes_of(Precision real) { return real == Precision::f32 ? 4 : 8; }

double rounded(double value, Precision real) { return real == Precision::f32 ? static_cast<float>(value) : value; }

int arity(Fn fn) { return fn == Fn::min || fn == Fn::max ? 2 : 1; }

}  // namespace dpde
