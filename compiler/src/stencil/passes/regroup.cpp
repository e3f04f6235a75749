// SPDX-License-Identifier: Apache-2.0
// Algebra of updates: u - dt*(u*(u[+1] - u[-1])/(2*h) - ...) becomes centre*u + west*u[-1] + east*u[+1] with
// west = c + a*u, which the stores of all components share. A kernel is rewritten only where it has fewer instructions.
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
#include "support/name_supply.h"

namespace dpde::stencil {

namespace {

constexpr std::size_t most_terms = 200;  // of a kernel: above that the search takes longer than it saves

/// Writes polynomials as expressions; what atoms stand for becomes a let.
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

  Expr write(const Polynomial& p) {
    Expr result = 0.0;
    for (const auto& [c, monomials] : by_coefficient(p)) {
      Expr group = 0.0;
      for (const auto& [monomial, negative] : monomials) {
        const Expr factors = write(monomial);
        group = negative ? group - factors : group + factors;
      }
      result = result + write(c) * group;
    }
    return result;
  }
  const std::vector<Let>& lets() const { return lets_; }

 private:
  struct Group {
    Coefficient c;
    std::vector<std::pair<Monomial, bool>> terms;  // and whether with -c
  };

  /// Terms with the same coefficient but for its sign, in order of first appearance; the constant first.
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

  Expr write(const Monomial& monomial) {
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

  static bool is_leaf(const Atom& atom) {
    return atom.uniform || std::holds_alternative<Access>(atom.value->kind) || std::holds_alternative<Inside>(atom.value->kind);
  }

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

int instructions(const Expr& e);

bool is_product(const Expr& e) {
  if (const Neg* n = std::get_if<Neg>(&e->kind)) return is_product(n->operand);
  const Binary* b = std::get_if<Binary>(&e->kind);
  return b && (b->op == BinaryOp::multiply || b->op == BinaryOp::divide) && !is_uniform(e);
}

/// A product at a point: all its uniform factors are one.
struct Product {
  int factors = 0;  // that vary
  bool scaled = false;
  int inside = 0;  // instructions that make the factors
  int multiplications() const { return factors - (scaled ? 0 : 1); }

  void add(const Expr& e) {
    if (is_uniform(e)) {
      scaled = true;
    } else if (const Neg* n = std::get_if<Neg>(&e->kind)) {
      add(n->operand);
    } else if (is_product(e)) {
      add(std::get<Binary>(e->kind).left);
      add(std::get<Binary>(e->kind).right);
    } else {
      ++factors;
      inside += instructions(e);
    }
  }
};

Product product_of(const Expr& e) {
  Product product;
  product.add(e);
  return product;
}

/// Instructions of an expression at each point; an addition next to a multiplication costs nothing (FMA).
int instructions(const Expr& e) {
  if (is_uniform(e)) return 0;
  if (is_product(e)) return product_of(e).inside + product_of(e).multiplications();
  int total = 0;
  for_each_child(e, [&](const Expr& child) { total += instructions(child); });
  const Binary* b = std::get_if<Binary>(&e->kind);
  if (!b) return total + (std::holds_alternative<Call>(e->kind) || std::holds_alternative<Select>(e->kind) ? 1 : 0);
  const bool adds = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
  const auto multiplies = [](const Expr& x) { return is_product(x) && product_of(x).multiplications() > 0; };
  return total + (adds && (multiplies(b->left) || multiplies(b->right)) ? 0 : 1);
}

int instructions(const Kernel& kernel) {
  int total = 0;
  map_kernel(kernel, [&](const Expr& e) {
    total += instructions(e);
    return e;
  });
  return total;
}

bool is_finite(const Polynomial& p) {
  for (const auto& [monomial, c] : p) {
    for (const auto& [uniform, number] : c) {
      if (!std::isfinite(number)) return false;
    }
  }
  return true;
}

/// Stores of a kernel that are updates, as polynomials.
struct Updates {
  Atoms atoms;
  std::vector<std::size_t> stores;
  std::vector<Polynomial> values;
};

/// Fields that are updates of one another: a state and those of its stages. Rounding errors of one are no larger than the others'.
class Families {
 public:
  explicit Families(const Module& module) {
    for (const Kernel& kernel : module.kernels) {
      Atoms atoms;
      Expansion expansion(kernel, atoms);
      for (const Store& store : kernel.stores) join(store.field, expansion.carried_fields(store.value));
    }
  }
  /// With all that are of the family of one of them.
  std::set<std::string> closure(const std::set<std::string>& fields) const {
    std::set<std::string> result = fields;
    for (const std::set<std::string>& family : families_) {
      if (std::ranges::any_of(family, [&](const std::string& field) { return fields.contains(field); })) result.insert(family.begin(), family.end());
    }
    return result;
  }

 private:
  void join(const std::string& field, const std::set<std::string>& carried) {
    if (carried.empty()) return;
    std::set<std::string> joined = carried;
    joined.insert(field);
    joined = closure(joined);
    std::erase_if(families_, [&](const std::set<std::string>& family) { return joined.contains(*family.begin()); });
    families_.push_back(std::move(joined));
  }

  std::vector<std::set<std::string>> families_;  // disjoint, none empty
};

/// None if a number overflows or there are too many terms.
std::optional<Updates> updates_of(const Kernel& kernel, const Families& families) {
  Updates updates;
  Expansion expansion(kernel, updates.atoms);
  std::size_t terms = 0;
  for (std::size_t s = 0; s < kernel.stores.size(); ++s) {
    const Expr& value = kernel.stores[s].value;
    const std::set<std::string> carried = families.closure(expansion.carried_fields(value));
    if (carried.empty()) continue;
    updates.stores.push_back(s);
    updates.values.push_back(expansion.expand(value, carried));
    terms += updates.values.back().size();
    if (!is_finite(updates.values.back()) || terms > most_terms) return std::nullopt;
  }
  return updates;
}

Kernel regrouped(const Kernel& kernel, Updates updates, First first) {
  const Factored factored = factor(updates.values, updates.atoms, first);
  Writer writer(kernel, updates.atoms, factored);
  Kernel result = kernel;
  for (std::size_t i = 0; i < updates.stores.size(); ++i) result.stores[updates.stores[i]].value = writer.write(factored.sums[i]);
  result.lets.insert(result.lets.end(), writer.lets().begin(), writer.lets().end());
  return with_lets_inlined(result);
}

Kernel cheapest(const Kernel& kernel, const Families& families) {
  const std::optional<Updates> updates = updates_of(kernel, families);
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
  const Families families(module);
  Module result = module;
  for (Kernel& kernel : result.kernels) kernel = cheapest(kernel, families);
  return result;
}

}  // namespace dpde::stencil
