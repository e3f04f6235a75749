// SPDX-License-Identifier: Apache-2.0
#include "adjoint/shared_values.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <functional>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "stencil/build.h"
#include "stencil/passes/numbering.h"
#include "stencil/space/comparisons.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

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
  bool contains(std::size_t number) const {
    return number / 64 < words_.size() && (words_[number / 64] >> number % 64 & 1) != 0;
  }
  int count() const {
    int count = 0;
    for (const std::uint64_t word : words_) count += std::popcount(word);
    return count;
  }

 private:
  std::vector<std::uint64_t> words_;
};

/// Replaces values with given numbers by fields. Expressions without such values keep their nodes.
class Replacing {
 public:
  Replacing(Numbering& numbering, const std::map<int, Expr>& fields) : numbering_(numbering), fields_(fields) {}

  Expr operator()(const Expr& e) {
    const auto field = fields_.find(numbering_.number(e));
    if (field != fields_.end()) return field->second;
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
  const std::map<int, Expr>& fields_;
  std::unordered_map<const Node*, Expr> replaced_;
};

}  // namespace

/// The distinct values of the terms, and the number of displacements at which each is needed. Operands of decisions
/// stay as written (stencil/space/comparisons.h): storing rounds a value differently from the one it is compared with.
class SharedValues::Search {
 public:
  explicit Search(PointTerms terms) : terms_(std::move(terms)) {
    for (std::size_t i = 0; i < terms_.lets.size(); ++i) {
      const Let& let = terms_.lets[i];
      let_index_.emplace(let.name, i);
      lets_.push_back(note(let.value));
      numbering_.define_local(let.name, lets_.back());
      locals_.push_back(locals_in(let.value));
    }
    is_decisive_.resize(lets_.size());
    std::map<Offset, std::vector<int>> used;
    for (const ReadBars& read : terms_.reads) {
      for (const auto& [k, term] : read.by_offset) add_term(used[k], term);
    }
    for (const auto& [name, term] : terms_.params) add_term(used[{}], term);
    for (auto& [k, numbers] : used) used_.push_back(std::move(numbers));
    find_decisions();
  }

  std::optional<Found> best(int least) {
    walk();
    const std::vector<int> displacements = count_displacements();
    const std::vector<bool> unfit = find_unfit();
    int best = -1, most = least;
    for (int n = 0; n < size(); ++n) {
      if (unfit[n] || values_[n].rank < 0) continue;
      const int saved = (displacements[n] - 1) * (values_[n].loads - 1 + numbering_[n].cost);
      if (saved < most || (saved == most && best >= 0 && values_[best].rank < values_[n].rank)) continue;
      best = n;
      most = saved;
    }
    if (best < 0) return std::nullopt;
    return Found{best, values_[best].expression, (displacements[best] - 1) * (numbering_[best].cost - 1)};
  }

  void store(const Found& found, const std::string& field) {
    fields_.emplace(found.number, access(field));
    values_[found.number].is_stored = true;
    stored_.push_back({field, found.value});
  }

  PointTerms terms() {
    PointTerms result = terms_;
    if (fields_.empty()) return result;
    Replacing replacing(numbering_, fields_);
    const auto replace = [&](Expr& e) { e = replacing(e); };
    for (std::size_t i = 0; i < result.lets.size(); ++i) {
      if (!is_decisive_[i]) replace(result.lets[i].value);
    }
    for (ReadBars& read : result.reads) {
      for (auto& [k, term] : read.by_offset) replace(term);
    }
    for (auto& [name, term] : result.params) replace(term);
    return result;
  }

  const std::vector<Let>& stored() const { return stored_; }

 private:
  struct Known {
    Expr expression = 0.0;
    Bits reads;             // its loads
    int loads = 0;          // their number
    bool is_whole = true;   // no interpolation in it
    bool is_number = true;  // not a truth value
    bool is_noted = false;
    bool is_decision = false;
    Bits decisive;  // of a decision: its lets
    bool is_stored = false;
    bool is_seen = false, is_seen_as_written = false;  // by the current walk
    int rank = -1;                                     // in the order of the current walk
  };

  int size() const { return static_cast<int>(values_.size()); }

  /// Notes `e` and its parts; returns its number. Parts have smaller numbers.
  int note(const Expr& e) {
    const int number = numbering_.number(e);
    if (number < size() && values_[number].is_noted) return number;
    Known known;
    known.expression = e;
    known.is_noted = true;
    known.is_number = !is_truth(e);
    known.is_decision = is_decision(e);
    known.is_whole = !is<Interp>(e);
    if (is<Access>(e)) known.reads.insert(loads_++);
    for_each_child(e, [&](const Expr& child) {
      const Known& part = values_[note(child)];
      known.reads.merge(part.reads);
      known.is_whole = known.is_whole && part.is_whole;
    });
    known.loads = known.reads.count();
    if (number >= size()) values_.resize(number + 1);
    values_[number] = std::move(known);
    return number;
  }

  void add_term(std::vector<int>& used, const Expr& term) {
    used.push_back(note(term));
    roots_.push_back(used.back());
  }

  /// Indices of the lets that occur in `e`.
  Bits locals_in(const Expr& e) const {
    Bits locals;
    for_each_node(e, [&](const Expr& part) {
      if (const Local* local = as<Local>(part)) locals.insert(let_index_.at(local->name));
    });
    return locals;
  }

  /// Visits each distinct node once.
  static void for_each_node(const Expr& e, const std::function<void(const Expr&)>& f) {
    std::unordered_set<const Node*> seen;
    const std::function<void(const Expr&)> pass = [&](const Expr& part) {
      if (!seen.insert(&part.node()).second) return;
      f(part);
      for_each_child(part, pass);
    };
    pass(e);
  }

  /// Visits each node: equal decisions may use different lets.
  void find_decisions() {
    std::unordered_set<const Node*> seen;
    const std::function<void(const Expr&)> pass = [&](const Expr& e) {
      if (!seen.insert(&e.node()).second) return;
      if (is_decision(e)) values_[numbering_.number(e)].decisive.merge(locals_in(e));
      for_each_child(e, pass);
    };
    for (const Let& let : terms_.lets) pass(let.value);
    for (const ReadBars& read : terms_.reads) {
      for (const auto& [k, term] : read.by_offset) pass(term);
    }
    for (const auto& [name, term] : terms_.params) pass(term);
  }

  /// Walks the terms with stored values as leaves: ranks values in order of appearance, and finds lets on which
  /// decisions depend.
  void walk() {
    for (Known& value : values_) {
      value.is_seen = value.is_seen_as_written = false;
      value.rank = -1;
    }
    last_rank_ = 0;
    decisive_ = {};
    for (std::size_t i = 0; i < lets_.size(); ++i) see(lets_[i], is_decisive_[i]);
    for (const int root : roots_) see(root, false);
    for (std::size_t i = lets_.size(); i-- > 0;) {
      is_decisive_[i] = decisive_.contains(i);
      if (is_decisive_[i]) decisive_.merge(locals_[i]);
    }
  }

  void see(int number, bool as_written) {
    Known& value = values_[number];
    bool& is_seen = as_written ? value.is_seen_as_written : value.is_seen;
    if (is_seen) return;
    is_seen = true;
    if (value.is_stored && !as_written) return;
    if (value.is_decision) decisive_.merge(value.decisive);
    for (const int child : numbering_[number].children) see(child, as_written || value.is_decision);
    if (value.rank < 0) value.rank = last_rank_++;
  }

  /// Number of displacements at which each value is needed. Parents come first, as their numbers are larger. The rows
  /// of bits are one array, for speed: the count is repeated for each stored value.
  std::vector<int> count_displacements() const {
    const std::size_t words = used_.size() / 64 + 1;
    std::vector<std::uint64_t> needed(values_.size() * words);
    const auto row = [&](int number) { return needed.data() + static_cast<std::size_t>(number) * words; };
    for (std::size_t displacement = 0; displacement < used_.size(); ++displacement) {
      for (const int number : used_[displacement])
        row(number)[displacement / 64] |= std::uint64_t{1} << displacement % 64;
    }
    std::vector<int> counts(values_.size());
    for (int n = size() - 1; n >= 0; --n) {
      for (std::size_t word = 0; word < words; ++word) counts[n] += std::popcount(row(n)[word]);
      if (counts[n] == 0 || values_[n].is_stored || values_[n].is_decision) continue;
      for (const int child : numbering_[n].children) {
        for (std::size_t word = 0; word < words; ++word) row(child)[word] |= row(n)[word];
      }
    }
    return counts;
  }

  /// Values that must not be stored: truth values, uniform or interpolated values, parts of lets on which a decision
  /// depends, and values computed from stored ones.
  std::vector<bool> find_unfit() const {
    std::vector<bool> is_kept(values_.size()), is_made_of_stored(values_.size()), unfit(values_.size());
    const std::function<void(int)> keep_parts = [&](int number) {
      for (const int child : numbering_[number].children) {
        if (is_kept[child]) continue;
        is_kept[child] = true;
        keep_parts(child);
      }
    };
    for (std::size_t i = 0; i < lets_.size(); ++i) {
      if (is_decisive_[i]) keep_parts(lets_[i]);
    }
    for (int n = 0; n < size(); ++n) {
      const Known& value = values_[n];
      is_made_of_stored[n] =
          value.is_stored || (!value.is_decision && std::ranges::any_of(numbering_[n].children, [&](int child) {
            return is_made_of_stored[child];
          }));
      unfit[n] = !value.is_number || !value.is_whole || numbering_[n].uniform || is_kept[n] || is_made_of_stored[n];
    }
    return unfit;
  }

  const PointTerms terms_;
  Numbering numbering_;
  std::vector<Known> values_;  // by number
  std::size_t loads_ = 0;      // number of distinct loads
  std::map<std::string, std::size_t> let_index_;
  std::vector<int> lets_;               // the number of each
  std::vector<Bits> locals_;            // lets that occur in each let
  std::vector<int> roots_;              // the terms, in order
  std::vector<std::vector<int>> used_;  // terms by displacement
  std::vector<bool> is_decisive_;       // for each let
  Bits decisive_;                       // decisive lets found so far
  int last_rank_ = 0;
  std::map<int, Expr> fields_;  // by the number of their value
  std::vector<Let> stored_;
};

SharedValues::SharedValues(PointTerms terms) : search_(std::make_unique<Search>(std::move(terms))) {}
SharedValues::~SharedValues() = default;
std::optional<SharedValues::Found> SharedValues::best(int least) { return search_->best(least); }
void SharedValues::store(const Found& found, const std::string& field) { search_->store(found, field); }
PointTerms SharedValues::terms() const { return search_->terms(); }
const std::vector<Let>& SharedValues::stored() const { return search_->stored(); }

}  // namespace dpde::adjoint
