// SPDX-License-Identifier: Apache-2.0
#include "adjoint/shared_values.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "stencil/build.h"
#include "stencil/decisions.h"
#include "stencil/passes/numbering.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

std::set<std::string> decisive_lets(const PointTerms& terms) {
  Kernel kernel;
  kernel.lets = terms.lets;
  for (const ReadBars& read : terms.reads) {
    for (const auto& [k, term] : read.by_offset) kernel.stores.push_back({read.field, false, term, {}});
  }
  for (const auto& [name, term] : terms.params) kernel.sums.push_back({name, term});
  return stencil::decisive_lets(kernel);
}

/// A set of small numbers.
class Bits {
 public:
  void insert(std::size_t number) {
    words_.resize(std::max(words_.size(), number / 64 + 1));
    words_[number / 64] |= std::uint64_t{1} << number % 64;
  }
  void merge(const Bits& other) {
    words_.resize(std::max(words_.size(), other.words_.size()));
    for (std::size_t i = 0; i < other.words_.size(); ++i) words_[i] |= other.words_[i];
  }
  int count() const {
    int count = 0;
    for (const std::uint64_t word : words_) count += std::popcount(word);
    return count;
  }

 private:
  std::vector<std::uint64_t> words_;
};

/// Puts `replacement` where the value of a number stands. What does not hold it stays the same node.
class Replacing {
 public:
  Replacing(Numbering& numbering, int number, Expr replacement)
      : numbering_(numbering), number_(number), replacement_(std::move(replacement)) {}

  Expr operator()(const Expr& e) {
    if (numbering_.number(e) == number_) return replacement_;
    if (is_decision(e)) return e;
    if (const auto known = replaced_.find(&e.node()); known != replaced_.end()) return known->second;
    bool is_same = true;
    const Expr mapped = map_children(e, [&](const Expr& child) {
      const Expr part = (*this)(child);
      is_same = is_same && &part.node() == &child.node();
      return part;
    });
    return replaced_.emplace(&e.node(), is_same ? e : mapped).first->second;
  }

 private:
  Numbering& numbering_;  // keeps the nodes alive
  int number_;
  Expr replacement_;
  std::unordered_map<const Node*, Expr> replaced_;
};

/// The distinct values of some terms, and at how many displacements each is needed. What a decision hangs on stays as
/// it is written (stencil/decisions.h): a field is rounded otherwise than what it is compared with.
class Uses {
 public:
  Uses(const PointTerms& terms, const std::vector<Let>& stored) : stored_(stored), decisive_(decisive_lets(terms)) {
    for (const Let& let : terms.lets) {
      const int number = note(let.value);
      numbering_.define_local(let.name, number);
      if (decisive_.contains(let.name)) keep_parts(number);
    }
    std::map<Offset, std::vector<int>> used;
    for (const ReadBars& read : terms.reads) {
      for (const auto& [k, term] : read.by_offset) used[k].push_back(note(term));
    }
    for (const auto& [name, term] : terms.params) used[{}].push_back(note(term));
    int displacement = 0;
    for (const auto& [k, numbers] : used) {
      ++displacement;
      for (const int number : numbers) use(number, displacement);
    }
  }

  /// Loads and operations that are not repeated when the value is read from a field.
  int saved(int number) const {
    const Known& known = of_[number];
    if (!known.may_be_stored || known.is_truth || known.is_kept || numbering_[number].uniform) return 0;
    return (known.displacements - 1) * (known.reads.count() - 1 + numbering_[number].cost);
  }

  int operations_saved(int number) const { return (of_[number].displacements - 1) * (numbering_[number].cost - 1); }

  /// The value that saves most, and an expression for it.
  std::pair<int, Expr> best() const {
    int best = 0;
    for (int number = 1; number < static_cast<int>(of_.size()); ++number) {
      if (saved(number) > saved(best)) best = number;
    }
    return {best, of_[best].expression};
  }
  bool empty() const { return of_.empty(); }

  bool is_decisive(const Let& let) const { return decisive_.contains(let.name); }

  Replacing replacing(int number, const Expr& replacement) { return {numbering_, number, replacement}; }

 private:
  struct Known {
    Expr expression = 0.0;
    Bits reads;  // what it loads
    int displacements = 0;
    int last_displacement = 0;
    bool may_be_stored = true;
    bool is_truth = false;  // no number
    bool is_decision = false;
    bool is_kept = false;  // part of a decisive let
    bool is_noted = false;
  };

  /// Notes `e` and what it is made of; its number.
  int note(const Expr& e) {
    const int number = numbering_.number(e);
    if (number < static_cast<int>(of_.size()) && of_[number].is_noted) return number;
    Known known;
    known.expression = e;
    known.is_noted = true;
    known.is_truth = is_truth(e);
    known.is_decision = is_decision(e);
    if (const Access* a = std::get_if<Access>(&e->kind)) {
      known.reads.insert(loads_++);
      known.may_be_stored = std::ranges::none_of(stored_, [&](const Let& field) { return field.name == a->field; });
    }
    if (std::holds_alternative<Interp>(e->kind)) known.may_be_stored = false;
    for_each_child(e, [&](const Expr& child) {
      const Known& part = of_[note(child)];
      known.reads.merge(part.reads);
      known.may_be_stored = known.may_be_stored && part.may_be_stored;
    });
    if (number >= static_cast<int>(of_.size())) of_.resize(number + 1);
    of_[number] = std::move(known);
    return number;
  }

  void use(int number, int displacement) {
    Known& known = of_[number];
    if (known.last_displacement == displacement) return;
    known.last_displacement = displacement;
    ++known.displacements;
    if (known.is_decision) return;
    for (const int child : numbering_[number].children) use(child, displacement);
  }

  /// What a value consists of is not replaced in it.
  void keep_parts(int number) {
    for (const int child : numbering_[number].children) {
      if (of_[child].is_kept) continue;
      of_[child].is_kept = true;
      keep_parts(child);
    }
  }

  const std::vector<Let>& stored_;
  const std::set<std::string> decisive_;
  Numbering numbering_;
  std::vector<Known> of_;  // by number
  std::size_t loads_ = 0;  // that differ
};

}  // namespace

std::optional<SharedValue> most_shared(const PointTerms& terms, const std::vector<Let>& stored,
                                       const std::string& field, int least) {
  Uses uses(terms, stored);
  if (uses.empty()) return std::nullopt;
  const auto [number, value] = uses.best();
  if (uses.saved(number) < least) return std::nullopt;
  SharedValue result{value, terms, uses.operations_saved(number)};
  Replacing replacing = uses.replacing(number, access(field));
  const auto replace = [&](Expr& e) { e = replacing(e); };
  for (Let& let : result.terms.lets) {
    if (!uses.is_decisive(let)) replace(let.value);
  }
  for (ReadBars& read : result.terms.reads) {
    for (auto& [k, term] : read.by_offset) replace(term);
  }
  for (auto& [name, term] : result.terms.params) replace(term);
  return result;
}

}  // namespace dpde::adjoint
