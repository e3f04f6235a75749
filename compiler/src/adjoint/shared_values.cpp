// SPDX-License-Identifier: Apache-2.0
#include "adjoint/shared_values.h"

#include <algorithm>
#include <set>

#include "stencil/build.h"
#include "stencil/passes/numbering.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// The distinct values of some terms, and at how many displacements each is needed.
class Uses {
 public:
  Uses(const PointTerms& terms, const std::vector<Let>& stored) : stored_(stored) {
    for (const Let& let : terms.lets) numbering_.define_local(let.name, note(let.value));
    for (const ReadBars& read : terms.reads) {
      for (const auto& [k, term] : read.by_offset) use(note(term), k);
    }
    for (const auto& [name, term] : terms.params) use(note(term), {});
  }

  /// Loads and operations that are not repeated when the value is read from a field.
  int saved(int number) const {
    const auto known = of_.find(number);
    if (known == of_.end() || !known->second.may_be_stored || numbering_[number].uniform) return 0;
    const int displacements = static_cast<int>(known->second.displacements.size());
    return (displacements - 1) * (static_cast<int>(known->second.reads.size()) - 1 + numbering_[number].cost);
  }

  /// The value that saves most, and an expression for it.
  std::pair<int, Expr> best() const {
    const auto found = std::max_element(of_.begin(), of_.end(), [&](const auto& a, const auto& b) { return saved(a.first) < saved(b.first); });
    return {found->first, found->second.expression};
  }
  bool empty() const { return of_.empty(); }

  /// `e` with `replacement` for that value.
  Expr replaced(const Expr& e, int number, const Expr& replacement) {
    if (numbering_.number(e) == number) return replacement;
    return map_children(e, [&](const Expr& child) { return replaced(child, number, replacement); });
  }

 private:
  struct Known {
    Expr expression;
    std::set<std::pair<std::string, Offset>> reads;
    std::set<Offset> displacements;
    bool may_be_stored = true;
  };

  /// Notes `e` and what it is made of; its number.
  int note(const Expr& e) {
    const int number = numbering_.number(e);
    if (of_.contains(number)) return number;
    Known known{e, {}, {}};
    if (const Access* a = std::get_if<Access>(&e->kind)) {
      known.reads.insert({a->field, a->offset});
      known.may_be_stored = std::ranges::none_of(stored_, [&](const Let& field) { return field.name == a->field; });
    }
    if (std::holds_alternative<Interp>(e->kind)) known.may_be_stored = false;
    for_each_child(e, [&](const Expr& child) {
      const Known& part = of_.at(note(child));
      known.reads.insert(part.reads.begin(), part.reads.end());
      known.may_be_stored = known.may_be_stored && part.may_be_stored;
    });
    of_.emplace(number, std::move(known));
    return number;
  }

  void use(int number, const Offset& k) {
    if (!of_.at(number).displacements.insert(k).second) return;
    for (const int child : numbering_[number].children) use(child, k);
  }

  const std::vector<Let>& stored_;
  Numbering numbering_;
  std::map<int, Known> of_;
};

}  // namespace

std::optional<SharedValue> most_shared(const PointTerms& terms, const std::vector<Let>& stored, const std::string& field, int least) {
  Uses uses(terms, stored);
  if (uses.empty()) return std::nullopt;
  const auto [number, value] = uses.best();
  if (uses.saved(number) < least) return std::nullopt;
  SharedValue result{value, terms};
  const auto replace = [&](Expr& e) { e = uses.replaced(e, number, access(field)); };
  for (Let& let : result.terms.lets) replace(let.value);
  for (ReadBars& read : result.terms.reads) {
    for (auto& [k, term] : read.by_offset) replace(term);
  }
  for (auto& [name, term] : result.terms.params) replace(term);
  return result;
}

}  // namespace dpde::adjoint
