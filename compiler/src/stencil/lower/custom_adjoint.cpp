// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/custom_adjoint.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <set>
#include <vector>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

/// How an expression depends on seeds.
enum class Dependence { none, linear, other };

Dependence dependence(const Expr& e, const Kernel& kernel);

Dependence of_product(const Binary& b, Dependence left, Dependence right) {
  if (b.op == BinaryOp::add || b.op == BinaryOp::subtract) {
    const bool both = (left == Dependence::linear || is_literal(b.left, 0)) &&
                      (right == Dependence::linear || is_literal(b.right, 0));
    return both ? Dependence::linear : Dependence::other;
  }
  if (b.op == BinaryOp::multiply && left == Dependence::none) return right;
  const bool scales = b.op == BinaryOp::multiply || b.op == BinaryOp::divide;
  return scales && right == Dependence::none ? left : Dependence::other;
}

Dependence of_branches(const Select& s, const Kernel& kernel) {
  const auto fits = [&](const Expr& e) { return is_literal(e, 0) || dependence(e, kernel) == Dependence::linear; };
  return dependence(s.condition, kernel) == Dependence::none && fits(s.yes) && fits(s.no) ? Dependence::linear
                                                                                          : Dependence::other;
}

Dependence dependence(const Expr& e, const Kernel& kernel) {
  bool holds_seed = false;
  visit(e, [&](const Expr& part) {
    const Access* a = as<Access>(part);
    const Interp* i = as<Interp>(part);
    holds_seed = holds_seed || (a && seeded_by(kernel, a->field)) || (i && seeded_by(kernel, i->field));
  });
  if (!holds_seed) return Dependence::none;
  if (is<Access>(e)) return Dependence::linear;
  if (const Neg* neg = as<Neg>(e)) return dependence(neg->operand, kernel);
  if (const Select* select = as<Select>(e)) return of_branches(*select, kernel);
  const Binary* b = as<Binary>(e);
  return b ? of_product(*b, dependence(b->left, kernel), dependence(b->right, kernel)) : Dependence::other;
}

/// `e` with each read replaced for which `f` returns an expression.
Expr replace_reads(const Expr& e, const std::function<std::optional<Expr>(const Access&)>& f) {
  if (const Access* a = as<Access>(e)) return f(*a).value_or(e);
  return map_children(e, [&](const Expr& child) { return replace_reads(child, f); });
}

/// The offsets at which `kernel` reads the field, in lets too; nullopt if it interpolates the field.
std::optional<std::set<Offset>> offsets_read(const Kernel& kernel, const std::string& field) {
  std::set<Offset> offsets;
  bool interpolates = false;
  visit(kernel, [&](const Expr& e) {
    const Access* a = as<Access>(e);
    const Interp* i = as<Interp>(e);
    if (a && a->field == field) offsets.insert(a->offset);
    interpolates = interpolates || (i && i->field == field);
  });
  return interpolates ? std::nullopt : std::optional(offsets);
}

Offset minus(const Offset& k) { return {-k[0], -k[1], -k[2]}; }

std::string place(const std::string& field, const Offset& k, int rank) {
  std::vector<std::string> parts;
  for (int axis = 0; axis < rank; ++axis)
    parts.push_back(k[axis] > 0 ? fmt::format("+{}", k[axis]) : fmt::format("{}", k[axis]));
  return k == Offset{} ? field : fmt::format("{}[{}]", field, fmt::join(parts, ", "));
}

std::string seed_in(const Kernel& kernel, const Expr& term) {
  std::string name;
  visit(term, [&](const Expr& e) {
    const Access* a = as<Access>(e);
    if (a && name.empty() && seeded_by(kernel, a->field)) name = a->field;
  });
  return name;
}

/// A term with seeds at k is the effect of the input here on the kernel's result at k: the kernel reads the input at
/// -k.
std::optional<CustomAdjointViolation> problem_of_seeds(const Kernel& kernel, const CustomAdjoint& given,
                                                       const Offset& k, const Expr& term) {
  const std::string seed = seed_in(kernel, term);
  if (seed.empty()) return std::nullopt;
  const Signature s = signature(kernel);
  const bool is_param = std::find(s.params.begin(), s.params.end(), given.input) != s.params.end();
  if (is_param && k != Offset{}) {
    return CustomAdjointViolation{fmt::format("reads {}", place(seed, k, kernel.rank)),
                                  "the contribution of a point has only the seed of that point"};
  }
  const auto offsets = offsets_read(kernel, given.input);
  if (is_param || !offsets || offsets->contains(minus(k))) return std::nullopt;
  return CustomAdjointViolation{
      fmt::format("has a term with {}, but the kernel does not read {}", place(seed, k, kernel.rank),
                  place(given.input, minus(k), kernel.rank)),
      "a value read at offset +k has its seed at -k: the offsets of seeds have the opposite sign"};
}

/// The factors of a seed at k may contain only values that the kernel reads when it runs at k.
std::optional<CustomAdjointViolation> problem_of_factors(const Kernel& kernel, const Offset& k, const Expr& term) {
  const Signature s = signature(kernel);
  std::optional<CustomAdjointViolation> problem;
  const auto look = [&](const std::string& field, const Offset& offset) {
    const Signature::Read* read = s.find_read(field);
    bool known = read != nullptr;
    for (int axis = 0; known && axis < kernel.rank; ++axis)
      known = std::abs(offset[axis] - k[axis]) <= read->halo[axis];
    if (known || field == "x" || field == "y" || field == "z" || seeded_by(kernel, field)) return;
    problem = CustomAdjointViolation{fmt::format("reads {} in a term with {}", place(field, offset, kernel.rank),
                                                 place(seed_in(kernel, term), k, kernel.rank)),
                                     "a term with a seed holds only values that the kernel reads around that point"};
  };
  visit(term, [&](const Expr& e) {
    if (const Access* a = as<Access>(e)) look(a->field, a->offset);
    if (const Interp* i = as<Interp>(e)) look(i->field, i->offset);
  });
  return problem;
}

}  // namespace

const std::string* seeded_by(const Kernel& kernel, const std::string& name) {
  const auto found =
      std::find_if(kernel.stores.begin(), kernel.stores.end(), [&](const Store& s) { return bar_of(s.field) == name; });
  if (found != kernel.stores.end()) return &found->field;
  const auto sum =
      std::find_if(kernel.sums.begin(), kernel.sums.end(), [&](const Sum& s) { return bar_of(s.name) == name; });
  return sum == kernel.sums.end() ? nullptr : &sum->name;
}

const CustomAdjoint* find_custom_adjoint(const Kernel& kernel, const std::string& input) {
  const auto found = std::find_if(kernel.custom_adjoints.begin(), kernel.custom_adjoints.end(),
                                  [&](const CustomAdjoint& g) { return g.input == input; });
  return found == kernel.custom_adjoints.end() ? nullptr : &*found;
}

std::map<Offset, Expr> terms_by_seed(const Kernel& kernel, const Expr& formula) {
  std::map<Offset, Expr> terms;
  visit(formula, [&](const Expr& e) {
    const Access* a = as<Access>(e);
    if (a && seeded_by(kernel, a->field)) terms.emplace(a->offset, 0.0);
  });
  for (auto& [k, term] : terms) {
    term = replace_reads(formula, [&, here = k](const Access& a) -> std::optional<Expr> {
      if (a.offset == here || !seeded_by(kernel, a.field)) return std::nullopt;
      return Expr(0.0);
    });
  }
  return terms;
}

std::optional<CustomAdjointViolation> find_problem(const Kernel& kernel, const CustomAdjoint& given) {
  if (!kernel.scatters.empty()) {
    return CustomAdjointViolation{
        "belongs to a kernel with interp(...) +=",
        "move what interp(...) += adds into a kernel of its own, whose adjoint is derived, and give "
        "this one to the rest"};
  }
  if (is_literal(given.value, 0)) return std::nullopt;
  if (dependence(given.value, kernel) != Dependence::linear) {
    std::vector<std::string> seeds;
    for (const Store& store : kernel.stores) seeds.push_back(bar_of(store.field));
    for (const Sum& sum : kernel.sums) seeds.push_back(bar_of(sum.name));
    return CustomAdjointViolation{fmt::format("is not linear in {}", fmt::join(seeds, ", ")),
                                  "each term is a seed times what has no seed: a transpose is nothing else"};
  }
  for (const auto& [k, term] : terms_by_seed(kernel, given.value)) {
    if (const auto problem = problem_of_seeds(kernel, given, k, term)) return problem;
    if (const auto problem = problem_of_factors(kernel, k, term)) return problem;
  }
  return std::nullopt;
}

Kernel without_idle_formulas(Kernel kernel) {
  if (kernel.custom_adjoints.empty()) return kernel;
  const Signature s = signature(kernel);
  std::erase_if(kernel.custom_adjoints, [&](const CustomAdjoint& given) {
    return !s.find_read(given.input) && std::find(s.params.begin(), s.params.end(), given.input) == s.params.end();
  });
  return kernel;
}

Kernel with_stores_only(Kernel kernel, const std::set<std::string>& fields) {
  for (CustomAdjoint& given : kernel.custom_adjoints) {
    given.value = replace_reads(given.value, [&](const Access& a) -> std::optional<Expr> {
      const std::string* stored = seeded_by(kernel, a.field);
      const bool is_sum =
          stored && std::ranges::any_of(kernel.sums, [&](const Sum& sum) { return sum.name == *stored; });
      return stored && !is_sum && !fields.contains(*stored) ? std::optional<Expr>(0.0) : std::nullopt;
    });
  }
  std::erase_if(kernel.stores, [&](const Store& store) { return !fields.contains(store.field); });
  return without_idle_formulas(std::move(kernel));
}

}  // namespace dpde::stencil
