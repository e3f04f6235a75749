// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/expr_from_ast.h"

#include <fmt/format.h>

#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

std::vector<std::string> callable_names() {
  std::vector<std::string> names{"if", "interp"};
  for (const Fn fn : every_function()) names.emplace_back(name_of(fn));
  return names;
}

}  // namespace

std::string did_you_mean(const std::string& name, const std::vector<std::string>& candidates) {
  const std::string nearest = nearest_name(name, candidates);
  return nearest.empty() ? "" : fmt::format("did you mean {}?", nearest);
}

bool check_distance(int cells, int least, SourceRange range, DiagnosticSink& sink) {
  if (cells >= least && cells <= max_distance) return true;
  sink.report("distance-out-of-range", range,
              {fmt::format("{}", cells), fmt::format("{}", least), fmt::format("{}", max_distance)});
  return false;
}

Expr ExprReader::read(const ast::Expr& e) {
  const auto refuse = [&](const char* what) -> Expr {
    sink_.report("not-in-kernels", e.range(), {what});
    return 0.0;
  };
  return match(
      e->kind, [](const ast::Number& n) { return Expr(n.value); }, [&](const ast::Text&) { return refuse("a text"); },
      [&](const ast::Name& n) { return read_name(n.name, e.range()); },
      [&](const ast::Unary& u) {
        const Expr operand = read(u.operand);
        if (u.op == ast::UnaryOp::magnitude) return call(Fn::abs, {operand});
        return u.op == ast::UnaryOp::negate ? -operand : binary(BinaryOp::equal, operand, 0.0);
      },
      [&](const ast::Binary& b) {
        const Expr left = read(b.left);
        return binary(b.op, left, read(b.right));
      },
      [&](const ast::Call& c) { return read_call(c, e.range()); }, [&](const ast::Tuple&) { return refuse("a tuple"); },
      [&](const ast::Offsets& o) { return read_offsets(o, e.range()); },
      [&](const ast::Component&) { return refuse("a component of an expression"); },
      [](const ast::Error&) { return Expr(0.0); });
}

bool ExprReader::has_arguments(const ast::Call& call, std::size_t count, SourceRange range) {
  if (call.arguments.size() == count) return true;
  sink_.report("kernel-argument-count", range,
               {call.callee, fmt::format("{}", count), fmt::format("{}", call.arguments.size())});
  return false;
}

bool ExprReader::are_positional(const ast::Call& call) {
  for (const ast::Argument& argument : call.arguments) {
    if (argument.name.empty()) continue;
    sink_.report("not-in-kernels", argument.value.range(),
                 {fmt::format("an argument with the name {}", argument.name)});
    return false;
  }
  return true;
}

Expr ExprReader::read_unknown(const ast::Call& call, SourceRange) {
  sink_.report("kernel-unknown-function", call.callee_range, {call.callee},
               [&] { return did_you_mean(call.callee, callable_names()); });
  return 0.0;
}

Expr ExprReader::read_call(const ast::Call& call, SourceRange range) {
  if (!are_positional(call)) return 0.0;
  if (find_interp(call.callee)) return read_interp(call, range);
  const std::optional<Fn> fn = find_fn(call.callee);
  if (!fn && call.callee != "if") return read_unknown(call, range);
  if (!has_arguments(call, fn ? arity(*fn) : 3, range)) return 0.0;
  std::vector<Expr> arguments;
  for (const ast::Argument& argument : call.arguments) arguments.push_back(read(argument.value));
  return fn ? dpde::stencil::call(*fn, arguments) : select(arguments[0], arguments[1], arguments[2]);
}

}  // namespace dpde::stencil
