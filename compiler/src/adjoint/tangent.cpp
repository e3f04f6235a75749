// SPDX-License-Identifier: Apache-2.0
// Forward mode: computes with every value its directional derivative, statement by statement, in the primal's order.
#include <algorithm>

#include "adjoint/adjoint.h"
#include "adjoint/check/extremes.h"
#include "adjoint/reverse/plan.h"
#include "adjoint/reverse/transforms.h"
#include "adjoint/reverse/weights.h"
#include "adjoint/solves.h"
#include "stencil/analyse/effects.h"
#include "stencil/passes/passes.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// Derivative of a sum: the plain derivative, or the sum of squares of its residuals' derivatives.
enum class SumForm { derivative, squares };

/// Collects the factors of a product; a negation is a factor -1.
void collect_factors(const Expr& e, std::vector<Expr>& factors) {
  const Binary* b = as<Binary>(e);
  if (b && b->op == BinaryOp::multiply) {
    collect_factors(b->left, factors);
    collect_factors(b->right, factors);
  } else if (const Neg* neg = as<Neg>(e)) {
    factors.push_back(-1.0);
    collect_factors(neg->operand, factors);
  } else {
    factors.push_back(e);
  }
}

/// Writes the tangent kernel of one kernel.
class KernelTangent {
 public:
  KernelTangent(const Kernel& kernel, const Varied& varied, DerivedNames& names, SumForm form)
      : form_(form),
        kernel_(kernel),
        varied_{varied.fields, varied.params, varied_locals(kernel, varied)},
        names_(names) {}

  Kernel build() {
    Kernel result{names_.fresh_kernel(kernel_.name + "_tangent"), kernel_.rank, {}, {}, {}, {}};
    for (const Let& let : kernel_.lets) {
      result.lets.push_back(let);
      if (!varied_.locals.contains(let.name)) continue;
      const Expr value = dot(let.value);
      dots_[let.name] = names_.fresh(let.name + "_dot");
      result.lets.push_back({dots_[let.name], value});
    }
    for (const Store& store : kernel_.stores) {
      if (!varied_.fields.contains(store.field)) continue;
      result.stores.push_back({names_.of(store.field), store.accumulate, dot(store.value), store.origin});
    }
    for (const Sum& sum : kernel_.sums) {
      if (!is_varied(sum.value, varied_)) continue;
      const Expr value = form_ == SumForm::derivative ? dot(sum.value) : squares(sum.value);
      result.sums.push_back({names_.of(sum.name), value});
    }
    for (const Scatter& scatter : kernel_.scatters) add_scatter(scatter, result);
    return with_lets_inlined(result);
  }
  /// Whether the form is `squares` and a sum is not a sum of squares.
  bool failed() const { return failed_; }

 private:
  /// d/de of  target.field(at d) += value  is  (dot of value at d) + sum_a (value * dot d_a, with the weights' slopes).
  void add_scatter(const Scatter& scatter, Kernel& result) {
    if (!varied_.fields.contains(scatter.target.field)) return;
    Interp target = scatter.target;
    target.field = names_.of(target.field);
    if (is_varied(scatter.value, varied_)) result.scatters.push_back({target, dot(scatter.value)});
    for (size_t axis = 0; axis < target.displacement.size(); ++axis) {
      const Expr& d = target.displacement[axis];
      const std::optional<InterpolationBasis> slope = derivative_of(target.along[axis]);
      if (!slope || !is_varied(d, varied_)) continue;
      Interp moved = target;
      moved.along[axis] = *slope;
      result.scatters.push_back({moved, scatter.value * dot(d)});
    }
  }

  Expr dot_of_interp(const Interp& i) {
    Expr total = 0.0;
    if (varied_.fields.contains(i.field)) {
      Interp moved = i;
      moved.field = names_.of(i.field);
      total = interp(moved);
    }
    for (size_t axis = 0; axis < i.displacement.size(); ++axis) {
      const std::optional<InterpolationBasis> derivative = derivative_of(i.along[axis]);
      if (!derivative) continue;
      Interp slope = i;
      slope.along[axis] = *derivative;
      total = total + interp(slope) * dot(i.displacement[axis]);
    }
    return total;
  }

  Expr dot_of_parts(const Expr& e) {
    Expr total = 0.0;
    int index = 0;
    for_each_child(e, [&](const Expr& child) {
      if (is_varied(child, varied_)) total = total + times_partial(e, index, dot(child));
      ++index;
    });
    return total;
  }

  Expr dot(const Expr& e) {
    if (!is_varied(e, varied_)) return 0.0;
    return match(
        e->kind,  //
        [&](const Literal&) { return Expr(0.0); }, [&](const Inside&) { return Expr(0.0); },
        [&](const Param& p) { return param(names_.of(p.name)); },
        [&](const Local& l) { return local(dots_.at(l.name)); },
        [&](const Access& a) { return access(names_.of(a.field), a.offset); },
        [&](const Interp& i) { return dot_of_interp(i); }, [&](const Neg&) { return dot_of_parts(e); },
        [&](const Binary&) { return dot_of_parts(e); }, [&](const Call&) { return dot_of_parts(e); },
        [&](const Select& s) { return select(s.condition, dot(s.yes), dot(s.no)); });
  }

  /// The sum of c*r_dot^2 for e, a sum of c*r^2.
  Expr squares(const Expr& e) {
    if (!is_varied(e, varied_)) return 0.0;
    if (const Local* l = as<Local>(e)) {
      const auto let =
          std::find_if(kernel_.lets.begin(), kernel_.lets.end(), [&](const Let& x) { return x.name == l->name; });
      return squares(let->value);
    }
    if (const Select* s = as<Select>(e)) return select(s->condition, squares(s->yes), squares(s->no));
    const Binary* b = as<Binary>(e);
    const bool right_is_fixed = b && !is_varied(b->right, varied_);
    if (b && (b->op == BinaryOp::add || (b->op == BinaryOp::subtract && right_is_fixed)))
      return squares(b->left) + squares(b->right);
    if (b && b->op == BinaryOp::divide && right_is_fixed) return squares(b->left) / b->right;
    if (b && b->op == BinaryOp::power && is_literal(b->right, 2)) return power(dot(b->left), 2.0);
    if (b && b->op == BinaryOp::multiply) return squares_of_product(e);
    failed_ = true;
    return 0.0;
  }

  Expr squares_of_product(const Expr& e) {
    std::vector<Expr> factors, varied;
    collect_factors(e, factors);
    Expr fixed = 1.0;
    for (const Expr& factor : factors) {
      if (is_varied(factor, varied_)) {
        varied.push_back(factor);
      } else {
        fixed = fixed * factor;
      }
    }
    const Literal* number = as<Literal>(fixed);
    if (number && number->value < 0) failed_ = true;
    if (varied.size() == 1) return fixed * squares(varied[0]);
    if (varied.size() == 2 && varied[0] == varied[1]) return fixed * power(dot(varied[0]), 2.0);
    failed_ = true;
    return 0.0;
  }

  const SumForm form_;
  const Kernel& kernel_;
  const Varied varied_;
  DerivedNames& names_;
  bool failed_ = false;
  std::map<std::string, std::string> dots_;  // local -> its tangent
};

bool writes_varied(const Kernel& kernel, const Varied& varied) {
  for (const Store& store : kernel.stores) {
    if (varied.fields.contains(store.field)) return true;
  }
  for (const Scatter& scatter : kernel.scatters) {
    if (varied.fields.contains(scatter.target.field)) return true;
  }
  const Varied inside{varied.fields, varied.params, varied_locals(kernel, varied)};
  for (const Sum& sum : kernel.sums) {
    if (is_varied(sum.value, inside)) return true;
  }
  return false;
}

/// Sets tangents of inputs that vary only by their boundary values: 0 in the interior.
void add_still_inputs(const Module& module, const Program& program, const Varied& varied, const Activity& wrt,
                      DerivedNames& names, Program& derived, Module& kernels) {
  Kernel still{
      names.fresh_kernel(program.name + "_tangent_still"), static_cast<int>(program.axes.size()), {}, {}, {}, {}};
  for (const std::string& input : interface_of(module, program).inputs) {
    const bool state =
        std::any_of(program.swaps.begin(), program.swaps.end(), [&](const Swap& swap) { return swap.state == input; });
    if (state || wrt.fields.contains(input) || !varied.fields.contains(input)) continue;
    still.stores.push_back({names.of(input), false, 0.0, {}});
  }
  if (still.stores.empty()) return;
  derived.body.push_back(Run{still.name});
  kernels.kernels.push_back(std::move(still));
}

/// Appends the tangents of a network's outputs after the network.
void add_rates(NetworkCall network_call, const Varied& varied, DerivedNames& names, Program& derived) {
  const std::vector<std::string> written = fields_written(network_call);
  if (std::ranges::none_of(written, [&](const std::string& field) { return varied.fields.contains(field); })) return;
  network_call.mode = NetworkCall::Mode::tangent;
  network_call.weights = varied.params.contains(network_call.network);
  for (const std::string& input : network_call.inputs)
    network_call.rates.push_back(varied.fields.contains(input) ? names.of(input) : "");
  for (std::string& result : network_call.results) result = result.empty() ? "" : names.of(result);
  derived.body.push_back(network_call);
}

/// Appends the tangent of a reduction after the reduction.
void add_reduction(const Reduce& reduce, const Program& program, const Varied& varied, DerivedNames& names,
                   Program& derived, Module& kernels) {
  if (!varied.fields.contains(reduce.result)) return;
  if (!varied.fields.contains(reduce.field)) {  // the result varies by later additions only
    add_store(names.of(reduce.result), 0.0, "still", {program, "_tangent", names, kernels, derived.body});
  } else if (is_extreme(reduce)) {
    add_tangent_of_extreme(reduce, {program, "_tangent", names, kernels, derived.body});
  } else {
    derived.body.push_back(Reduce{names.of(reduce.result), reduce.kind, names.of(reduce.field), reduce.over});
  }
}

/// The fill of the tangent. If weights of mixed(a, b, c) vary, a kernel before it stores the tangent of c in a field.
void add_fill(const Module& module, const Fill& fill, const Program& program, const Varied& varied, DerivedNames& names,
              Program& derived, Module& kernels) {
  if (!varied.fields.contains(fill.field)) return;
  const DerivedField dot_of_wall = [&](const std::string& wall) {
    return varied.fields.contains(wall) ? std::optional(names.of(wall)) : std::nullopt;
  };
  Fill result{names.of(fill.field), derived_sides(fill.axes, dot_of_wall)};
  const std::vector<WallSide> sides = sides_with_varied_weights(fill.axes, varied);
  if (sides.empty()) {
    derived.body.push_back(std::move(result));
    return;
  }
  const auto halo = required_halo(module, program).at(fill.field);
  const int layers = *std::max_element(halo.begin(), halo.end());
  if (layers > 0 || is_on_walls(fill.axes)) {
    Kernel walls{
        names.fresh_kernel(program.name + "_tangent_walls"), static_cast<int>(program.axes.size()), {}, {}, {}, {}};
    for (const WallSide& at : sides) {
      Side& side = side_at(result.axes, at);
      Expr rate = side.value;
      for (const auto& [name, slope] : weight_slopes(fill.field, side_at(fill.axes, at), at, layers, varied)) {
        rate = rate - slope * param(names.of(name));
      }
      const std::string field = names.fresh(fill.field + "_wall_dot");
      walls.stores.push_back({field, false, rate, {}});
      side.value = access(field);
    }
    derived.body.push_back(Run{walls.name, layers});
    kernels.kernels.push_back(std::move(walls));
  }
  derived.body.push_back(std::move(result));
}

/// Writes the statements of a tangent, in blocks too.
class TangentWriter {
 public:
  TangentWriter(const Module& module, const Program& program, const Varied& varied, DerivedNames& names, SumForm form,
                Module& kernels)
      : module_(module), program_(program), varied_(varied), names_(names), form_(form), kernels_(kernels) {}

  void add(const std::vector<Statement>& statements, Program& derived) {
    for (const Statement& statement : statements) {
      match(
          statement,
          [&](const Fill& fill) {
            derived.body.push_back(fill);
            add_fill(module_, fill, program_, varied_, names_, derived, kernels_);
          },
          [&](const Fold& fold) { add_fold(fold, derived); },
          [&](const Reduce& reduce) {
            derived.body.push_back(reduce);
            add_reduction(reduce, program_, varied_, names_, derived, kernels_);
          },
          [&](const NetworkCall& network_call) {
            derived.body.push_back(network_call);
            add_networks(kernels_, {*module_.find_network(network_call.network)});
            add_rates(network_call, varied_, names_, derived);
          },
          [&](const Transform& transform) {
            derived.body.push_back(transform);
            add_tangent_of(transform, varied_, {program_, "_tangent", names_, kernels_, derived.body});
          },
          [&](const Run& run) { add_run(run, derived); }, [&](const Solve& solve) { add_solve(solve, derived); },
          [&](const Repeat& repeat) { add_repeat(repeat, derived); });
    }
  }
  /// Whether the form is `squares` and a sum is not a sum of squares.
  bool failed() const { return failed_; }

 private:
  void add_fold(const Fold& fold, Program& derived) {
    const DerivedField dot_of_wall = [&](const std::string& wall) {
      return varied_.fields.contains(wall) ? std::optional(names_.of(wall)) : std::nullopt;
    };
    derived.body.push_back(fold);
    if (!varied_.fields.contains(fold.field)) return;
    derived.body.push_back(Fold{names_.of(fold.field), fold.grow, derived_sides(fold.axes, dot_of_wall)});
  }

  /// Runs the tangent kernel before the primal one, which may add to fields that the tangent reads.
  void add_run(const Run& run, Program& derived) {
    const Kernel& kernel = *module_.find_kernel(run.kernel);
    if (!kernels_.find_kernel(kernel.name)) kernels_.kernels.push_back(kernel);
    if (writes_varied(kernel, varied_)) {
      KernelTangent derived_kernel(kernel, varied_, names_, form_);
      Kernel dots = derived_kernel.build();
      failed_ = failed_ || derived_kernel.failed();
      derived.body.push_back(Run{dots.name, run.grow});
      kernels_.kernels.push_back(std::move(dots));
    }
    derived.body.push_back(run);
  }

  /// A*x = b: A*x_dot = b_dot - A_dot*x, with the same operator; see adjoint/solves.h.
  void add_solve(const Solve& solve, Program& derived) {
    derived.body.push_back(solve);
    add_kernels(kernels_, module_, operator_of(solve, program_));
    if (solve.preconditioner) add_networks(kernels_, {*module_.find_network(solve.preconditioner->network)});
    if (!varied_.fields.contains(solve.unknowns.front())) return;
    std::vector<std::string> rates;
    std::vector<Expr> rights;
    bool right_varies = false;
    for (const std::string& unknown : solve.unknowns) rates.push_back(names_.of(unknown));
    for (const std::string& right : solve.rights) {
      const bool varies = varied_.fields.contains(right);
      right_varies = right_varies || varies;
      rights.push_back(varies ? access(names_.of(right)) : Expr(0.0));
    }
    Writing into{program_, "_tangent", names_, kernels_, derived.body};
    if (has_varied_operator(module_, solve, varied_)) {
      const OperatorCopy copy = copy_with_inputs(module_, solve, program_, names_);
      add_copies(copy, into);
      const Varied inside = find_varied(copy.module, copy.program, copy.activity(varied_));
      for (const auto& [input, copied] : copy.inputs) {  // inputs that vary by boundary values only: 0 inside
        if (inside.fields.contains(copied))
          add_store(names_.of(copied), copy.is_active(input, varied_) ? access(names_.of(input)) : Expr(0.0), "copy",
                    into);
      }
      TangentWriter(copy.module, copy.program, inside, names_, form_, kernels_).add(copy.program.body, derived);
      for (std::size_t i = 0; i < rights.size(); ++i) {
        if (inside.fields.contains(copy.images[i])) rights[i] = rights[i] - access(names_.of(copy.images[i]));
      }
    } else if (!right_varies) {  // the unknowns vary by later additions only
      for (const std::string& rate : rates) add_store(rate, 0.0, "still", into);
      return;
    }
    Solve moved = linearised(module_, program_, solve, rates, names_, kernels_);
    for (std::size_t i = 0; i < rates.size(); ++i) {
      moved.rights.push_back(names_.fresh(rates[i] + "_right"));
      add_store(moved.rights.back(), rights[i], "right", into);
    }
    derived.body.push_back(std::move(moved));
  }

  /// The repeat of the tangent of its block; carried fields and stacks have tangents too.
  void add_repeat(const Repeat& repeat, Program& derived) {
    Program pass{derived.name, derived.axes, {}, {}, {}};
    add(repeat.body, pass);
    Repeat result = repeat;
    result.body = std::move(pass.body);
    for (const LoopCarried& carry : repeat.carries) {
      if (varied_.fields.contains(carry.next))
        result.carries.push_back({names_.of(carry.state), names_.of(carry.next), names_.of(carry.result)});
    }
    for (auto* stacked : {&result.saves, &result.loads}) {
      for (std::size_t i = stacked->size(); i-- > 0;) {
        const TapeEntry primal = (*stacked)[i];
        if (varied_.fields.contains(primal.field))
          stacked->push_back({names_.of(primal.field), names_.of(primal.stack)});
      }
    }
    derived.body.push_back(std::move(result));
  }

  const Module& module_;
  const Program& program_;
  const Varied& varied_;
  DerivedNames& names_;
  const SumForm form_;
  Module& kernels_;
  bool failed_ = false;
};

}  // namespace

Solve linearised(const Module& module, const Program& program, const Solve& solve,
                 const std::vector<std::string>& rates, DerivedNames& names, Module& kernels) {
  if (solve.is_linear) {
    Solve copy = copy_of(module, solve, rates, names, kernels);
    copy.rights.clear();
    return copy;
  }
  Module source;
  std::vector<std::string> unknowns;
  for (const std::string& unknown : solve.unknowns) unknowns.push_back(names.fresh(unknown));
  const Solve copy = copy_of(module, solve, unknowns, names, source);
  const Program block = operator_of(copy, program);
  const Varied varied = find_varied(source, block, {{unknowns.begin(), unknowns.end()}, {}});
  Program derived = operator_of(copy, program);
  derived.body.clear();
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    names.of(unknowns[i]);
    names.rebind(unknowns[i], rates[i]);
    add_store(unknowns[i], access(solve.unknowns[i]), "solution", {program, "_tangent", names, kernels, derived.body});
  }
  TangentWriter(source, block, varied, names, SumForm::derivative, kernels).add(block.body, derived);
  Solve result{{}, {}, rates, std::move(derived.body), solve.by, solve.written};
  for (const std::string& image : copy.images) {
    result.images.push_back(names.of(image));
    if (!varied.fields.contains(image))
      add_store(result.images.back(), 0.0, "still", {program, "_tangent", names, kernels, result.body});
  }
  return result;
}

namespace {

/// nullopt if the form is `squares` and a sum is not a sum of squares.
std::optional<Derivative> derive(const Module& module, const std::string& name, const Activity& wrt, SumForm form,
                                 DiagnosticSink& sink) {
  const Program* program = module.find_program(name);
  require(program != nullptr, "tangent of a program that is not in the module");
  const Varied varied = find_varied(module, *program, wrt);
  if (!check_differentiable(module, *program, varied, Way::forward, sink)) return Derivative{};

  DerivedNames names(module, "_dot");
  Derivative result;
  result.program = names.fresh_program(name + (form == SumForm::derivative ? "_tangent" : "_squares"));
  Program derived{result.program, program->axes, {}, program->swaps, program->keeps};
  add_still_inputs(module, *program, varied, wrt, names, derived, result.module);
  TangentWriter writer(module, *program, varied, names, form, result.module);
  writer.add(program->body, derived);
  for (const Swap& swap : program->swaps) {
    if (varied.fields.contains(swap.next)) derived.swaps.push_back({names.of(swap.state), names.of(swap.next)});
  }
  for (const std::string& keep : program->keeps) {
    if (varied.fields.contains(keep)) derived.keeps.push_back(names.of(keep));
  }
  for (const std::string& field : wrt.fields) names.of(field);
  for (const std::string& p : wrt.params) names.of(p);
  result.module.programs.push_back(std::move(derived));
  result.links = names.links(module, *program, wrt);
  if (writer.failed()) return std::nullopt;
  return result;
}

}  // namespace

Derivative tangent(const Module& module, const std::string& name, const Activity& wrt, DiagnosticSink& sink) {
  return *derive(module, name, wrt, SumForm::derivative, sink);
}

std::optional<Derivative> squares_of_tangent(const Module& module, const std::string& name, const Activity& wrt,
                                             DiagnosticSink& sink) {
  return derive(module, name, wrt, SumForm::squares, sink);
}

}  // namespace dpde::adjoint
