// SPDX-License-Identifier: Apache-2.0
// Value numbering: equal expressions get equal numbers, and a local has the number of what it stands for. What more
// than one place refers to, and costs something, gets a let before its first use. Expressions of params and numbers
// only are left alone: they are computed once for all points anyway.
#include <fmt/format.h>

#include <map>
#include <set>

#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "support/match.h"
#include "support/name_supply.h"

namespace dpde::stencil {

namespace {

constexpr int least_cost = 2;  // operations a let must save

/// One distinct value of a kernel.
struct Value {
  std::vector<int> children;
  int cost = 0;         // operations at each point
  bool uniform = true;  // the same at all points
  int references = 0;   // by distinct values and by statements
};

class Numbering {
 public:
  /// The number of `e`; equal expressions, equal numbers.
  int number(const Expr& e) {
    const auto known = by_node_.find(&e.node());
    if (known != by_node_.end()) return known->second;
    kept_.push_back(e);
    const int n = find_number(e);
    by_node_.emplace(&e.node(), n);
    return n;
  }

  void define_local(const std::string& name, int number) { locals_[name] = number; }
  void refer(int number) { ++values_[number].references; }
  const Value& operator[](int number) const { return values_[number]; }

 private:
  int find_number(const Expr& e) {
    if (const Local* l = std::get_if<Local>(&e->kind)) {
      const auto found = locals_.find(l->name);
      if (found != locals_.end()) return found->second;
    }
    Value value;
    std::string key = describe(e, value);
    for_each_child(e, [&](const Expr& child) { value.children.push_back(number(child)); });
    for (const int child : value.children) {
      key += fmt::format(" {}", child);
      value.cost += values_[child].cost;
      value.uniform = value.uniform && values_[child].uniform;
    }
    if (value.uniform) value.cost = 0;
    const auto [found, is_new] = numbers_.emplace(key, static_cast<int>(values_.size()));
    if (is_new) {
      for (const int child : value.children) refer(child);
      values_.push_back(value);
    }
    return found->second;
  }

  /// The node without its children, as text; sets its own cost and whether it varies by itself.
  static std::string describe(const Expr& e, Value& value) {
    const auto costs = [&](int cost) { value.cost = cost; };
    const auto varies = [&] { value.uniform = false; };
    return match(
        e->kind, [](const Literal& l) { return fmt::format("literal {}", l.value); },
        [](const Param& p) { return fmt::format("param {}", p.name); },
        [&](const Local& l) { return varies(), fmt::format("local {}", l.name); },
        [&](const Access& a) {
          return varies(), fmt::format("access {} {} {} {}", a.field, a.offset[0], a.offset[1], a.offset[2]);
        },
        [&](const Interp& i) {
          varies();
          costs(8);
          return fmt::format("{} {} {} {} {}", interp_name(i.along), i.field, i.offset[0], i.offset[1], i.offset[2]);
        },
        [&](const Inside& i) {
          varies();
          costs(1);
          return fmt::format("inside {} {} {} {}", i.offset[0], i.offset[1], i.offset[2], i.grow);
        },
        [](const Neg&) { return std::string("neg"); },
        [&](const Binary& b) {
          return costs(b.op == BinaryOp::power ? 4 : 1), fmt::format("binary {}", spelling(b.op));
        },
        [&](const Call& c) { return costs(4), fmt::format("call {}", name_of(c.fn)); },
        [&](const Select&) { return costs(1), std::string("select"); });
  }

  std::map<std::string, int> numbers_;
  std::vector<Value> values_;
  std::map<const Node*, int> by_node_;
  std::vector<Expr> kept_;  // keeps the nodes of by_node_ alive
  std::map<std::string, int> locals_;
};

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
      if (defined_.contains(n)) continue;  // an earlier let has this value
      const Expr value = rewrite_below(let.value);
      lets_.push_back({let.name, value});
      if (is_worth_a_name(n)) defined_.emplace(n, let.name);
    }
    result = map_kernel(result, [&](const Expr& e) { return rewrite(e); });
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
    map_kernel(rest, [&](const Expr& e) {
      numbering_.refer(numbering_.number(e));
      return e;
    });
  }

  bool is_worth_a_name(int n) const { return !numbering_[n].uniform && !numbering_[n].children.empty(); }

  Expr rewrite(const Expr& e) {
    if (std::holds_alternative<Local>(e->kind) && !defined_.contains(numbering_.number(e))) return e;
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
