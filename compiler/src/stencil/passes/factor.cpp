// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/factor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dpde::stencil {

namespace {

/// Instructions of `+ coefficient * monomial`: the last multiplication adds too.
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

/// divisor * atom (or minus that) occurs in a sum.
struct Place {
  Polynomial* sum;
  int atom;
  bool negative;
};

/// The terms at a place that make up divisor * atom; none if one of them is not there (any more).
Polynomial terms_at(const Place& place, const Polynomial& divisor) {
  Polynomial terms;
  for (const auto& [monomial, c] : divisor) {
    const auto term = place.sum->find(product(monomial, {{place.atom, 1}}));
    if (term == place.sum->end() || term->second != (place.negative ? negated(c) : c)) return {};
    terms.insert(*term);
  }
  return terms;
}

struct Candidate {
  Polynomial divisor;
  std::vector<Place> places;  // none: the divisor is a product of two atoms, wherever it occurs
  int saved = 0;
};

class Factoring {
 public:
  Factoring(const std::vector<Polynomial>& sums, Atoms& atoms, First first) : atoms_(atoms), first_(first) {
    result_.sums = sums;
    for (int i = 0; i < atoms.size(); ++i) {
      if (atoms[i].definition) result_.definitions[i] = *atoms[i].definition;
    }
  }

  Factored run() {
    for (Candidate best = find_best(); best.saved > 0; best = find_best()) take_out(best);
    return std::move(result_);
  }

 private:
  std::vector<Polynomial*> all_sums() {
    std::vector<Polynomial*> all;
    for (Polynomial& sum : result_.sums) all.push_back(&sum);
    for (auto& [atom, sum] : result_.definitions) all.push_back(&sum);
    return all;
  }

  Candidate find_best() {
    Candidate best = best_sum();
    Candidate pair = best_pair();
    const bool sum_goes_first = first_ == First::shared && best.places.size() > 1;
    return pair.saved > best.saved && !sum_goes_first ? pair : best;
  }

  /// Sums that terms with one atom in common have beside it.
  Candidate best_sum() {
    std::map<Polynomial, std::vector<Place>> divisors;
    for (Polynomial* sum : all_sums()) {
      std::map<int, Polynomial> quotients;
      for (const auto& [monomial, c] : *sum) {
        for (const auto& [atom, exponent] : monomial) quotients[atom].emplace(without(monomial, atom), c);
      }
      for (const auto& [atom, quotient] : quotients) {
        if (quotient.size() < 2) continue;
        const bool negative = quotient.begin()->second.begin()->second < 0;
        divisors[negative ? negated(quotient) : quotient].push_back({sum, atom, negative});
      }
    }
    Candidate best;
    for (const auto& [divisor, places] : divisors) {
      int saved = -cost(divisor);
      for (const Place& place : places) {
        for (const auto& [monomial, c] : terms_at(place, divisor)) saved += cost(monomial, c);
        saved -= 1;
      }
      const bool goes_first = first_ == First::shared && places.size() > 1 && best.places.size() == 1 && saved > 0;
      const bool goes_last = first_ == First::shared && places.size() == 1 && best.places.size() > 1;
      if (goes_first || (saved > best.saved && !goes_last)) best = {divisor, places, saved};
    }
    return best;
  }

  Candidate best_pair() {
    std::map<Powers, int> saved;
    for (Polynomial* sum : all_sums()) {
      for (const auto& [monomial, c] : *sum) {
        for (auto x = monomial.begin(); x != monomial.end(); ++x) {
          for (auto y = x; y != monomial.end(); ++y) {
            if (x == y && x->second < 2) continue;
            saved[product({{x->first, 1}}, {{y->first, 1}})] += cost(monomial, c) - std::max(1, cost(monomial, c) - 1);
          }
        }
      }
    }
    Candidate best;
    for (const auto& [pair, savings] : saved) {
      if (savings - 1 > best.saved) best = {{{pair, unit_coefficient}}, {}, savings - 1};
    }
    return best;
  }

  void take_out(const Candidate& candidate) {
    const int atom = atoms_.of(candidate.divisor);
    if (candidate.places.empty()) {
      result_.definitions.erase(atom);  // it may be known: not in terms of itself
      for (Polynomial* sum : all_sums()) *sum = with_pair_as(*sum, candidate.divisor.begin()->first, atom);
    }
    for (const Place& place : candidate.places) {
      const Polynomial terms = terms_at(place, candidate.divisor);
      if (terms.empty()) continue;
      for (const auto& [monomial, c] : terms) place.sum->erase(monomial);
      *place.sum = sum(*place.sum, {{product({{place.atom, 1}}, {{atom, 1}}),
                                     place.negative ? negated(unit_coefficient) : unit_coefficient}});
    }
    result_.definitions.emplace(atom, candidate.divisor);
  }

  static Polynomial with_pair_as(const Polynomial& p, const Powers& pair, int atom) {
    Polynomial result;
    for (const auto& [monomial, c] : p) {
      const bool has = std::all_of(pair.begin(), pair.end(), [&](const auto& factor) {
        const auto found = monomial.find(factor.first);
        return found != monomial.end() && found->second >= factor.second;
      });
      Powers rest = monomial;
      if (has) {
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
