// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dpde::stencil {

namespace {

/// Instructions of `+ coefficient * monomial`: the last multiplication is a fused multiply-add.
int cost(const Powers& monomial, const Coefficient& c) {
  return std::max(1, degree(monomial) - (is_sign(c) || monomial.empty() ? 1 : 0));
}

int cost(const Polynomial& p) {
  int total = 0;
  bool starts_free = false;  // a term without a product starts the sum
  for (const auto& [monomial, c] : p) {
    total += cost(monomial, c);
    starts_free = starts_free || monomial.empty() || (degree(monomial) == 1 && is_sign(c));
  }
  return total - (starts_free ? 1 : 0);
}

/// An occurrence of divisor * atom (or its negative) in a sum.
struct Occurrence {
  Polynomial* sum;
  int number;  // of the sum, in the order of processing
  int atom;
  bool negative;
  int saved = 0;  // instructions, if it becomes one term

  auto order() const { return std::pair(number, atom); }
};

/// The terms that form divisor * atom at `place`; none if one of them is missing (by now).
Polynomial terms_at(const Occurrence& place, const Polynomial& divisor) {
  Polynomial terms;
  for (const auto& [monomial, c] : divisor) {
    const auto term = place.sum->find(product(monomial, {{place.atom, 1}}));
    if (term == place.sum->end() || term->second != (place.negative ? negated(c) : c)) return {};
    terms.insert(*term);
  }
  return terms;
}

struct FactorCandidate {
  Polynomial divisor;
  std::vector<Occurrence> places;  // none: the divisor is a product of two atoms, wherever it occurs
  int saved = 0;
};

/// Candidates for factoring. Factoring one out changes few sums: the entries of the others are reused.
class Candidates {
 public:
  void add(Polynomial& sum, int number) {
    for (const auto& [atom, quotient] : quotients_of(sum)) {
      const auto [divisor, negative] = divisor_of(quotient);
      Occurrence place{&sum, number, atom, negative};
      for (const auto& [monomial, c] : terms_at(place, divisor)) place.saved += cost(monomial, c);
      place.saved -= 1;
      const auto [entry, is_new] = divisors_.try_emplace(divisor);
      if (is_new) entry->second.saved = -cost(divisor);
      entry->second.saved += place.saved;
      std::vector<Occurrence>& places = entry->second.places;
      places.insert(std::ranges::lower_bound(places, place.order(), {}, &Occurrence::order), place);
    }
    for_each_pair(sum, [&](const Powers& pair, int saved) { pairs_[pair] += saved; });
  }

  /// Removes the candidates of a sum, which must be unchanged since it was added.
  void remove(const Polynomial& sum, int number) {
    for (const auto& [atom, quotient] : quotients_of(sum)) {
      const auto entry = divisors_.find(divisor_of(quotient).first);
      std::vector<Occurrence>& places = entry->second.places;
      const auto place = std::ranges::lower_bound(places, std::pair(number, atom), {}, &Occurrence::order);
      entry->second.saved -= place->saved;
      places.erase(place);
      if (places.empty()) divisors_.erase(entry);
    }
    for_each_pair(sum, [&](const Powers& pair, int saved) { pairs_[pair] -= saved; });
  }

  /// The best common divisor: a sum that several terms with a common atom have as cofactor.
  FactorCandidate best_sum(First first) const {
    const std::pair<const Polynomial, Found>* best = nullptr;
    for (const auto& candidate : divisors_) {
      const auto& [places, saved] = candidate.second;
      const bool is_best_alone = best != nullptr && best->second.places.size() == 1,
                 is_best_shared = best != nullptr && best->second.places.size() > 1;
      const bool goes_first = first == First::shared && places.size() > 1 && is_best_alone && saved > 0;
      const bool goes_last = first == First::shared && places.size() == 1 && is_best_shared;
      if (goes_first || (saved > (best == nullptr ? 0 : best->second.saved) && !goes_last)) best = &candidate;
    }
    return best == nullptr ? FactorCandidate{} : FactorCandidate{best->first, best->second.places, best->second.saved};
  }

  FactorCandidate best_pair() const {
    const std::pair<const Powers, int>* best = nullptr;
    for (const auto& candidate : pairs_) {
      if (candidate.second - 1 > (best == nullptr ? 0 : best->second - 1)) best = &candidate;
    }
    return best == nullptr ? FactorCandidate{}
                           : FactorCandidate{{{best->first, unit_coefficient}}, {}, best->second - 1};
  }

 private:
  struct Found {
    std::vector<Occurrence> places;
    int saved = 0;
  };

  /// Cofactors with two or more terms, by atom.
  static std::map<int, Polynomial> quotients_of(const Polynomial& sum) {
    std::map<int, Polynomial> quotients;
    for (const auto& [monomial, c] : sum) {
      for (const auto& [atom, exponent] : monomial) quotients[atom].emplace(without(monomial, atom), c);
    }
    std::erase_if(quotients, [](const auto& quotient) { return quotient.second.size() < 2; });
    return quotients;
  }

  /// The quotient up to sign, and whether it is the negative.
  static std::pair<Polynomial, bool> divisor_of(const Polynomial& quotient) {
    const bool negative = quotient.begin()->second.begin()->second < 0;
    return {negative ? negated(quotient) : quotient, negative};
  }

  /// Reports each product of two atoms, and the instructions that a term saves if it is available.
  template <class Tell>
  static void for_each_pair(const Polynomial& sum, const Tell& tell) {
    for (const auto& [monomial, c] : sum) {
      for (auto x = monomial.begin(); x != monomial.end(); ++x) {
        for (auto y = x; y != monomial.end(); ++y) {
          if (x == y && x->second < 2) continue;
          tell(product({{x->first, 1}}, {{y->first, 1}}), cost(monomial, c) - std::max(1, cost(monomial, c) - 1));
        }
      }
    }
  }

  std::map<Polynomial, Found> divisors_;
  std::map<Powers, int> pairs_;
};

class Factoring {
 public:
  Factoring(const std::vector<Polynomial>& sums, Atoms& atoms, First first) : atoms_(atoms), first_(first) {
    result_.sums = sums;
    for (int i = 0; i < atoms.size(); ++i) {
      if (atoms[i].definition) result_.definitions[i] = *atoms[i].definition;
    }
    for (const auto& [number, sum] : all_sums()) candidates_.add(*sum, number);
  }

  Factored run() {
    for (FactorCandidate best = find_best(); best.saved > 0; best = find_best()) take_out(best);
    return std::move(result_);
  }

 private:
  int number_of_definition(int atom) const { return static_cast<int>(result_.sums.size()) + atom; }

  std::vector<std::pair<int, Polynomial*>> all_sums() {
    std::vector<std::pair<int, Polynomial*>> all;
    for (Polynomial& sum : result_.sums) all.emplace_back(static_cast<int>(all.size()), &sum);
    for (auto& [atom, sum] : result_.definitions) all.emplace_back(number_of_definition(atom), &sum);
    return all;
  }

  FactorCandidate find_best() const {
    FactorCandidate best = candidates_.best_sum(first_);
    FactorCandidate pair = candidates_.best_pair();
    const bool sum_goes_first = first_ == First::shared && best.places.size() > 1;
    return pair.saved > best.saved && !sum_goes_first ? pair : best;
  }

  void replace(Polynomial& sum, int number, Polynomial by) {
    candidates_.remove(sum, number);
    sum = std::move(by);
    candidates_.add(sum, number);
  }

  void take_out(const FactorCandidate& candidate) {
    const int atom = atoms_.of(candidate.divisor);
    if (candidate.places.empty()) take_out_pair(candidate.divisor.begin()->first, atom);
    for (const Occurrence& place : candidate.places) {
      const Polynomial terms = terms_at(place, candidate.divisor);
      if (terms.empty()) continue;
      Polynomial rest = *place.sum;
      for (const auto& [monomial, c] : terms) rest.erase(monomial);
      const Coefficient one = place.negative ? negated(unit_coefficient) : unit_coefficient;
      replace(*place.sum, place.number, sum(rest, {{product({{place.atom, 1}}, {{atom, 1}}), one}}));
    }
    const auto [defined, is_new] = result_.definitions.emplace(atom, candidate.divisor);
    if (is_new) candidates_.add(defined->second, number_of_definition(atom));
  }

  void take_out_pair(const Powers& pair, int atom) {
    if (const auto known = result_.definitions.find(atom); known != result_.definitions.end()) {
      candidates_.remove(known->second, number_of_definition(atom));
      result_.definitions.erase(known);  // never defined by itself
    }
    for (const auto& [number, sum] : all_sums()) {
      const bool is_there = std::ranges::any_of(*sum, [&](const auto& term) { return has_pair(term.first, pair); });
      if (is_there) replace(*sum, number, with_pair_as(*sum, pair, atom));
    }
  }

  static bool has_pair(const Powers& monomial, const Powers& pair) {
    return std::ranges::all_of(pair, [&](const auto& factor) {
      const auto found = monomial.find(factor.first);
      return found != monomial.end() && found->second >= factor.second;
    });
  }

  static Polynomial with_pair_as(const Polynomial& p, const Powers& pair, int atom) {
    Polynomial result;
    for (const auto& [monomial, c] : p) {
      Powers rest = monomial;
      if (has_pair(monomial, pair)) {
        for (const auto& [factor, exponent] : pair) rest = product(rest, {{factor, -exponent}});
        rest = product(rest, {{atom, 1}});
      }
      result = sum(std::move(result), {{rest, c}});
    }
    return result;
  }

  Atoms& atoms_;
  First first_;
  Factored result_;
  Candidates candidates_;
};

}  // namespace

bool is_sign(const Coefficient& c) {
  return c.size() == 1 && c.begin()->first.empty() && std::abs(c.begin()->second) == 1;
}

int degree(const Powers& monomial) {
  int total = 0;
  for (const auto& [atom, exponent] : monomial) total += exponent;
  return total;
}

Factored factor(const std::vector<Polynomial>& sums, Atoms& atoms, First first) {
  return Factoring(sums, atoms, first).run();
}

}  // namespace dpde::stencil
