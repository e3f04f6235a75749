// SPDX-License-Identifier: Apache-2.0
// The kernels of a step with integer ids instead of names: a step is evaluated at many points with many lengths, and
// its names are looked up once.
#pragma once

#include <array>
#include <map>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include "stencil/analyse/symbol.h"
#include "stencil/stencil.h"

namespace dpde::stability {

class FrozenKernels {
 public:
  using Id = int;  // of a node, a field, a parameter, a local
  using Literal = dpde::Literal;
  struct Param {
    Id param;
  };
  struct Local {
    Id local;
  };
  struct Access {
    Id field;
    stencil::Offset offset;
  };
  struct Interp {
    Id field;
    stencil::Offset offset;
    std::vector<Id> displacement;
    std::array<InterpolationBasis, stencil::max_rank> along;
  };
  struct Inside {};
  using Neg = NegOf<Id>;
  using Binary = BinaryOf<Id>;
  using Call = CallOf<Id>;
  using Select = SelectOf<Id>;
  using Kind = std::variant<Literal, Param, Local, Access, Interp, Inside, Neg, Binary, Call, Select>;
  struct Node {
    Kind kind;
    bool is_number = false;  // it depends on no perturbation
  };
  struct Store {
    Id field;
    bool accumulate;
    Id value;
    bool is_perturbation;  // its unperturbed value is 0
  };
  struct Kernel {
    int rank = 1;
    std::vector<Id> lets;  // let i defines local i
    std::vector<Store> stores;
    bool makes_states = false;  // it only computes fields that depend on states
  };
  struct Field {
    std::string name;
    int axis = -1;                   // of a coordinate
    std::array<bool, 3> waves = {};  // axes along which transforms of it have wave numbers
  };

  /// From the first program of the module. `varied`: fields that depend on the states; `rates`: their perturbations.
  FrozenKernels(const stencil::Module& module, const std::set<std::string>& varied, const std::set<std::string>& rates);

  const Node& node(Id id) const { return nodes_[static_cast<std::size_t>(id)]; }
  const std::vector<Field>& fields() const { return fields_; }
  const std::vector<std::string>& params() const { return params_; }
  const Kernel& kernel(const std::string& name) const { return kernels_.at(name); }
  Id field(const std::string& name) const { return field_ids_.at(name); }
  /// Whether the program's results for perturbations are rational functions of dt by their formulas: only kernels
  /// compute them, and no condition or function depends on dt, directly or through a field. Assumes that all stages of
  /// states are known.
  bool is_rational_in_step() const { return is_rational_in_step_; }
  /// The polynomial of a transform's argument or factor.
  const std::vector<stencil::Monomial>& polynomial(const stencil::Expr& symbol) const {
    return symbols_.at(&symbol.node()).polynomial;
  }
  /// The id of a parameter; -1 if it is not read.
  Id param(const std::string& name) const;

 private:
  class Reader;
  class StepDependence;
  Id add_field(const std::string& name);
  Id add_param(const std::string& name);
  struct Symbol {
    stencil::Expr symbol;  // keeps the node alive
    std::vector<stencil::Monomial> polynomial;
  };
  void add_symbols_of(const stencil::Transform& transform);
  void add_waves_of(const stencil::Transform::Term& term, Id result);
  std::ptrdiff_t count_waves() const;
  void add_fields_of(const std::vector<stencil::Statement>& body);

  std::vector<Node> nodes_;
  std::vector<Field> fields_;
  std::vector<std::string> params_;
  std::map<std::string, Id> field_ids_, param_ids_;
  std::map<std::string, Kernel> kernels_;
  std::map<const stencil::Node*, Symbol> symbols_;
  bool is_rational_in_step_ = false;
};

}  // namespace dpde::stability
