// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/transforms_from_ast.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/text/expr_from_ast.h"
#include "support/contains.h"

namespace dpde::stencil {

namespace {

/// phiN, inverseN or heaviside0. An N with many digits is read as one that is too large.
WaveFunction function_of(const std::string& name) {
  using enum WaveFunction::Kind;
  for (const WaveFunction::Kind kind : {phi, inverse, heaviside}) {
    const std::string_view word = name_of(kind);
    if (!name.starts_with(word) || name.size() == word.size()) continue;
    const std::string digits = name.substr(word.size());
    if (!std::ranges::all_of(digits, [](char c) { return c >= '0' && c <= '9'; })) continue;
    return {kind, digits.size() > 4 ? highest_function + 1 : std::stoi(digits)};
  }
  return {};
}

const ast::Call* function_call(const ast::Expr& e) {
  const ast::Call* call = std::get_if<ast::Call>(&e->kind);
  return call != nullptr && call->arguments.size() == 1 && function_of(call->callee) ? call : nullptr;
}

/// The product without its leading function, which is stored in `function`.
ast::Expr without_function(const ast::Expr& e, std::optional<ast::Expr>& function) {
  if (function_call(e) != nullptr) {
    function = e;
    return ast::Expr(ast::Node{ast::Number{1, "1"}, e.range()});
  }
  const ast::Binary* b = std::get_if<ast::Binary>(&e->kind);
  if (b == nullptr || (b->op != BinaryOp::multiply && b->op != BinaryOp::divide)) return e;
  const ast::Expr left = without_function(b->left, function);
  return function ? ast::Expr(ast::Node{ast::Binary{b->op, left, b->right}, e.range()}) : e;
}

/// Params, numbers and wave numbers.
class MultiplierReader : public ExprReader {
 public:
  MultiplierReader(const std::vector<std::string>& fields, DiagnosticSink& sink) : ExprReader(sink), fields_(fields) {}

 private:
  Expr read_name(const std::string& name, SourceRange range) override {
    if (contains(fields_, name)) return refuse(name, range);
    return name == "pi" ? Expr(std::numbers::pi) : param(name);
  }
  Expr read_offsets(const ast::Offsets& offsets, SourceRange range) override { return refuse(offsets.name, range); }
  Expr read_interp(const ast::Call& call, SourceRange range) override { return refuse(call.callee, range); }
  Expr read_unknown(const ast::Call& call, SourceRange range) override {
    if (!function_of(call.callee)) return ExprReader::read_unknown(call, range);
    sink().report("bad-program", range, {call.callee + " does not begin the multiplier, or has not one argument"},
                  "write phiN(polynomial)*polynomial or inverseN(polynomial)*polynomial, and a sum as several terms: "
                  "transform u by ..., u by ... to v");
    return 0.0;
  }
  Expr refuse(const std::string& name, SourceRange range) {
    sink().report("bad-program", range, {name + " is no number: a multiplier is the same at all cells"},
                  "multiply by a field in a kernel, before or after the transform");
    return 0.0;
  }

  const std::vector<std::string>& fields_;
};

class TransformReader {
 public:
  TransformReader(const std::vector<std::string>& fields, std::size_t rank, DiagnosticSink& sink)
      : reader_(fields, sink), rank_(rank), sink_(sink) {}

  Transform::Term read(const ast::TransformItem::Term& source) {
    Multiplier by;
    if (!read(source.by, by)) by = {{}, 0.0, 0.0};
    by.within_two_thirds = source.within_two_thirds;
    return {source.field.name, by};
  }

 private:
  bool read(const ast::Expr& source, Multiplier& by) {
    std::optional<ast::Expr> function;
    const ast::Expr factor = without_function(source, function);
    if (!read(factor, source.range(), by.factor)) return false;
    if (!function) return true;
    const ast::Call& call = *function_call(*function);
    by.function = function_of(call.callee);
    if (by.function.number > highest_function) {
      const std::string highest = fmt::format("{}{}", name_of(by.function.kind), highest_function);
      sink_.report("bad-program", call.callee_range,
                   {fmt::format("{} is above {}, the highest one", call.callee, highest)});
      return false;
    }
    const ast::Expr& argument = call.arguments[0].value;
    if (!read(argument, argument.range(), by.argument)) return false;
    if (by.function.kind != WaveFunction::Kind::heaviside) return true;
    const bool is_of_numbers = by.function.number == 0 && !holds_params(by.argument) && !holds_odd_powers(by.argument);
    if (!is_of_numbers)
      sink_.report("bad-program", call.callee_range,
                   {call.callee + " is not heaviside0 of numbers and even powers of wave numbers"},
                   "it jumps where a real number is 0, so that it has no derivative by a param");
    return is_of_numbers;
  }

  bool read(const ast::Expr& source, SourceRange range, Expr& symbol) {
    const std::size_t before = sink_.all().size();
    symbol = reader_.read(source);
    if (sink_.all().size() != before) return false;
    if (!polynomial_of(symbol)) {
      sink_.report(
          "bad-program", range, {"a multiplier is a polynomial of ikx, iky, ikz"},
          fmt::format("write sums of products and powers up to {}, or phiN(polynomial)*polynomial", highest_power));
      return false;
    }
    const std::array<bool, max_rank> axes = axes_of(symbol);
    const bool good = std::find(axes.begin() + static_cast<std::ptrdiff_t>(rank_), axes.end(), true) == axes.end();
    if (!good) sink_.report("bad-program", range, {"a multiplier has a wave number along an axis that is not there"});
    return good;
  }

  MultiplierReader reader_;
  std::size_t rank_;
  DiagnosticSink& sink_;
};

}  // namespace

Transform read_transform(const ast::TransformItem& source, const std::vector<std::string>& fields, std::size_t rank,
                         DiagnosticSink& sink) {
  TransformReader reader(fields, rank, sink);
  Transform transform{{}, source.result.name};
  for (const ast::TransformItem::Term& term : source.terms) transform.terms.push_back(reader.read(term));
  return transform;
}

}  // namespace dpde::stencil
