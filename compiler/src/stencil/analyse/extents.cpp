// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/extents.h"

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

/// Conditions under which an expression is evaluated: all of these are true.
using Insides = std::vector<Inside>;

void add_insides(const Expr& condition, Insides& insides) {
  const Binary* both = std::get_if<Binary>(&condition->kind);
  if (const Inside* inside = std::get_if<Inside>(&condition->kind)) insides.push_back(*inside);
  if (!both || both->op != BinaryOp::logical_and) return;
  add_insides(both->left, insides);
  add_insides(both->right, insides);
}

}  // namespace

std::map<std::string, int> extents_of(const Kernel& kernel, int grow, const std::vector<Topology>& axes) {
  std::map<std::string, int> extents;
  const auto note = [&](const std::string& field, int cells) {
    int& extent = extents[field];
    extent = std::max(extent, cells);
  };
  const std::function<void(const Expr&, const Insides&)> look = [&](const Expr& e, const Insides& insides) {
    if (const Select* select = std::get_if<Select>(&e->kind)) {
      Insides inner = insides;
      add_insides(select->condition, inner);
      look(select->condition, insides);
      look(select->yes, inner);
      return look(select->no, insides);
    }
    const Access* a = std::get_if<Access>(&e->kind);
    const Interp* i = std::get_if<Interp>(&e->kind);
    if (i) note(i->field, reach_of(*i, axes));
    for (size_t axis = 0; a && axis < axes.size(); ++axis) {
      if (axes[axis] == Topology::periodic) continue;
      int most = grow + std::abs(a->offset[axis]);
      for (const Inside& inside : insides) {
        most = std::min(most, inside.grow + std::abs(a->offset[axis] - inside.offset[axis]));
      }
      note(a->field, most);
    }
    for_each_child(e, [&](const Expr& child) { look(child, insides); });
  };
  map_kernel(kernel, [&](const Expr& value) { return look(value, {}), value; });
  return extents;
}

std::set<std::string> read_around(const Kernel& kernel, const std::vector<Topology>& axes) {
  std::set<std::string> fields;
  map_kernel(kernel, [&](const Expr& value) {
    visit(value, [&](const Expr& e) {
      const Access* a = std::get_if<Access>(&e->kind);
      for (std::size_t axis = 0; a && axis < axes.size(); ++axis) {
        if (axes[axis] == Topology::periodic && a->offset[axis] != 0) fields.insert(a->field);
      }
    });
    return value;
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
