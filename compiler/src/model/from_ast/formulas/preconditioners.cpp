// SPDX-License-Identifier: Apache-2.0
// solve lap(psi) = -omega for psi preconditioner smooth(residual): the output of a network for an iteration's residual
// is the next search direction.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/solves.h"
#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

constexpr const char* residual = "residual";

bool is_residual(const Expr& e) {
  const Field* is_field = as<Field>(e);
  return is_field != nullptr && is_field->name == residual;
}

/// The call with the residual replaced by the unknown's name.
Expr in_terms_of(const Expr& e, const std::string& unknown) {
  if (is_residual(e)) return field(unknown, e->origin);
  return map_children(e, [&](const Expr& part) { return in_terms_of(part, unknown); });
}

/// A suggestion for a single word.
std::string hint_for_word(const Elaboration& elaboration, const std::string& word) {
  if (find_network(elaboration, word)) return fmt::format("write preconditioner {}(residual)", word);
  const bool is_of_scheme = word == "none" || word == "multigrid" || word == "automatic";
  return is_of_scheme ? fmt::format("that stands in a scheme: scheme s {{ preconditioner = {} }}", word)
                      : "as in preconditioner smooth(residual), network smooth(r) -> z";
}

/// The expression, with the residual as a field of that name; nullopt after a diagnostic.
std::optional<Expr> read_preconditioner(Elaboration& elaboration, const ast::Expr& written, const std::string& name) {
  if (elaboration.names.scope.find(residual) != nullptr) {
    elaboration.sink.report(
        "solve-does-not-fit", written.range(),
        {name, "residual stands for what its iterations leave here, and for something else in the model"},
        "call that otherwise");
    return std::nullopt;
  }
  if (const auto* word = std::get_if<ast::Name>(&written->kind)) {
    elaboration.sink.report("solve-does-not-fit", written.range(), {name, "its preconditioner is no call of a network"},
                            hint_for_word(elaboration, word->name));
    return std::nullopt;
  }
  elaboration.names.scope.declare(residual, {Role::let, written.range()});
  const auto stands_for_itself = [&](const std::string& own) {
    return elaboration.names.lets.emplace(own, TypedExpr{TypedExpr::Type::number, {field(own, {written.range()})}})
        .second;
  };
  stands_for_itself(residual);
  const bool is_open = stands_for_itself(name);  // the unknown, not yet declared
  const std::optional<Expr> value = formulas::number({elaboration, FormulaContext::equation, name}, written);
  elaboration.names.lets.erase(residual);
  if (is_open) elaboration.names.lets.erase(name);
  elaboration.names.scope.forget(residual);
  return value;
}

/// Whether iterations can use it as a search direction; reports why not.
bool is_preconditioner(Elaboration& elaboration, const Expr& value, SourceRange range, const Solve& solved) {
  const auto refuse = [&](const std::string& why, const std::string& hint) {
    elaboration.sink.report("solve-does-not-fit", range, {solved.name, why}, hint);
    return false;
  };
  const NetworkCall* call = as<NetworkCall>(value);
  if (call == nullptr)
    return refuse("its preconditioner is no network", "as in preconditioner smooth(residual), network smooth(r) -> z");
  if (call->outputs != 1)
    return refuse(
        fmt::format("a direction is one number a cell, and network {} makes {}", call->network, call->outputs),
        fmt::format("let it have one output: network {}(r) -> z", call->network));
  if (!is_residual(call->arguments.front()))
    return refuse("the first input of its preconditioner is not the residual itself",
                  fmt::format("write {}(residual, ...), of a network without galilean", call->network));
  const auto holds_residual = [](const Expr& argument) { return any_part(argument, is_residual); };
  if (std::any_of(call->arguments.begin() + 1, call->arguments.end(), holds_residual))
    return refuse("its preconditioner is given the residual more than once", "write it as the first argument alone");
  if (reads(value, solved.name))
    return refuse("its preconditioner depends on the unknown field", "write residual for the residual of an iteration");
  if (solved.iterations == 0) return refuse("0 iterations have no directions", "leave the preconditioner out");
  return true;
}

/// Whether the scheme's iterations use it: flexible methods do, unless the scheme names another preconditioner.
bool is_used(Elaboration& elaboration, const Expr& value, const Solve& solved) {
  const SolveBy& by = elaboration.problem.scheme.solve;
  if (solved.iterations) return true;  // always conjugate gradients
  const bool is_flexible = by.method == SolveMethod::cg || by.method == SolveMethod::gmres;
  if (is_flexible && !is_of_waves(solved, elaboration.problem.scheme))
    return by.preconditioner == Preconditioner::automatic;
  elaboration.sink.report(
      "solve-key-not-used", value->origin.range,
      {"preconditioner " + print(value),
       is_flexible ? solved.name + " is solved wave by wave, without iterations"
                   : fmt::format("solve = {} has no iterations that a network preconditions", print(by))},
      is_flexible ? "leave it out" : "take cg or gmres, or leave it out");
  return false;
}

}  // namespace

bool add_preconditioner(Elaboration& elaboration, const std::optional<ast::Expr>& written, Solve& solved) {
  if (!written) return true;
  std::set<std::string> called = elaboration.networks.called;
  const std::optional<Expr> value = read_preconditioner(elaboration, *written, solved.name);
  if (!value || !is_preconditioner(elaboration, *value, written->range(), solved)) return false;
  if (is_used(elaboration, *value, solved)) {
    solved.preconditioner = in_terms_of(*value, solved.name);
  } else {
    elaboration.networks.called = std::move(called);  // the network has no gradient if nothing else calls it
  }
  return true;
}

}  // namespace dpde::model
