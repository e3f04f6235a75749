// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/numbering.h"

#include <algorithm>
#include <bit>

#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

constexpr int most_cost = 1 << 29;  // limits costs, which double with each nested square

}  // namespace

/// Fowler-Noll-Vo hash by words, with the high bits mixed in.
std::size_t Numbering::Hash::operator()(const Key& key) const {
  std::uint64_t hash = 14695981039346656037u;
  for (const std::int64_t word : key) {
    hash = (hash ^ static_cast<std::uint64_t>(word)) * 1099511628211u;
    hash ^= hash >> 32;
  }
  return hash;
}

std::int64_t Numbering::number_of_name(const std::string& name) {
  return names_.emplace(name, static_cast<std::int64_t>(names_.size())).first->second;
}

/// The key of the node without its children; sets its own cost and whether it varies by itself.
Numbering::Key Numbering::describe(const Expr& e, Value& value) {
  const auto costs = [&](int cost) { value.cost = cost; };
  const auto varies = [&] { value.uniform = false; };
  Key key{static_cast<std::int64_t>(e->kind.index())};
  const auto say = [&](auto... words) { (key.push_back(static_cast<std::int64_t>(words)), ...); };
  const auto say_offset = [&](const Offset& offset) { say(offset[0], offset[1], offset[2]); };
  match(
      e->kind, [&](const Literal& l) { say(std::bit_cast<std::int64_t>(l.value)); },
      [&](const Param& p) { say(number_of_name(p.name)); },
      [&](const Local& l) {
        varies();
        say(number_of_name(l.name));
      },
      [&](const Access& a) {
        varies();
        say(number_of_name(a.field));
        say_offset(a.offset);
      },
      [&](const Interp& i) {
        varies();
        costs(8);
        say(number_of_name(i.field), i.along[0], i.along[1], i.along[2]);
        say_offset(i.offset);
      },
      [&](const Inside& i) {
        varies();
        costs(1);
        say(i.grow);
        say_offset(i.offset);
      },
      ignored<Neg>,
      [&](const Binary& b) {
        costs(b.op == BinaryOp::power ? 4 : 1);
        say(b.op);
      },
      [&](const Call& c) {
        costs(4);
        say(c.fn);
      },
      [&](const Select&) { costs(1); });
  return key;
}

int Numbering::find_number(const Expr& e) {
  if (const Local* l = as<Local>(e)) {
    const auto found = locals_.find(l->name);
    if (found != locals_.end()) return found->second;
  }
  Value value;
  Key key = describe(e, value);
  for_each_child(e, [&](const Expr& child) { value.children.push_back(number(child)); });
  for (const int child : value.children) {
    key.push_back(child);
    value.cost = std::min(value.cost + values_[child].cost, most_cost);
    value.uniform = value.uniform && values_[child].uniform;
  }
  if (value.uniform) value.cost = 0;
  const auto [found, is_new] = numbers_.emplace(std::move(key), static_cast<int>(values_.size()));
  if (is_new) {
    for (const int child : value.children) refer(child);
    values_.push_back(std::move(value));
  }
  return found->second;
}

}  // namespace dpde::stencil
