// SPDX-License-Identifier: Apache-2.0
// Walks over the statements of a program and over those of their blocks. A level of programs says what blocks a
// statement has by for_each_block(statement, blocks, f), which calls f on each: closed over the kinds of statement, so
// that a kind which is added says there, once, what walks go into.
//
// Walks for one kind are for what only that kind has: who asks for runs of kernels names no other kind. What has to be
// decided for each kind is a match().
#pragma once

#include <algorithm>
#include <iterator>
#include <utility>
#include <variant>
#include <vector>

namespace dpde {

/// Which blocks a walk goes into: all, or passes of repeats alone, which are part of the program, where the operators
/// of solves are programs of their own.
enum class Blocks { all, passes };

/// The first statement of which `is_it` is true, before those of its blocks; nullptr: none.
template <class Body, class F>
auto find_statement(Body&& body, const F& is_it, Blocks blocks = Blocks::all) -> decltype(&*std::begin(body)) {
  for (auto& statement : body) {
    if (is_it(statement)) return &statement;
    decltype(&statement) found = nullptr;
    for_each_block(statement, blocks, [&](auto& block) {
      if (found == nullptr) found = find_statement(block, is_it, blocks);
    });
    if (found != nullptr) return found;
  }
  return nullptr;
}

/// `f` on each statement, before those of its blocks.
template <class Body, class F>
void for_each_statement(Body&& body, const F& f, Blocks blocks = Blocks::all) {
  for (auto& statement : body) {
    f(statement);
    for_each_block(statement, blocks, [&](auto& block) { for_each_statement(block, f, blocks); });
  }
}

/// `f` on each statement of the kind, which it may change where the statements may be changed.
template <class Kind, class Body, class F>
void for_each_kind(Body&& body, const F& f, Blocks blocks = Blocks::all) {
  const auto call_if_it = [&](auto& statement) {
    if (auto* kind = std::get_if<Kind>(&statement)) f(*kind);
  };
  for_each_statement(body, call_if_it, blocks);
}

/// The first one of the kind of which `is_it` is true; nullptr: none.
template <class Kind, class Body, class F>
const Kind* find_kind(const Body& body, const F& is_it, Blocks blocks = Blocks::all) {
  const auto is_of_kind = [&](const auto& statement) {
    const Kind* kind = std::get_if<Kind>(&statement);
    return kind != nullptr && is_it(*kind);
  };
  const auto* found = find_statement(body, is_of_kind, blocks);
  return found == nullptr ? nullptr : std::get_if<Kind>(found);
}

/// Takes out the statements of which `is_out` is true.
template <class Statement, class F>
void erase_statements(std::vector<Statement>& body, const F& is_out, Blocks blocks = Blocks::all) {
  std::erase_if(body, is_out);
  for (Statement& statement : body)
    for_each_block(statement, blocks, [&](auto& block) { erase_statements(block, is_out, blocks); });
}

/// The statements with the list that `f` makes of each one of the kind in its place.
template <class Kind, class Statement, class F>
std::vector<Statement> replace_kind(std::vector<Statement> body, const F& f) {
  std::vector<Statement> result;
  for (Statement& statement : body) {
    if (const Kind* kind = std::get_if<Kind>(&statement)) {
      std::ranges::move(f(*kind), std::back_inserter(result));
      continue;
    }
    for_each_block(statement, Blocks::all, [&](auto& block) { block = replace_kind<Kind>(std::move(block), f); });
    result.push_back(std::move(statement));
  }
  return result;
}

}  // namespace dpde
