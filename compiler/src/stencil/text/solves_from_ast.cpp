// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/solves_from_ast.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "stencil/text/expr_from_ast.h"
#include "stencil/text/networks_from_ast.h"
#include "syntax/item_kinds.h"

namespace dpde::stencil {

namespace {

std::vector<std::string> names_of(const std::vector<ast::Identifier>& all) {
  std::vector<std::string> names;
  for (const ast::Identifier& one : all) names.push_back(one.name);
  return names;
}

template <class Choice>
std::vector<std::string> names_up_to(Choice last) {
  std::vector<std::string> names;
  for (int i = 0; i <= static_cast<int>(last); ++i) names.emplace_back(name_of(static_cast<Choice>(i)));
  return names;
}

/// nullopt after a diagnostic.
std::optional<SolveBy> read_solve_by(const ast::SolveItem& source, DiagnosticSink& sink) {
  SolveBy by;
  if (source.method) {
    const std::optional<SolveMethod> method = find_solve_method(source.method->name);
    if (!method) {
      sink.report("bad-program", source.method->range, {source.method->name + " is no method to solve by"},
                  did_you_mean(source.method->name, names_up_to(SolveMethod::gmres)));
      return std::nullopt;
    }
    by.method = *method;
  }
  if (source.smoother) {
    const std::optional<Smoother> smoother = find_smoother(source.smoother->name);
    if (!smoother) {
      sink.report("bad-program", source.smoother->range, {source.smoother->name + " is no smoother of multigrid"},
                  did_you_mean(source.smoother->name, names_up_to(Smoother::chebyshev)));
      return std::nullopt;
    }
    by.smoother = *smoother;
  }
  if (source.preconditioner) {
    const std::optional<Preconditioner> preconditioner = find_preconditioner(source.preconditioner->name);
    if (!preconditioner) {
      sink.report("bad-program", source.preconditioner->range,
                  {source.preconditioner->name + " is no preconditioner of iterations"},
                  did_you_mean(source.preconditioner->name, names_up_to(Preconditioner::none)));
      return std::nullopt;
    }
    by.preconditioner = *preconditioner;
  }
  by.warns = source.warns;
  const auto number_of = [](const ast::Expr& e) {
    const auto* number = std::get_if<ast::Number>(&e->kind);
    return number == nullptr ? 0 : number->value;
  };
  if (source.tolerance) by.tolerance = number_of(*source.tolerance);
  if (!(by.tolerance > 0 && by.tolerance < 1)) {
    sink.report("bad-program", source.tolerance->range(), {"a tolerance is a number between 0 and 1"}, "as 1e-10");
    return std::nullopt;
  }
  const double most = source.iterations ? number_of(*source.iterations) : by.most_iterations;
  if (!(most >= 1 && most <= 1e9 && most == std::floor(most))) {
    sink.report("bad-program", source.iterations->range(), {"iterations are a whole number from 1 on"}, "as 200");
    return std::nullopt;
  }
  by.most_iterations = static_cast<int>(most);
  return by;
}

}  // namespace

static std::optional<NetworkCall> read_preconditioner(const ast::SolveItem& source) {
  if (!source.network) return std::nullopt;
  const ast::NetworkUse& use = *source.network;
  return NetworkCall{use.network.name, NetworkCall::Mode::value, names_of(use.inputs), {}, names_of(use.to), false};
}

Solve read_solve_head(const ast::SolveItem& source, DiagnosticSink& sink) {
  const std::size_t count = source.unknowns.size();
  if (source.images.size() != count || source.rights.size() != count) {
    sink.report("bad-program", source.unknowns.front().range,
                {fmt::format("{} unknown fields and {} right sides do not match {} fields that the block computes",
                             count, source.rights.size(), source.images.size())},
                "name as many of each: solve y, w = b, c for x, v");
  }
  if (!source.guesses.empty() && (!source.is_linear || count > 1)) {
    sink.report("bad-program", source.guesses.front().range, {"a linear solve for one field alone begins with a field"},
                "leave out from " + source.guesses.front().name);
  }
  const std::optional<SolveBy> by = read_solve_by(source, sink);
  return {names_of(source.images),    names_of(source.rights),
          names_of(source.unknowns),  {},
          by.value_or(SolveBy{}),     {"", source.unknowns.front().range},
          source.is_linear,           {},
          names_of(source.guesses),   {},
          read_preconditioner(source)};
}

std::vector<std::string> fields_named(const ast::Item& item) {
  using Names = std::vector<std::string>;
  return match(
      item.kind, [](const ast::RepeatItem& repeat) { return names_of(repeat.to); },
      [](const ast::SwapItem& swap) { return Names{swap.state.name}; },
      [](const ast::ReduceItem& reduce) {
        return Names{reduce.field.name, reduce.result.name};
      },
      [](const ast::TransformItem& transform) {
        Names names;
        for (const ast::TransformItem::Term& term : transform.terms) names.push_back(term.field.name);
        names.push_back(transform.result.name);
        return names;
      },
      [](const ast::SolveItem& solve) {
        Names names;
        for (const auto* fields : {&solve.images, &solve.rights, &solve.unknowns}) {
          const Names named = names_of(*fields);
          names.insert(names.end(), named.begin(), named.end());
        }
        for (const ast::Identifier& guess : solve.guesses) names.push_back(guess.name);
        for (const auto* fields :
             {solve.network ? &solve.network->inputs : nullptr, solve.network ? &solve.network->to : nullptr}) {
          if (fields == nullptr) continue;
          const Names named = names_of(*fields);
          names.insert(names.end(), named.begin(), named.end());
        }
        return names;
      },
      [](const ast::ApplyItem& apply) { return fields_of(apply); },
      [](const ast::OneOf<ast::FillItem, ast::RunItem, ast::StackItem, ast::KeepItem, ast::AxesItem> auto&) {
        return Names();
      },
      [](const ast::OutsidePrograms auto&) { return Names(); });
}

}  // namespace dpde::stencil
