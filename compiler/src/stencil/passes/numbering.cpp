// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/numbering.h"

#include <fmt/format.h>

#include <algorithm>

#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

constexpr int most_cost = 1 << 29;  // squares of squares cost twice as much each time

/// The node without its children, as text; sets its own cost and whether it varies by itself.
std::string describe(const Expr& e, Value& value) {
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
      [&](const Binary& b) { return costs(b.op == BinaryOp::power ? 4 : 1), fmt::format("binary {}", spelling(b.op)); },
      [&](const Call& c) { return costs(4), fmt::format("call {}", name_of(c.fn)); },
      [&](const Select&) { return costs(1), std::string("select"); });
}

}  // namespace

int Numbering::find_number(const Expr& e) {
  if (const Local* l = std::get_if<Local>(&e->kind)) {
    const auto found = locals_.find(l->name);
    if (found != locals_.end()) return found->second;
  }
  Value value;
  std::string key = describe(e, value);
  for_each_child(e, [&](const Expr& child) { value.children.push_back(number(child)); });
  for (const int child : value.children) {
    key += fmt::format(" {}", child);
    value.cost = std::min(value.cost + values_[child].cost, most_cost);
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

}  // namespace dpde::stencil
