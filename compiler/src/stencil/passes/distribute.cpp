// SPDX-License-Identifier: Apache-2.0
// Saves multiplications by combining uniform factors: dt*(nu*a/hx^2 + v*b/(2*hx)) has a uniform factor outside and one
// in each term, dt*nu/hx^2*a + v*dt/(2*hx)*b only those of the terms. Equal up to rounding.
#include <string>
#include <unordered_map>
#include <vector>

#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/passes/polynomial.h"
#include "stencil/space/comparisons.h"

namespace dpde::stencil {

namespace {

const Binary* as_binary(const Expr& e, BinaryOp one, BinaryOp other) {
  const Binary* b = as<Binary>(e);
  return b && (b->op == one || b->op == other) ? b : nullptr;
}
const Binary* as_sum(const Expr& e) { return as_binary(e, BinaryOp::add, BinaryOp::subtract); }
const Binary* as_product(const Expr& e) { return as_binary(e, BinaryOp::multiply, BinaryOp::divide); }

/// A product or quotient as uniform * above[0] * above[1] ... / below.
struct Chain {
  Expr uniform = 1.0;
  std::vector<Expr> above;
  Expr below = 1.0;

  void add(const Expr& e, bool inverse) {
    if (const Binary* b = as_product(e)) {
      add(b->left, inverse);
      add(b->right, inverse != (b->op == BinaryOp::divide));
    } else if (const Neg* n = as<Neg>(e)) {
      uniform = -uniform;
      add(n->operand, inverse);
    } else if (is_uniform(e)) {
      uniform = inverse ? uniform / e : uniform * e;
    } else if (inverse) {
      below = below * e;
    } else {
      above.push_back(e);
    }
  }
  Expr build() const {
    Expr result = uniform;
    for (const Expr& factor : above) result = result * factor;
    return result / below;
  }
};

Chain chain_of(const Expr& e) {
  Chain chain;
  chain.add(e, false);
  return chain;
}

bool is_one(const Expr& uniform) { return is_literal(uniform, 1) || is_literal(uniform, -1); }

/// True if a uniform factor of `e` costs nothing, because every term of `e` has one already.
bool absorbs(const Expr& e) {
  if (is_uniform(e)) return true;
  if (const Binary* sum = as_sum(e)) return absorbs(sum->left) && absorbs(sum->right);
  if (const Neg* n = as<Neg>(e)) return absorbs(n->operand);
  if (!as_product(e)) return false;
  const Chain chain = chain_of(e);
  if (!is_one(chain.uniform)) return true;
  for (const Expr& factor : chain.above) {
    if (as_sum(factor) && absorbs(factor)) return true;
  }
  return false;
}

Expr each_scaled(const Expr& e, const Expr& uniform);

/// The chain with its uniform factor moved into a sum that absorbs it, if there is one.
Expr pushed_down(Chain chain) {
  if (is_one(chain.uniform)) return chain.build();
  for (Expr& factor : chain.above) {
    if (!as_sum(factor) || !absorbs(factor)) continue;
    factor = each_scaled(factor, chain.uniform);
    chain.uniform = 1.0;
    break;
  }
  return chain.build();
}

Expr each_scaled(const Expr& e, const Expr& uniform) {
  if (const Binary* sum = as_sum(e))
    return binary(sum->op, each_scaled(sum->left, uniform), each_scaled(sum->right, uniform));
  if (const Neg* n = as<Neg>(e)) return -each_scaled(n->operand, uniform);
  Chain chain = chain_of(e);
  chain.uniform = uniform * chain.uniform;
  return pushed_down(std::move(chain));
}

Expr distribute(const Expr& e) {
  if (is_uniform(e) || is_decision(e)) return e;
  const Expr inner = map_children(e, distribute);
  if (!as_product(inner)) return inner;
  const Chain chain = chain_of(inner);
  for (const Expr& factor : chain.above) {
    if (!is_one(chain.uniform) && as_sum(factor) && absorbs(factor)) return pushed_down(chain);
  }
  return inner;
}

/// Number of uses of each let by stores, directly or through other used lets.
std::unordered_map<std::string, int> count_uses(const Kernel& kernel) {
  std::unordered_map<std::string, int> uses;
  const auto note = [&](const Expr& e) {
    if (const Local* local = as<Local>(e)) ++uses[local->name];
  };
  for (const Store& store : kernel.stores) visit(store.value, note);
  for (const Sum& sum : kernel.sums) visit(sum.value, note);
  for (const Scatter& scatter : kernel.scatters) {
    visit(interp(scatter.target), note);
    visit(scatter.value, note);
  }
  for (auto let = kernel.lets.rbegin(); let != kernel.lets.rend(); ++let) {
    if (uses.contains(let->name)) visit(let->value, note);
  }
  return uses;
}

}  // namespace

Kernel with_lets_inlined(const Kernel& kernel) {
  const std::unordered_map<std::string, int> uses = count_uses(kernel);
  std::unordered_map<std::string, Expr> inlined;
  const std::function<Expr(const Expr&)> inline_in = [&](const Expr& e) {
    const Local* local = as<Local>(e);
    const auto value = local ? inlined.find(local->name) : inlined.end();
    return value != inlined.end() ? value->second : map_children(e, inline_in);
  };
  std::vector<Let> kept;
  for (const Let& let : kernel.lets) {
    const auto count = uses.find(let.name);
    if (count == uses.end()) continue;
    const Expr value = inline_in(let.value);
    if (count->second == 1) {
      inlined.emplace(let.name, value);
    } else {
      kept.push_back({let.name, value});
    }
  }
  Kernel result = map_expressions(kernel, inline_in);
  result.lets = std::move(kept);
  return result;
}

Module inline_lets(const Module& module) {
  Module result = module;
  for (Kernel& kernel : result.kernels) kernel = with_lets_inlined(kernel);
  return result;
}

Module distribute_uniforms(const Module& module) {
  Module result = module;
  for (Kernel& kernel : result.kernels) {
    const std::set<std::string> decisive = decisive_lets(kernel);
    const std::vector<Let> lets = kernel.lets;
    kernel = map_expressions(kernel, distribute);
    for (std::size_t i = 0; i < lets.size(); ++i) {
      if (decisive.contains(lets[i].name)) kernel.lets[i] = lets[i];
    }
  }
  return result;
}

}  // namespace dpde::stencil
