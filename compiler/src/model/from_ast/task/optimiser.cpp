// SPDX-License-Identifier: Apache-2.0
// using gradient_descent(rate = 5), iterations 50; using newton_cg(hessian = gauss_newton)
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <limits>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/words.h"

namespace dpde::model {

namespace {

struct OptimiserKind {
  std::string_view name;
  Optimiser::Kind kind;
  bool takes_rate;
};
constexpr OptimiserKind kinds[] = {{"gradient_descent", Optimiser::Kind::gradient_descent, true},
                                   {"adam", Optimiser::Kind::adam, true},
                                   {"lbfgs", Optimiser::Kind::lbfgs, false},
                                   {"newton_cg", Optimiser::Kind::newton_cg, false}};

const OptimiserKind* find_kind_of(Elaboration& elaboration, const std::string& name, SourceRange range) {
  std::vector<std::string> names;
  for (const OptimiserKind& kind : kinds) {
    if (kind.name == name) return &kind;
    names.emplace_back(kind.name);
  }
  elaboration.sink.report("unknown-optimiser", range, {name}, did_you_mean(name, names));
  return nullptr;
}

std::optional<double> rate_of(Elaboration& elaboration, const ast::Call& call, const ast::Argument& argument) {
  const auto rate = evaluate(elaboration, argument.value, "the rate");
  if (!rate || *rate > 0) return rate;
  elaboration.sink.report("bad-optimiser-option", argument.value.range(),
                          {"rate", call.callee, fmt::format("must be positive, not {}", *rate)});
  return std::nullopt;
}

/// hessian = full or gauss_newton; false for another argument.
bool bind_hessian(Elaboration& elaboration, const ast::Call& call, const ast::Argument& argument,
                  Optimiser& optimiser) {
  if (optimiser.kind != Optimiser::Kind::newton_cg || argument.name != "hessian") return false;
  const auto* word = std::get_if<ast::Name>(&argument.value->kind);
  optimiser.gauss_newton = word && word->name == "gauss_newton";
  if (word && (optimiser.gauss_newton || word->name == "full")) return true;
  elaboration.sink.report("bad-optimiser-option", argument.value.range(),
                          {"hessian", call.callee, "is full or gauss_newton"});
  return true;
}

std::string example_of(const OptimiserKind& kind) {
  if (kind.kind == Optimiser::Kind::newton_cg) return "write newton_cg(hessian = gauss_newton)";
  return fmt::format("write {}({})", kind.name, kind.takes_rate ? "rate = 0.1" : "");
}

/// momentum for gradient descent, decay for both methods with a rate; false for another argument.
bool bind_memory(Elaboration& elaboration, const ast::Call& call, const ast::Argument& argument, Optimiser& optimiser) {
  const bool is_momentum = argument.name == "momentum" && optimiser.kind == Optimiser::Kind::gradient_descent;
  const bool is_decay = argument.name == "decay" && (optimiser.kind == Optimiser::Kind::gradient_descent ||
                                                     optimiser.kind == Optimiser::Kind::adam);
  if (!is_momentum && !is_decay) return false;
  const auto value = evaluate(elaboration, argument.value, argument.name);
  if (!value) return true;
  const std::string what =
      !learns_from_trajectories(elaboration) ? "is for tasks that learn from trajectories"
      : *value < 0 || (is_momentum && *value >= 1)
          ? fmt::format("must be {}, not {}", is_momentum ? "from 0 on and below 1" : "0 or more", *value)
          : "";
  if (!what.empty())
    elaboration.sink.report("bad-optimiser-option", argument.value.range(), {argument.name, call.callee, what});
  (is_momentum ? optimiser.momentum : optimiser.decay) = *value;
  return true;
}

void bind_options(Elaboration& elaboration, const ast::Call& call, const OptimiserKind& kind, Optimiser& optimiser) {
  bool has_rate = false;
  for (const ast::Argument& argument : call.arguments) {
    if (bind_memory(elaboration, call, argument, optimiser)) continue;
    if (bind_hessian(elaboration, call, argument, optimiser)) continue;
    if (!kind.takes_rate || argument.name != "rate") {
      const std::string name = argument.name.empty() ? "an argument without name" : argument.name;
      elaboration.sink.report("bad-optimiser-option", argument.value.range(), {name, call.callee, "is not understood"},
                              example_of(kind));
      return;
    }
    if (has_rate) report_duplicate(elaboration, "the rate", argument.value.range(), {});
    has_rate = true;
    optimiser.rate = rate_of(elaboration, call, argument).value_or(1);
  }
  if (has_rate || !kind.takes_rate) return;
  elaboration.sink.report("bad-optimiser-option", call.callee_range, {"rate", call.callee, "is missing"},
                          fmt::format("write {}(rate = 0.1)", call.callee));
}

void bind_iterations(Elaboration& elaboration, const ast::Expr& e, Optimiser& optimiser) {
  const auto value = evaluate(elaboration, e, "the number of iterations");
  if (!value) return;
  if (*value >= 1 && *value <= std::numeric_limits<int>::max() && *value == std::floor(*value)) {
    optimiser.iterations = static_cast<int>(*value);
    return;
  }
  elaboration.sink.report("bad-iterations", e.range(), {fmt::format("{}", *value)});
}

/// Options after the optimiser.
void bind_options(Elaboration& elaboration, const ast::UsingItem& item, Optimiser& optimiser) {
  std::map<std::string, SourceRange> seen;
  for (const ast::Argument& option : item.options) {
    const auto [first, is_new] = seen.emplace(option.name, option.name_range);
    if (!is_new) report_duplicate(elaboration, option.name, option.name_range, first->second);
    if (option.name == "iterations") {
      bind_iterations(elaboration, option.value, optimiser);
    } else if (!is_training_option(option.name)) {
      elaboration.sink.report(
          "unknown-option", option.name_range, {option.name, "using"},
          "understood here: iterations, and where a task learns from trajectories batch, epochs, unroll, "
          "cut, noise, clip, validate, patience, schedule, seed, trials");
    } else if (!learns_from_trajectories(elaboration)) {
      elaboration.sink.report("not-allowed-here", option.name_range,
                              {option.name, "a task that does not learn from trajectories"},
                              "understood here: iterations");
    }
  }
}

}  // namespace

std::vector<std::string> words_of_optimisers() {
  std::vector<std::string> words;
  for (const OptimiserKind& kind : kinds) words.emplace_back(kind.name);
  return words;
}

std::optional<Optimiser> optimiser_of(Elaboration& elaboration, const ast::UsingItem& item) {
  Optimiser optimiser;
  bind_options(elaboration, item, optimiser);
  const auto* word = std::get_if<ast::Name>(&item.optimiser->kind);
  const auto* written = std::get_if<ast::Call>(&item.optimiser->kind);
  if (!word && !written) {
    if (!std::holds_alternative<ast::Error>(item.optimiser->kind)) {
      find_kind_of(elaboration, "this", item.optimiser.range());
    }
    return std::nullopt;
  }
  const ast::Call call = written ? *written : ast::Call{word->name, item.optimiser.range(), {}};
  const OptimiserKind* kind = find_kind_of(elaboration, call.callee, call.callee_range);
  if (!kind) return std::nullopt;
  optimiser.kind = kind->kind;
  bind_options(elaboration, call, *kind, optimiser);
  return optimiser;
}

}  // namespace dpde::model
