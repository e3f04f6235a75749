// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/frozen_kernels.h"

#include <algorithm>
#include <unordered_map>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stability {

namespace {

/// Fields without a perturbation: those that depend on states, and those that no statement computes. While the operator
/// of a solve is determined, its unknowns and all results of its block are perturbed.
class Unperturbed {
 public:
  Unperturbed(const stencil::Module& module, const std::set<std::string>& varied, const std::set<std::string>& rates)
      : module_(module), varied_(varied), perturbed_(rates) {
    look_at(module.programs.front().body, false);
  }
  bool has(const std::string& field) const {
    return !perturbed_.contains(field) && (varied_.contains(field) || !made_.contains(field));
  }

 private:
  void look_at(const std::vector<stencil::Statement>& body, bool is_in_solve) {
    std::set<std::string>& made = is_in_solve ? perturbed_ : made_;
    for (const stencil::Statement& statement : body) {
      match(
          statement, ignored<stencil::Fill, stencil::Fold, stencil::NetworkCall>,
          [&](const OneOf<stencil::Reduce, stencil::Transform> auto& one) { made.insert(one.result); },
          [&](const stencil::Run& run) {
            for (const stencil::Store& store : stencil::kernel_of(module_, run).stores) made.insert(store.field);
          },
          [&](const stencil::Solve& solve) {
            perturbed_.insert(solve.unknowns.begin(), solve.unknowns.end());
            perturbed_.insert(solve.images.begin(), solve.images.end());
            look_at(solve.body, true);
          },
          [&](const stencil::Repeat& repeat) {
            for (const stencil::LoopCarried& carry : repeat.carries) {
              made.insert({carry.state, carry.next, carry.result});
            }
            look_at(repeat.body, is_in_solve);
          });
    }
  }

  const stencil::Module& module_;
  const std::set<std::string>& varied_;
  std::set<std::string> perturbed_, made_;
};

}  // namespace

FrozenKernels::Id FrozenKernels::add_field(const std::string& name) {
  const auto [entry, is_new] = field_ids_.try_emplace(name, static_cast<Id>(fields_.size()));
  if (is_new) fields_.push_back({name, stencil::is_coordinate(name) ? name[0] - 'x' : -1});
  return entry->second;
}

/// Its own, and those of what it gives.
void FrozenKernels::add_waves_of(const stencil::Transform::Term& term, Id result) {
  const Id id = add_field(term.field);
  const std::array<bool, 3> by_result = fields_[static_cast<std::size_t>(result)].waves,
                            by_factor = stencil::axes_of(term.by.factor),
                            by_argument = term.by.function ? stencil::axes_of(term.by.argument) : std::array<bool, 3>{};
  std::array<bool, 3>& waves = fields_[static_cast<std::size_t>(id)].waves;
  for (std::size_t axis = 0; axis < waves.size(); ++axis)
    waves[axis] = waves[axis] || by_result[axis] || by_factor[axis] || by_argument[axis];
}

/// Stores the polynomials once, as responses need them at each point and for each step length.
void FrozenKernels::add_symbols_of(const stencil::Transform& transform) {
  stencil::for_each_symbol(transform, [&](const stencil::Expr& symbol) {
    if (symbols_.contains(&symbol.node())) return;
    symbols_.emplace(&symbol.node(),
                     Symbol{symbol, stencil::polynomial_of(symbol).value_or(std::vector<stencil::Monomial>{})});
  });
}

std::ptrdiff_t FrozenKernels::count_waves() const {
  std::ptrdiff_t count = 0;
  for (const Field& field : fields_) count += std::ranges::count(field.waves, true);
  return count;
}

FrozenKernels::Id FrozenKernels::add_param(const std::string& name) {
  const auto [entry, is_new] = param_ids_.try_emplace(name, static_cast<Id>(params_.size()));
  if (is_new) params_.push_back(name);
  return entry->second;
}

FrozenKernels::Id FrozenKernels::param(const std::string& name) const {
  const auto found = param_ids_.find(name);
  return found == param_ids_.end() ? -1 : found->second;
}

/// Reads the expressions of one kernel. A shared subexpression becomes one node.
class FrozenKernels::Reader {
 public:
  Reader(FrozenKernels& kernels, const Unperturbed& unperturbed) : kernels_(kernels), unperturbed_(unperturbed) {}

  Kernel read(const stencil::Kernel& kernel, const std::set<std::string>& varied, const std::set<std::string>& rates) {
    Kernel result{kernel.rank, {}, {}, true};
    for (const stencil::Let& let : kernel.lets) {
      result.lets.push_back(id_of(let.value));
      locals_[let.name] = static_cast<Id>(result.lets.size() - 1);
      is_number_.push_back(is_number(result.lets.back()));
    }
    for (const stencil::Store& store : kernel.stores) {
      const Id field = kernels_.add_field(store.field), value = id_of(store.value);
      result.stores.push_back({field, store.accumulate, value, rates.contains(store.field)});
      result.makes_states = result.makes_states && varied.contains(store.field);
    }
    return result;
  }

 private:
  bool is_number(Id id) const { return kernels_.node(id).is_number; }
  bool are_numbers(const std::vector<Id>& ids) const {
    return std::ranges::all_of(ids, [&](Id id) { return is_number(id); });
  }

  Id id_of(const stencil::Expr& e) {
    const auto known = ids_.find(&e.node());
    if (known != ids_.end()) return known->second;
    Node node = node_of(e);
    kernels_.nodes_.push_back(std::move(node));
    return ids_[&e.node()] = static_cast<Id>(kernels_.nodes_.size() - 1);
  }

  std::vector<Id> ids_of(const std::vector<stencil::Expr>& expressions) {
    std::vector<Id> ids;
    for (const stencil::Expr& e : expressions) ids.push_back(id_of(e));
    return ids;
  }

  Node node_of(const stencil::Expr& e) {
    return match(
        e->kind,
        [](const Literal& l) {
          return Node{Literal{l.value}, true};
        },
        [&](const stencil::Param& p) {
          return Node{Param{kernels_.add_param(p.name)}, true};
        },
        [&](const stencil::Local& l) {
          const Id local = locals_.at(l.name);
          return Node{Local{local}, is_number_[static_cast<std::size_t>(local)]};
        },
        [&](const stencil::Access& a) {
          const bool is_plain = stencil::is_coordinate(a.field) || unperturbed_.has(a.field);
          return Node{Access{kernels_.add_field(a.field), a.offset}, is_plain};
        },
        [&](const stencil::Interp& i) {
          return Node{Interp{kernels_.add_field(i.field), i.offset, ids_of(i.displacement), i.along}, false};
        },
        [](const stencil::Inside&) {
          return Node{Inside{}, true};
        },
        [&](const stencil::Neg& n) {
          const Id operand = id_of(n.operand);
          return Node{Neg{operand}, is_number(operand)};
        },
        [&](const stencil::Binary& b) {
          const Id left = id_of(b.left), right = id_of(b.right);
          return Node{Binary{b.op, left, right}, is_number(left) && is_number(right)};
        },
        [&](const stencil::Call& c) {
          std::vector<Id> arguments = ids_of(c.arguments);
          const bool is_plain = are_numbers(arguments);
          return Node{Call{c.fn, std::move(arguments)}, is_plain};
        },
        [&](const stencil::Select& s) {
          const Id condition = id_of(s.condition), yes = id_of(s.yes), no = id_of(s.no);
          return Node{Select{condition, yes, no}, is_number(condition) && is_number(yes) && is_number(no)};
        });
  }

  FrozenKernels& kernels_;
  const Unperturbed& unperturbed_;
  std::map<std::string, Id> locals_;
  std::vector<bool> is_number_;  // locals
  std::unordered_map<const stencil::Node*, Id> ids_;
};

/// Finds the fields that depend on dt, and whether all of them are rational in dt.
class FrozenKernels::StepDependence {
 public:
  explicit StepDependence(const FrozenKernels& kernels)
      : kernels_(kernels), dt_(kernels.param("dt")), fields_(kernels.fields().size()) {}

  bool is_rational() {
    for (bool has_changed = true; has_changed && is_rational_;) {
      has_changed = false;
      for (const auto& [name, kernel] : kernels_.kernels_) has_changed = look_at(kernel) || has_changed;
    }
    return is_rational_;
  }

 private:
  /// True if another field is found to depend on dt. Stages of states do not: they are computed with dt = 0.
  bool look_at(const Kernel& kernel) {
    if (kernel.makes_states) return false;
    locals_.clear();
    for (const Id let : kernel.lets) locals_.push_back(depends(let));
    bool has_changed = false;
    for (const Store& store : kernel.stores) {
      const auto field = static_cast<std::size_t>(store.field);
      if (!depends(store.value) || fields_[field]) continue;
      fields_[field] = has_changed = true;
    }
    return has_changed;
  }

  /// Records a dependence that is not rational if one of the nodes depends on dt.
  bool depends_otherwise(const std::vector<Id>& on) {
    if (std::ranges::any_of(on, [&](Id id) { return depends(id); })) is_rational_ = false;
    return false;
  }

  bool depends(Id id) {
    return match(
        kernels_.node(id).kind, [](const Literal&) { return false; }, [&](const Param& p) { return p.param == dt_; },
        [&](const Local& l) { return static_cast<bool>(locals_[static_cast<std::size_t>(l.local)]); },
        [&](const Access& a) { return static_cast<bool>(fields_[static_cast<std::size_t>(a.field)]); },
        [&](const Interp& i) {
          depends_otherwise(i.displacement);
          return static_cast<bool>(fields_[static_cast<std::size_t>(i.field)]);
        },
        [](const Inside&) { return false; }, [&](const Neg& n) { return depends(n.operand); },
        [&](const Binary& b) { return of_binary(b); }, [&](const Call& c) { return depends_otherwise(c.arguments); },
        [&](const Select& s) {
          depends_otherwise({s.condition});
          const bool by_yes = depends(s.yes);
          return depends(s.no) || by_yes;
        });
  }

  bool of_binary(const Binary& b) {
    switch (b.op) {
      case BinaryOp::add:
      case BinaryOp::subtract:
      case BinaryOp::multiply:
      case BinaryOp::divide: {
        const bool by_left = depends(b.left);
        return depends(b.right) || by_left;
      }
      case BinaryOp::power:
      case BinaryOp::less:
      case BinaryOp::less_equal:
      case BinaryOp::greater:
      case BinaryOp::greater_equal:
      case BinaryOp::equal:
      case BinaryOp::not_equal:
      case BinaryOp::logical_and:
      case BinaryOp::logical_or: return depends_otherwise({b.left, b.right});
    }
    unreachable("binary operator");
  }

  const FrozenKernels& kernels_;
  const Id dt_;
  std::vector<bool> fields_, locals_;
  bool is_rational_ = true;
};

namespace {

bool is_of_kernels_alone(const std::vector<stencil::Statement>& body) {
  return std::ranges::all_of(
      body, [](const stencil::Statement& statement) { return is_one_of<stencil::Fill, stencil::Run>(statement); });
}

}  // namespace

void FrozenKernels::add_fields_of(const std::vector<stencil::Statement>& body) {
  for (const stencil::Statement& statement : body) {
    match(
        statement, ignored<stencil::Fill, stencil::Fold, stencil::NetworkCall, stencil::Run>,
        [&](const stencil::Reduce& reduce) { add_field(reduce.field), add_field(reduce.result); },
        [&](const stencil::Transform& transform) {
          const Id result = add_field(transform.result);
          for (const stencil::Transform::Term& term : transform.terms) add_waves_of(term, result);
          add_symbols_of(transform);
        },
        [&](const stencil::Solve& solve) {
          for (const auto* names : {&solve.images, &solve.rights, &solve.unknowns})
            std::ranges::for_each(*names, [&](const std::string& name) { add_field(name); });
          add_fields_of(solve.body);
        },
        [&](const stencil::Repeat& repeat) {
          for (const stencil::LoopCarried& carry : repeat.carries)
            add_field(carry.state), add_field(carry.next), add_field(carry.result);
          add_fields_of(repeat.body);
        });
  }
}

FrozenKernels::FrozenKernels(const stencil::Module& module, const std::set<std::string>& varied,
                             const std::set<std::string>& rates) {
  const stencil::Program& program = module.programs.front();
  const Unperturbed unperturbed(module, varied, rates);
  for (const stencil::Kernel& kernel : module.kernels)
    kernels_[kernel.name] = Reader(*this, unperturbed).read(kernel, varied, rates);
  for (const stencil::Swap& swap : program.swaps) add_field(swap.state), add_field(swap.next);
  std::ptrdiff_t known = -1;
  for (std::ptrdiff_t count = 0; count != known; count = count_waves()) {
    known = count;
    add_fields_of(program.body);
  }
  is_rational_in_step_ = is_of_kernels_alone(program.body) && StepDependence(*this).is_rational();
}

}  // namespace dpde::stability
