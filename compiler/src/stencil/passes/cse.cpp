// SPDX-License-Identifier: Apache-2.0
// An expression that occurs more than once and has a cost gets a let before its first use. Expressions of params and
// numbers are excluded: they are computed once for all points anyway.
#include <fmt/format.h>

#include <map>

#include "stencil/build.h"
#include "stencil/passes/numbering.h"
#include "stencil/passes/passes.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

namespace {

constexpr int least_cost = 2;  // operations a let must save

class Rewriter {
 public:
  explicit Rewriter(const Kernel& kernel) : kernel_(kernel) {
    const Signature s = signature(kernel);
    for (const Signature::Read& read : s.reads) names_.reserve(read.field);
    for (const auto* list : {&s.writes, &s.updates, &s.params, &s.sums}) {
      for (const std::string& name : *list) names_.reserve(name);
    }
    for (const Let& let : kernel.lets) names_.reserve(let.name);
    number_all();
  }

  Kernel run() {
    Kernel result = kernel_;
    result.lets.clear();
    for (const Let& let : kernel_.lets) {
      const int n = numbering_.number(let.value);
      if (defined_.contains(n)) continue;  // an earlier let has the same value
      const Expr value = rewrite_below(let.value);
      lets_.push_back({let.name, value});
      if (is_worth_a_name(n)) defined_.emplace(n, let.name);
    }
    result = map_expressions(result, [&](const Expr& e) { return rewrite(e); });
    result.lets = lets_;
    return result;
  }

 private:
  void number_all() {
    for (const Let& let : kernel_.lets) {
      const int n = numbering_.number(let.value);
      if (is_worth_a_name(n)) {
        numbering_.define_local(let.name, n);
        let_names_.emplace(n, let.name);
      }
      numbering_.refer(n);
    }
    Kernel rest = kernel_;
    rest.lets.clear();
    for_each_expression(rest, [&](const Expr& e) { numbering_.refer(numbering_.number(e)); });
  }

  bool is_worth_a_name(int n) const { return !numbering_[n].uniform && !numbering_[n].children.empty(); }

  Expr rewrite(const Expr& e) {
    if (is<Local>(e) && !defined_.contains(numbering_.number(e))) return e;
    const int n = numbering_.number(e);
    const auto found = defined_.find(n);
    if (found != defined_.end()) return local(found->second);
    const Expr value = rewrite_below(e);
    if (!is_worth_a_name(n) || numbering_[n].references < 2) return value;
    const auto let_name = let_names_.find(n);
    if (let_name == let_names_.end() && numbering_[n].cost < least_cost) return value;
    const std::string name = let_name == let_names_.end() ? fresh_name() : let_name->second;
    lets_.push_back({name, value});
    defined_.emplace(n, name);
    return local(name);
  }

  Expr rewrite_below(const Expr& e) {
    return map_children(e, [&](const Expr& child) { return rewrite(child); });
  }

  std::string fresh_name() {
    std::string name;
    do {
      name = fmt::format("t{}", ++last_);
    } while (names_.is_used(name));
    return names_.fresh(name);
  }

  const Kernel& kernel_;
  NameSupply names_;
  Numbering numbering_;
  std::map<int, std::string> let_names_;  // the first let of a value
  std::map<int, std::string> defined_;
  std::vector<Let> lets_;
  int last_ = 0;
};

}  // namespace

Module eliminate_common_subexpressions(const Module& module) {
  Module result = module;
  for (Kernel& kernel : result.kernels) kernel = Rewriter(kernel).run();
  return result;
}

}  // namespace dpde::stencil
