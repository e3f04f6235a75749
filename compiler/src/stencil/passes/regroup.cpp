// SPDX-License-Identifier: Apache-2.0
// Algebra of updates: u - dt*(u*(u[+1] - u[-1])/(2*h) - ...) becomes u + centre*u + west*u[-1] + east*u[+1] with
// west = c + a*u, which the stores of all components share. A kernel is rewritten only where it has fewer instructions.
// Terms of states at the point itself stay as written, such as u and (u_1 - u)/3: in (1 + centre)*u the rounding of
// 1 + centre would change u in the same direction in each step, and in u_1/3 - u/3 that of 1/3.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "stencil/build.h"
#include "stencil/passes/factor.h"
#include "stencil/passes/passes.h"
#include "stencil/passes/work.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

namespace {

/// Limit for a kernel, including terms of sums that are atoms: beyond it the search takes longer than it saves.
constexpr std::size_t most_terms = 500;

/// Writes polynomials as expressions; definitions of atoms become lets.
class Writer {
 public:
  Writer(const Kernel& kernel, const Atoms& atoms, const Factored& factored) : atoms_(atoms), factored_(factored) {
    const Signature s = signature(kernel);
    for (const Signature::Read& read : s.reads) names_.reserve(read.field);
    for (const auto* list : {&s.writes, &s.updates, &s.params, &s.sums}) {
      for (const std::string& name : *list) names_.reserve(name);
    }
    for (const Let& let : kernel.lets) names_.reserve(let.name);
  }

  /// `start` and the terms, one by one.
  Expr write(const Polynomial& p, Expr start = 0.0) {
    const bool has_start = !is_literal(start, 0);
    Expr result = std::move(start);
    for (const auto& [c, monomials] : by_coefficient(p)) {
      const bool is_plain = has_start && is_sign(c);  // each product is added directly (FMA)
      Expr group = 0.0;
      Expr& to = is_plain ? result : group;
      for (const auto& [monomial, negative] : monomials) {
        const Expr factors = write(monomial);
        to = negative != (is_plain && c != unit_coefficient) ? to - factors : to + factors;
      }
      if (!is_plain) result = result + write(c) * group;
    }
    return result;
  }
  const std::vector<Let>& lets() const { return lets_; }

 private:
  struct Group {
    Coefficient c;
    std::vector<std::pair<Powers, bool>> terms;  // true: with coefficient -c
  };

  /// Groups of terms with equal coefficients up to sign, in order of first appearance; the constant first.
  static std::vector<Group> by_coefficient(const Polynomial& p) {
    std::vector<Group> groups;
    for (const auto& [monomial, c] : p) {
      const bool alone = monomial.empty();
      const auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
        return !alone && !g.terms.front().first.empty() && (g.c == c || g.c == negated(c));
      });
      if (group == groups.end()) {
        groups.push_back({c, {{monomial, false}}});
      } else {
        group->terms.push_back({monomial, group->c != c});
      }
    }
    return groups;
  }

  Expr write(const Powers& monomial) {
    Expr result = 1.0;
    for (const auto& [index, exponent] : monomial) {
      const Expr factor = value_of(index);
      for (int i = 0; i < std::abs(exponent); ++i) result = exponent > 0 ? result * factor : result / factor;
    }
    return result;
  }

  Expr write(const Coefficient& c) {
    Expr result = 0.0;
    for (const auto& [monomial, number] : c) {
      const Expr size = std::abs(number) * write(monomial);
      result = number < 0 ? result - size : result + size;
    }
    return result;
  }

  Expr value_of(int index) {
    const auto definition = factored_.definitions.find(index);
    if (definition == factored_.definitions.end() && is_leaf(atoms_[index])) return atoms_[index].value;
    const auto named = locals_.find(index);
    if (named != locals_.end()) return local(named->second);
    const Expr value = definition == factored_.definitions.end() ? atoms_[index].value : write(definition->second);
    const std::string name = fresh_name();
    lets_.push_back({name, value});
    locals_.emplace(index, name);
    return local(name);
  }

  static bool is_leaf(const Atom& atom) { return atom.uniform || is<Access, Inside>(atom.value); }

  std::string fresh_name() {
    std::string name;
    do {
      name = fmt::format("k{}", ++last_);
    } while (names_.is_used(name));
    return names_.fresh(name);
  }

  const Atoms& atoms_;
  const Factored& factored_;
  NameSupply names_;
  std::vector<Let> lets_;
  std::map<int, std::string> locals_;
  int last_ = 0;
};

bool is_finite(const Polynomial& p) {
  for (const auto& [monomial, c] : p) {
    for (const auto& [uniform, number] : c) {
      if (!std::isfinite(number)) return false;
    }
  }
  return true;
}

/// Whether `e` is linear in states at offset 0, with numeric weights.
bool is_of_states(const Expr& e, const std::set<std::string>& states) {
  if (const Access* access = as<Access>(e)) return access->offset == Offset{} && states.contains(access->field);
  if (const Neg* n = as<Neg>(e)) return is_of_states(n->operand, states);
  const Binary* b = as<Binary>(e);
  if (!b) return false;
  if (b->op == BinaryOp::add || b->op == BinaryOp::subtract)
    return is_of_states(b->left, states) && is_of_states(b->right, states);
  if (b->op == BinaryOp::divide) return is<Literal>(b->right) && is_of_states(b->left, states);
  return b->op == BinaryOp::multiply && is<Literal>(b->left) && is_of_states(b->right, states);
}

/// The parts of an update: a state, sums and differences of states, and the rest.
struct SumParts {
  Expr state = 0.0, differences = 0.0, rest = 0.0;

  void add(const Expr& e, bool negative, const std::set<std::string>& states) {
    if (is_of_states(e, states)) {
      const bool is_state = is<Access>(e) && !negative && is_literal(state, 0);
      Expr& part = is_state ? state : differences;
      part = negative ? part - e : part + e;
    } else if (const Neg* n = as<Neg>(e)) {
      add(n->operand, !negative, states);
    } else if (const Binary* b = as<Binary>(e); b && (b->op == BinaryOp::add || b->op == BinaryOp::subtract)) {
      add(b->left, negative, states);
      add(b->right, negative != (b->op == BinaryOp::subtract), states);
    } else {
      rest = negative ? rest - e : rest + e;
    }
  }
};

/// Stores of a kernel that are updates, with their rests as polynomials.
struct Updates {
  Atoms atoms;
  std::vector<std::size_t> stores;
  std::vector<SumParts> parts;
  std::vector<Polynomial> values;
};

/// Maps each stage to its root field: u_1 = u + dt*(...) and u_2 = (3*u + u_1)/4 + dt*(...) are stages of u. They have
/// the magnitude of u, and so have the rounding errors of c*u_1[k] in an update of u. A mean of fields with different
/// roots, or a difference, is not a stage.
class StagesOfUpdates {
 public:
  explicit StagesOfUpdates(const Module& module) {
    for (const Kernel& kernel : module.kernels) {
      Atoms atoms;
      Expansion expansion(kernel, atoms);
      for (const Store& store : kernel.stores) note(store, root_of(expansion.weights(store.value)));
    }
  }

  /// Fields, among those that its kernel reads, that an update is built from, or that have the same root.
  std::set<std::string> carried(const std::vector<Signature::Read>& reads, const Expr& value,
                                Expansion& expansion) const {
    std::set<std::string> fields = expansion.carried_fields(value);
    const std::optional<std::string> root = root_of(expansion.weights(value));
    if (!root) return fields;
    for (const Signature::Read& read : reads) {
      if (root_of(read.field) == *root) fields.insert(read.field);
    }
    return fields;
  }

 private:
  std::string root_of(const std::string& field) const {
    const auto found = roots_.find(field);
    return found == roots_.end() ? field : found->second;
  }
  /// The common root of all fields, if their weights add up to 1.
  std::optional<std::string> root_of(const std::map<std::string, double>& weights) const {
    double total = 0;
    for (const auto& [field, weight] : weights) {
      if (root_of(field) != root_of(weights.begin()->first)) return std::nullopt;
      total += weight;
    }
    if (std::abs(total - 1) > 1e-12) return std::nullopt;
    return root_of(weights.begin()->first);
  }
  /// A field whose stores have different roots is its own root.
  void note(const Store& store, const std::optional<std::string>& root) {
    const std::string found = root && !store.accumulate ? *root : store.field;
    const auto [entry, is_new] = roots_.emplace(store.field, found);
    if (!is_new && entry->second != found) entry->second = store.field;
  }

  std::map<std::string, std::string> roots_;
};

/// Number of terms in sums that are atoms.
std::size_t defined_terms(const Atoms& atoms) {
  std::size_t terms = 0;
  for (int i = 0; i < atoms.size(); ++i) terms += atoms[i].definition ? atoms[i].definition->size() : 0;
  return terms;
}

/// nullopt if a number overflows or there are too many terms.
std::optional<Updates> updates_of(const Kernel& kernel, const StagesOfUpdates& stages) {
  Updates updates;
  Expansion expansion(kernel, updates.atoms);
  const std::vector<Signature::Read> reads = signature(kernel).reads;
  std::size_t terms = 0;
  for (std::size_t s = 0; s < kernel.stores.size(); ++s) {
    const Expr& value = kernel.stores[s].value;
    const std::set<std::string> carried = stages.carried(reads, value, expansion);
    if (!expansion.is_complete()) return std::nullopt;
    if (carried.empty()) continue;
    updates.stores.push_back(s);
    updates.parts.emplace_back().add(value, false, carried);
    updates.values.push_back(expansion.expand(updates.parts.back().rest, carried));
    terms += updates.values.back().size();
    if (!expansion.is_complete() || !is_finite(updates.values.back()) || terms > most_terms) return std::nullopt;
  }
  if (terms + defined_terms(updates.atoms) > most_terms) return std::nullopt;
  return updates;
}

Kernel regrouped(const Kernel& kernel, Updates updates, First first) {
  const Factored factored = factor(updates.values, updates.atoms, first);
  Writer writer(kernel, updates.atoms, factored);
  Kernel result = kernel;
  for (std::size_t i = 0; i < updates.stores.size(); ++i) {
    const SumParts& parts = updates.parts[i];
    const bool is_alone = is_literal(parts.differences, 0);
    Expr& value = result.stores[updates.stores[i]].value;
    value = is_alone ? writer.write(factored.sums[i], parts.state)
                     : parts.state + writer.write(factored.sums[i], parts.differences);
  }
  result.lets.insert(result.lets.end(), writer.lets().begin(), writer.lets().end());
  return with_lets_inlined(result);
}

Kernel cheapest(const Kernel& kernel, const StagesOfUpdates& stages) {
  const std::optional<Updates> updates = updates_of(kernel, stages);
  if (!updates || updates->stores.empty()) return kernel;
  Kernel best = kernel;
  for (const First first : {First::shared, First::largest}) {
    const Kernel candidate = regrouped(kernel, *updates, first);
    if (instructions(candidate) < instructions(best)) best = candidate;
  }
  return best;
}

}  // namespace

Module regroup_updates(const Module& module) {
  const StagesOfUpdates stages(module);
  Module result = module;
  for (Kernel& kernel : result.kernels) kernel = cheapest(kernel, stages);
  return result;
}

}  // namespace dpde::stencil
