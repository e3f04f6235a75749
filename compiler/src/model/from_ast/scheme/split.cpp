// SPDX-License-Identifier: Apache-2.0
// split = lie(advect, sources(marker), sources(u), diffusion): consecutive substeps, each with some terms of the
// equations.
#include <fmt/format.h>

#include <algorithm>

#include "model/analyse/split_terms.h"
#include "model/build.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

constexpr Split::Terms all_terms[] = {Split::Terms::advect, Split::Terms::sources, Split::Terms::diffusion};
constexpr const char* parts_hint = "write split = lie(advect, sources, diffusion), or strang(...), in the order wanted";

const ast::ValueItem* row_of(const Elaboration& elaboration) {
  const ast::Scheme* chosen = find_declaration<ast::Scheme>(elaboration.file, elaboration.problem.scheme.name);
  if (!chosen) return nullptr;
  for (const auto& [row, range] : items_of<ast::ValueItem>(chosen->items)) {
    if (row.name.name == split_key && !row.of) return &row;
  }
  return nullptr;
}

class SplitReader {
 public:
  explicit SplitReader(Elaboration& elaboration) : elaboration_(elaboration) {}

  Split read(const ast::Expr& value) {
    Split split;
    const auto* call = std::get_if<ast::Call>(&value->kind);
    if (!call || (call->callee != "lie" && call->callee != "strang")) {
      elaboration_.sink.report("bad-scheme-value", value.range(), {split_key, ast::print(value)}, parts_hint);
      return split;
    }
    split.kind = call->callee == "lie" ? Split::Kind::lie : Split::Kind::strang;
    for (const ast::Argument& argument : call->arguments) add(argument.value, split);
    return split;
  }

 private:
  void refuse(const ast::Expr& part, std::string why, std::string hint) {
    elaboration_.sink.report("split-does-not-fit", part.range(), {std::move(why)}, std::move(hint));
  }

  void add(const ast::Expr& written, Split& split) {
    const auto* name = std::get_if<ast::Name>(&written->kind);
    const auto* call = std::get_if<ast::Call>(&written->kind);
    const std::string word = name ? name->name : call ? call->callee : "";
    const auto terms = std::ranges::find_if(all_terms, [&](Split::Terms t) { return word == name_of(t); });
    if (terms == std::end(all_terms)) {
      std::vector<std::string> words;
      for (const Split::Terms known : all_terms) words.emplace_back(name_of(known));
      const std::string near = did_you_mean(word, words);
      return refuse(
          written, fmt::format("{} is not one of its parts", ast::print(written)),
          near.empty() ? "the parts are advect, sources and diffusion, of all fields or as in sources(u)" : near);
    }
    Split::Part part{*terms, {}};
    for (std::size_t i = 0; call && i < call->arguments.size(); ++i) {
      const auto* field = std::get_if<ast::Name>(&call->arguments[i].value->kind);
      if (!field) return refuse(written, "its parts are of fields", "as in sources(u)");
      const ast::Identifier written_field{field->name, call->arguments[i].value.range()};
      for (const State* state : find_states(elaboration_, written_field, "a part of the step"))
        part.states.push_back(state->name);
    }
    for (const Split::Part& other : split.parts) {
      if (!overlaps(part, other)) continue;
      return refuse(written, fmt::format("{} is in it twice", ast::print(written)),
                    "each term is taken once: leave one of them out, or name the fields, as in sources(u)");
    }
    split.parts.push_back(std::move(part));
  }

  static bool overlaps(const Split::Part& a, const Split::Part& b) {
    if (a.terms != b.terms) return false;
    return a.states.empty() || b.states.empty() ||
           std::ranges::any_of(a.states, [&](const std::string& state) { return b.has(state); });
  }

  Elaboration& elaboration_;
};

std::optional<Obstacle> obstacle_to_parts(const Problem& problem) {
  const TimeScheme time = problem.scheme.time;
  if (is_multistep(time) || is_exponential(time) || is_verlet(time))
    return Obstacle{fmt::format("time = {} takes all terms at once", print(time)),
                    "take time = rk2, rk4, ssp_rk3, euler or ars222"};
  const bool has_parts = std::ranges::any_of(problem.states, [](const State& state) { return state.parts > 1; });
  return has_parts ? std::optional(Obstacle{"subcycles divide the step already", "leave the subcycles out"})
                   : std::nullopt;
}

}  // namespace

void bind_split(Elaboration& elaboration) {
  if (const ast::ValueItem* row = row_of(elaboration))
    elaboration.problem.scheme.split = SplitReader(elaboration).read(row->value);
}

void check_split(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  const ast::ValueItem* row = row_of(elaboration);
  if (!row || !problem.scheme.is_split() || elaboration.sink.has_errors()) return;
  const SourceRange range = row->value.range();
  if (const std::optional<Obstacle> found = obstacle_to_parts(problem)) {
    elaboration.sink.report("split-does-not-fit", range, {found->what}, found->hint);
    return;
  }
  for (const State& state : problem.states) {
    for (const Split::Terms terms : all_terms) {
      const bool is_there = state.rhs && !is_literal(terms_for(problem, state.name, *state.rhs, terms), 0);
      const bool is_taken = std::ranges::any_of(problem.scheme.split.parts, [&](const Split::Part& part) {
        return part.terms == terms && part.is_of(state.name);
      });
      if (!is_there || is_taken) continue;
      elaboration.sink.report(
          "split-does-not-fit", range,
          {fmt::format("the equation of {} has {}, which no part takes", written_name(elaboration, state.name),
                       terms == Split::Terms::advect ? "terms with advect" : name_of(terms))},
          fmt::format("add {0}, or {0}({1})", name_of(terms), state.name));
    }
  }
}

}  // namespace dpde::model
