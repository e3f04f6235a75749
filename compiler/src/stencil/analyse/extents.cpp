// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/extents.h"

#include <algorithm>
#include <cstdlib>
#include <ranges>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

/// Conditions under which an expression is evaluated: all of these are true.
using Insides = std::vector<Inside>;

void add_insides(const Expr& condition, Insides& insides) {
  const Binary* both = as<Binary>(condition);
  const Inside* inside = as<Inside>(condition);
  if (inside && std::ranges::find(insides, *inside) == insides.end()) insides.push_back(*inside);
  if (!both || both->op != BinaryOp::logical_and) return;
  add_insides(both->left, insides);
  add_insides(both->right, insides);
}

class Extents {
 public:
  Extents(int grow, const std::vector<Topology>& axes) : grow_(grow), axes_(axes) {}

  /// A let counts where its value is used: its value anywhere else may be of cells that are never set.
  std::map<std::string, int> of(const Kernel& kernel) {
    Kernel stores = kernel;
    stores.lets.clear();
    for_each_expression(stores, [&](const Expr& value) { look(value, {}); });
    for (const Let& let : kernel.lets | std::views::reverse) {
      for (const Insides& insides : uses_[let.name]) look(let.value, insides);
    }
    return std::move(extents_);
  }

 private:
  void look(const Expr& e, const Insides& insides) {
    if (const Select* select = as<Select>(e)) {
      Insides inner = insides;
      add_insides(select->condition, inner);
      look(select->condition, insides);
      look(select->yes, inner);
      return look(select->no, insides);
    }
    if (const Local* let = as<Local>(e)) return note_use(let->name, insides);
    const Access* a = as<Access>(e);
    const Interp* i = as<Interp>(e);
    if (i) note(i->field, reach_of(*i, axes_));
    for (size_t axis = 0; a && axis < axes_.size(); ++axis) {
      if (axes_[axis] == Topology::periodic) continue;
      int most = grow_ + std::abs(a->offset[axis]);
      for (const Inside& inside : insides) {
        most = std::min(most, inside.grow + std::abs(a->offset[axis] - inside.offset[axis]));
      }
      note(a->field, most);
    }
    for_each_child(e, [&](const Expr& child) { look(child, insides); });
  }

  void note(const std::string& field, int cells) {
    int& extent = extents_[field];
    extent = std::max(extent, cells);
  }

  /// A use without conditions stands for all others, and so for those of more than a few conditions.
  void note_use(const std::string& let, const Insides& insides) {
    constexpr std::size_t most = 16;
    std::vector<Insides>& uses = uses_[let];
    const auto is_anywhere = [](const Insides& use) { return use.empty(); };
    if (std::ranges::any_of(uses, is_anywhere) || std::ranges::find(uses, insides) != uses.end()) return;
    if (insides.empty() || uses.size() == most) {
      uses = {Insides{}};
    } else {
      uses.push_back(insides);
    }
  }

  const int grow_;
  const std::vector<Topology>& axes_;
  std::map<std::string, int> extents_;
  std::map<std::string, std::vector<Insides>> uses_;  // of lets: the conditions of each use
};

}  // namespace

std::map<std::string, int> extents_of(const Kernel& kernel, int grow, const std::vector<Topology>& axes) {
  return Extents(grow, axes).of(kernel);
}

std::set<std::string> read_around(const Kernel& kernel, const std::vector<Topology>& axes) {
  std::set<std::string> fields;
  visit(kernel, [&](const Expr& e) {
    const Access* a = as<Access>(e);
    for (std::size_t axis = 0; a && axis < axes.size(); ++axis) {
      if (axes[axis] == Topology::periodic && a->offset[axis] != 0) fields.insert(a->field);
    }
  });
  return fields;
}

std::set<std::string> read_beyond(const Kernel& kernel, int grow, const std::vector<Topology>& axes) {
  std::set<std::string> fields = read_around(kernel, axes);
  for (const auto& [field, extent] : extents_of(kernel, grow, axes)) {
    if (extent > 0) fields.insert(field);
  }
  for (const Signature::Read& read : signature(kernel).reads) {
    if (read.interpolated) fields.insert(read.field);
  }
  return fields;
}

}  // namespace dpde::stencil
