// SPDX-License-Identifier: Apache-2.0
// Value numbering: equal expressions get equal numbers, and a local has the number of its value.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// One distinct value of a kernel.
struct Value {
  std::vector<int> children;
  int cost = 0;         // operations at each point
  bool uniform = true;  // in space
  int references = 0;   // by distinct values and by statements
};

class Numbering {
 public:
  /// The number of `e`; equal expressions have equal numbers.
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
  /// A node encoded as numbers: its kind, its contents (names by their numbers), and the numbers of its children.
  using Key = std::vector<std::int64_t>;
  struct Hash {
    std::size_t operator()(const Key& key) const;
  };
  int find_number(const Expr& e);
  Key describe(const Expr& e, Value& value);
  std::int64_t number_of_name(const std::string& name);

  std::unordered_map<Key, int, Hash> numbers_;
  std::unordered_map<std::string, std::int64_t> names_;
  std::vector<Value> values_;
  std::unordered_map<const Node*, int> by_node_;
  std::vector<Expr> kept_;  // keeps the nodes of by_node_ alive
  std::map<std::string, int> locals_;
};

}  // namespace dpde::stencil
