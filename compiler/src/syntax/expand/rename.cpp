// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/rename.h"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>

#include "support/match.h"
#include "support/names/derivative_names.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {

Expr rename(const Expr& e, const Rename& field) {
  const auto same_place = [&](Kind kind) { return Expr(Node{std::move(kind), e.range()}); };
  return match(
      e->kind, [&](const OneOf<Number, Text, Error> auto&) { return e; },
      [&](const Name& n) { return same_place(Name{field(n.name)}); },
      [&](const Offsets& o) {
        return same_place(Offsets{field(o.name), o.offsets, o.grow});
      },
      [&](const Component& c) {
        return same_place(Component{rename(c.operand, field), c.name});
      },
      [&](const Unary& u) {
        return same_place(Unary{u.op, rename(u.operand, field)});
      },
      [&](const Binary& b) {
        return same_place(Binary{b.op, rename(b.left, field), rename(b.right, field)});
      },
      [&](Call c) {
        for (Argument& argument : c.arguments) argument.value = rename(argument.value, field);
        return same_place(std::move(c));
      },
      [&](Tuple t) {
        for (Expr& element : t.elements) element = rename(element, field);
        return same_place(std::move(t));
      });
}

namespace {

void add_parameter(std::vector<KernelParameter>& parameters, const KernelParameter& parameter) {
  const auto same = std::find_if(parameters.begin(), parameters.end(), [&](const KernelParameter& known) {
    return known.name.name == parameter.name.name && known.role == KernelRole::in && parameter.role == KernelRole::in;
  });
  if (same == parameters.end()) {
    parameters.push_back(parameter);
  } else if (same->halo && parameter.halo) {
    same->halo = std::max(*same->halo, *parameter.halo);
  } else {
    same->halo.reset();  // use as many as needed
  }
}

/// Renaming in adjoint formulas: u_bar is renamed like u.
Rename with_adjoints(const Kernel& kernel, const Rename& field) {
  std::set<std::string> parameters;
  for (const KernelParameter& parameter : kernel.parameters) parameters.insert(parameter.name.name);
  return [parameters, field](const std::string& name) {
    constexpr std::string_view bar = "_bar";
    const std::string of = name.ends_with(bar) ? name.substr(0, name.size() - bar.size()) : "";
    return !parameters.contains(name) && parameters.contains(of) ? field(of) + std::string(bar) : field(name);
  };
}

/// If several inputs become one field, its adjoint is the sum of their adjoints. If one of these is derived
/// automatically, all are.
void add_up_adjoints(std::vector<Item>& items, const std::map<std::string, int>& inputs) {
  std::map<std::string, std::vector<AdjointItem>> given;
  for (const Item& item : items) {
    if (const AdjointItem* adjoint = get_if<AdjointItem>(&item.kind)) given[adjoint->target.name].push_back(*adjoint);
  }
  std::erase_if(items, [&](Item& item) {
    AdjointItem* adjoint = get_if<AdjointItem>(&item.kind);
    const auto merged = adjoint == nullptr ? inputs.end() : inputs.find(adjoint->target.name);
    if (merged == inputs.end() || merged->second == 1) return false;
    std::vector<AdjointItem>& all = given.at(adjoint->target.name);
    if (static_cast<int>(all.size()) < merged->second) return true;
    for (std::size_t i = 1; i < all.size(); ++i) {
      adjoint->value = Expr(Node{Binary{BinaryOp::add, adjoint->value, all[i].value}, adjoint->value.range()});
    }
    all.clear();  // the first one has the whole sum
    return false;
  });
}

}  // namespace

Kernel rename(Kernel kernel, const Rename& field) {
  const Rename of_adjoint = with_adjoints(kernel, field);
  std::map<std::string, int> inputs;  // x_bar: number of the kernel's inputs that became x
  std::vector<KernelParameter> parameters;
  for (KernelParameter parameter : kernel.parameters) {
    parameter.name.name = field(parameter.name.name);
    if (parameter.role == KernelRole::in) ++inputs[bar_of(parameter.name.name)];
    add_parameter(parameters, parameter);
  }
  kernel.parameters = std::move(parameters);
  for (Item& item : kernel.items) {
    match(
        item.kind, [&](LetItem& let) { let.value = rename(let.value, field); },
        [&](AssignItem& assign) {
          assign.target.name = field(assign.target.name);
          assign.value = rename(assign.value, field);
        },
        [&](AdjointItem& adjoint) {
          adjoint.target.name = of_adjoint(adjoint.target.name);
          adjoint.value = rename(adjoint.value, of_adjoint);
        },
        [&](ScatterItem& scatter) {
          scatter.target = rename(scatter.target, field);
          scatter.value = rename(scatter.value, field);
        },
        [](const OutsideKernels auto&) {});
  }
  add_up_adjoints(kernel.items, inputs);
  return kernel;
}

}  // namespace dpde::ast
