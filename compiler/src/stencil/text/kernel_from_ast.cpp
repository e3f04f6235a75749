// SPDX-License-Identifier: Apache-2.0
// The role of a name decides its use: a field is read, `out` is written with =, `inout` and `sum` are added to with
// +=. Reads of fields that the kernel writes would depend on the order of the points: they are reported, with a
// rewrite that avoids them.
#include "stencil/text/kernel_from_ast.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/text/expr_from_ast.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

using ast::KernelRole;

const char* role_name(KernelRole role) {
  switch (role) {
    case KernelRole::in: return "field";
    case KernelRole::out: return "field to be written";
    case KernelRole::inout: return "field to be added to";
    case KernelRole::param: return "param";
    case KernelRole::sum: return "sum";
  }
  return "";
}

const char* role_prefix(KernelRole role) {
  return role == KernelRole::out ? "out" : role == KernelRole::inout ? "inout" : role == KernelRole::sum ? "sum" : "";
}

bool is_read(KernelRole role) { return role == KernelRole::in || role == KernelRole::param; }

/// The number of axes that the first offset or interp below `e` shows.
std::optional<int> shown_rank(const ast::Expr& e) {
  std::optional<int> rank;
  match_some(
      e->kind, [&](const ast::Offsets& o) { rank = static_cast<int>(o.offsets.size()); },
      [&](const ast::Call& c) {
        if (find_interp(c.callee) && c.arguments.size() > 1) rank = static_cast<int>(c.arguments.size()) - 1;
      });
  for_each_part(e, [&](const ast::Expr& part) { rank = rank ? rank : shown_rank(part); });
  return rank;
}

std::optional<int> shown_rank(const ast::Kernel& kernel) {
  if (kernel.axes) return kernel.axes;
  for (const ast::Item& item : kernel.items) {
    std::optional<int> rank;
    if (const auto* let = get_if<ast::LetItem>(&item.kind)) rank = shown_rank(let->value);
    if (const auto* assign = get_if<ast::AssignItem>(&item.kind)) rank = shown_rank(assign->value);
    if (const auto* scatter = get_if<ast::ScatterItem>(&item.kind)) rank = shown_rank(scatter->target);
    if (const auto* adjoint = get_if<ast::AdjointItem>(&item.kind)) rank = shown_rank(adjoint->value);
    if (rank) return rank;
  }
  return std::nullopt;
}

class KernelReader : public ExprReader {
 public:
  KernelReader(const ast::Kernel& source, DiagnosticSink& sink) : ExprReader(sink), source_(source) {
    const std::optional<int> rank = shown_rank(source);
    result_.rank_known = rank.has_value();
    kernel_.name = source.name.name;
    kernel_.rank = std::clamp(rank.value_or(1), 1, max_rank);
    if (rank && *rank != kernel_.rank) {
      report("not-in-kernels", source.name.range, {fmt::format("a grid of {} axes", *rank)});
    }
  }

  KernelRead run() {
    for (const ast::KernelParameter& parameter : source_.parameters) declare(parameter);
    for (const ast::Item& item : source_.items) read_item(item);
    for (const ast::KernelParameter& parameter : source_.parameters) check_written(parameter);
    check_halos();
    for (const ast::Item& item : source_.items) {
      if (const auto* adjoint = get_if<ast::AdjointItem>(&item.kind)) read_adjoint(*adjoint);
    }
    kernel_ = without_idle_formulas(std::move(kernel_));
    return result_;
  }

 private:
  Diagnostic& report(KindRef kind, SourceRange range, std::initializer_list<std::string> arguments,
                     const Hint& hint = {}) {
    result_.good = false;
    return sink().report(kind, range, arguments, hint);
  }

  // ---- declarations ------------------------------------------------------------------------------------------------
  void declare(const ast::KernelParameter& parameter) {
    if (parameters_.contains(parameter.name.name)) {
      report("name-taken", parameter.name.range, {parameter.name.name, "another parameter"});
    }
    parameters_.emplace(parameter.name.name, &parameter);
  }

  const ast::KernelParameter* find(const std::string& name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() ? nullptr : found->second;
  }

  void report_unknown(const std::string& name, SourceRange range, const std::string& declaration) {
    report("kernel-unknown-name", range, {name, kernel_.name}, [&] {
      std::vector<std::string> candidates(locals_.begin(), locals_.end());
      for (const auto& [known, parameter] : parameters_) candidates.push_back(known);
      const std::string nearest = nearest_name(name, candidates);
      return nearest.empty() ? fmt::format("add {} to the parameters of the kernel", declaration)
                             : fmt::format("did you mean {}?", nearest);
    });
  }

  void check_written(const ast::KernelParameter& parameter) {
    if (is_read(parameter.role) || written_.contains(parameter.name.name)) return;
    report("kernel-not-written", parameter.name.range, {parameter.name.name, role_prefix(parameter.role), kernel_.name},
           fmt::format("write {} {} ..., or leave the parameter out", parameter.name.name,
                       parameter.role == KernelRole::sum ? "+=" : "="));
  }

  void check_halos() {
    const Signature s = signature(kernel_);
    for (const Signature::Read& read : s.reads) {
      const ast::KernelParameter* parameter = find(read.field);
      const int needed = *std::max_element(read.halo.begin(), read.halo.end());
      if (!parameter || !parameter->halo || *parameter->halo >= needed) continue;
      report("kernel-halo-too-small", parameter->name.range,
             {read.field, fmt::format("{}", needed), fmt::format("{}", *parameter->halo)},
             fmt::format("write {}: field halo {}", read.field, needed));
    }
  }

  // ---- items -------------------------------------------------------------------------------------------------------
  void read_item(const ast::Item& item) {
    if (const auto* let = get_if<ast::LetItem>(&item.kind)) {
      read_let(*let);
    } else if (const auto* assign = get_if<ast::AssignItem>(&item.kind)) {
      read_assignment(*assign, item.range);
    } else if (const auto* scatter = get_if<ast::ScatterItem>(&item.kind)) {
      read_scatter(*scatter);
    } else if (!holds<ast::AdjointItem>(item.kind)) {
      report("not-in-kernels", item.range, {"this item"});
    }
  }

  Expr value_of(const ast::Expr& e) {
    const std::size_t before = sink().all().size();
    const Expr value = read(e);
    if (sink().all().size() != before) result_.good = false;
    return value;
  }

  void read_let(const ast::LetItem& let) {
    const std::string& name = let.name.name;
    const Expr value = value_of(let.value);
    if (find(name) || locals_.contains(name)) {
      report("name-taken", let.name.range, {name, find(name) ? "a parameter" : "another let"});
    }
    locals_.insert(name);
    kernel_.lets.push_back({name, value});
  }

  void read_assignment(const ast::AssignItem& assign, SourceRange range) {
    const std::string& name = assign.target.name;
    const Expr value = value_of(assign.value);
    const ast::KernelParameter* parameter = find(name);
    if (locals_.contains(name)) {
      report("kernel-wrong-role", assign.target.range, {name, "let", "result"},
             "a let is written once; use another name");
      return;
    }
    if (!parameter) return report_unknown(name, assign.target.range, fmt::format("out {}: field", name));
    const bool is_first = written_.insert(name).second;
    if (!check_operator(*parameter, assign)) return;
    if (!is_first && parameter->role != KernelRole::sum) {
      report("kernel-wrong-assignment", assign.target.range, {name, role_name(parameter->role), "one statement only"},
             "add the values in one expression");
    }
    if (parameter->role == KernelRole::sum) {
      add_sum(name, value);
    } else {
      kernel_.stores.push_back({name, assign.accumulate, value, Origin{range}});
    }
  }

  void add_sum(const std::string& name, const Expr& value) {
    for (Sum& sum : kernel_.sums) {
      if (sum.name == name) {
        sum.value = sum.value + value;
        return;
      }
    }
    kernel_.sums.push_back({name, value});
  }

  bool check_operator(const ast::KernelParameter& parameter, const ast::AssignItem& assign) {
    const std::string& name = parameter.name.name;
    switch (parameter.role) {
      case KernelRole::in:
        report("kernel-race", assign.target.range, {kernel_.name, name}, second_field_hint(name));
        return false;
      case KernelRole::param:
        report("kernel-wrong-role", assign.target.range, {name, "param", "result"},
               fmt::format("declare sum {}: param to add up values, or out {}: field", name, name));
        return false;
      case KernelRole::out:
        if (!assign.accumulate) return true;
        report("kernel-wrong-assignment", assign.target.range, {name, role_name(parameter.role), "="},
               fmt::format("declare inout {}: field to add to it", name));
        return false;
      case KernelRole::inout:
      case KernelRole::sum:
        if (assign.accumulate) return true;
        report("kernel-wrong-assignment", assign.target.range, {name, role_name(parameter.role), "+="});
        return false;
    }
    return false;
  }

  void read_scatter(const ast::ScatterItem& scatter) {
    const Expr value = value_of(scatter.value);
    const auto* call = std::get_if<ast::Call>(&scatter.target->kind);
    if (!call || !find_interp(call->callee)) {
      report("not-in-kernels", scatter.target.range(), {"an assignment to this"}, "write interp(field, ...) += value");
      return;
    }
    const std::optional<Interp> target = interp_of(*call, scatter.target.range(), KernelRole::inout);
    if (!target) return;
    written_.insert(target->field);
    kernel_.scatters.push_back({*target, value});
  }

  // ---- the adjoint that is given ------------------------------------------------------------------------------------
  void read_adjoint(const ast::AdjointItem& item) {
    const std::string& name = item.target.name;
    const ast::KernelParameter* input = nullptr;
    for (const ast::KernelParameter& parameter : source_.parameters) {
      if (is_read(parameter.role) && bar_of(parameter.name.name) == name) input = &parameter;
    }
    if (!input) {
      std::vector<std::string> inputs;
      for (const ast::KernelParameter& p : source_.parameters) {
        if (is_read(p.role)) inputs.push_back(bar_of(p.name.name));
      }
      report("bad-given-adjoint", item.target.range, {name, kernel_.name, "belongs to no input"},
             fmt::format("inputs have {}", fmt::join(inputs, ", ")));
      return;
    }
    const bool is_sum = input->role == KernelRole::param;
    if (item.accumulate != is_sum || find_custom_adjoint(kernel_, input->name.name)) {
      const char* wrong = item.accumulate == is_sum ? "is there already"
                          : is_sum                  ? "is written with ="
                                                    : "is written with +=";
      report("bad-given-adjoint", item.target.range, {input->name.name, kernel_.name, wrong},
             is_sum ? "all points add to the adjoint of a param: write +=" : "write one formula with =, for all terms");
      return;
    }
    in_adjoint_ = true;
    const CustomAdjoint given{input->name.name, with_lets_replaced(value_of(item.value)), {item.target.range}};
    in_adjoint_ = false;
    if (!result_.good) return;
    if (const auto problem = find_problem(kernel_, given)) {
      report("bad-given-adjoint", item.value.range(), {given.input, kernel_.name, problem->what}, problem->hint);
    }
    kernel_.custom_adjoints.push_back(given);
  }

  /// Replaces lets by their values: formulas of adjoints have no lets.
  Expr with_lets_replaced(const Expr& e) const {
    const Local* l = as<Local>(e);
    if (!l) return map_children(e, [&](const Expr& child) { return with_lets_replaced(child); });
    const auto let =
        std::find_if(kernel_.lets.begin(), kernel_.lets.end(), [&](const Let& x) { return x.name == l->name; });
    return with_lets_replaced(let->value);
  }

  /// Whether the name is the seed of a stored field, in a formula of the kernel's adjoint.
  bool is_seed(const std::string& name) const { return in_adjoint_ && !find(name) && seeded_by(kernel_, name); }

  // ---- expressions -------------------------------------------------------------------------------------------------
  Expr read_name(const std::string& name, SourceRange range) override {
    if (locals_.contains(name)) return local(name);
    if (is_seed(name)) return access(name);
    const ast::KernelParameter* parameter = find(name);
    if (!parameter) {
      if (name == "pi") return 3.14159265358979323846;
      report_unknown(name, range, fmt::format("{}: field or {}: param", name, name));
      return 0.0;
    }
    switch (parameter->role) {
      case KernelRole::in: return access(name);
      case KernelRole::inout: return access(name);
      case KernelRole::param: return param(name);
      case KernelRole::out: report_race(name, range, true); return 0.0;
      case KernelRole::sum:
        report("kernel-wrong-role", range, {name, "sum", "value"}, "a sum is complete only after the kernel");
        return 0.0;
    }
    return 0.0;
  }

  /// `here`: the read has offset 0.
  void report_race(const std::string& name, SourceRange range, bool here) {
    report("kernel-race", range, {kernel_.name, name},
           here ? "give the value a name with let and use that" : second_field_hint(name));
  }

  static std::string second_field_hint(const std::string& name) {
    return fmt::format("write to a second field, out {0}_next: field, and swap {0}, {0}_next in the program", name);
  }

  /// The offsets of `o`; nullopt, after a diagnostic, if their number is not the kernel's number of axes.
  std::optional<Offset> offset_of(const ast::Offsets& o, SourceRange range) {
    if (static_cast<int>(o.offsets.size()) != kernel_.rank) {
      report("kernel-offset-count", range,
             {o.name, fmt::format("{}", o.offsets.size()), kernel_.name,
              kernel_.rank == 1 ? "1 axis" : fmt::format("{} axes", kernel_.rank)});
      return std::nullopt;
    }
    for (const int distance : o.offsets) {
      if (!check_distance(distance, -max_distance, range, sink())) return std::nullopt;
    }
    Offset offset{};
    std::copy(o.offsets.begin(), o.offsets.end(), offset.begin());
    return offset;
  }

  /// Reports a name that cannot be read at another point: it must be a field with this role.
  bool is_field(const std::string& name, SourceRange range, KernelRole role) {
    const ast::KernelParameter* parameter = find(name);
    if (locals_.contains(name)) {
      report("kernel-wrong-role", range, {name, "let", "field"},
             "a let exists at its own point only; displace the fields in it");
      return false;
    }
    if (!parameter) {
      report_unknown(name, range, fmt::format("{}{}: field", role == KernelRole::inout ? "inout " : "", name));
      return false;
    }
    if (parameter->role == role) return true;
    const bool writes = parameter->role == KernelRole::out || parameter->role == KernelRole::inout;
    if (writes && role == KernelRole::in) {
      report_race(name, range, false);
    } else {
      report("kernel-wrong-role", range, {name, role_name(parameter->role), role_name(role)},
             role == KernelRole::inout ? fmt::format("declare inout {}: field", name) : "");
    }
    return false;
  }

  Expr read_offsets(const ast::Offsets& o, SourceRange range) override {
    const std::optional<Offset> offset = offset_of(o, range);
    if (o.name == "inside") {
      const bool good = check_distance(o.grow, 0, range, sink());
      return offset && good ? inside(*offset, o.grow) : Expr(0.0);
    }
    if (is_seed(o.name)) return offset ? access(o.name, *offset) : Expr(0.0);
    const ast::KernelParameter* parameter = find(o.name);
    if (offset && *offset == Offset{} && parameter && parameter->role == KernelRole::inout) return access(o.name);
    if (!is_field(o.name, range, KernelRole::in) || !offset) return 0.0;
    return access(o.name, *offset);
  }

  /// interp(u, d...) or interp(u[+1], d...), of a field in the given role.
  std::optional<Interp> interp_of(const ast::Call& call, SourceRange range, KernelRole role) {
    if (!has_arguments(call, static_cast<std::size_t>(kernel_.rank) + 1, range)) {
      result_.good = false;
      return std::nullopt;
    }
    Interp interp;
    interp.along = *find_interp(call.callee);
    const ast::Expr& place = call.arguments[0].value;
    if (const auto* name = std::get_if<ast::Name>(&place->kind)) {
      interp.field = name->name;
    } else if (const auto* offsets = std::get_if<ast::Offsets>(&place->kind)) {
      const std::optional<Offset> offset = offset_of(*offsets, place.range());
      if (!offset) return std::nullopt;
      interp.field = offsets->name;
      interp.offset = *offset;
    } else {
      report("not-in-kernels", place.range(), {"an interpolation of this"}, "write interp(field, displacement)");
      return std::nullopt;
    }
    if (!is_field(interp.field, place.range(), role)) return std::nullopt;
    for (std::size_t i = 1; i < call.arguments.size(); ++i)
      interp.displacement.push_back(value_of(call.arguments[i].value));
    return interp;
  }

  Expr read_interp(const ast::Call& call, SourceRange range) override {
    const std::optional<Interp> interp = interp_of(call, range, KernelRole::in);
    return interp ? dpde::stencil::interp(*interp) : Expr(0.0);
  }

  const ast::Kernel& source_;
  KernelRead result_;
  Kernel& kernel_ = result_.kernel;
  std::map<std::string, const ast::KernelParameter*> parameters_;
  std::set<std::string> locals_, written_;
  bool in_adjoint_ = false;  // while a formula of the adjoint is read
};

}  // namespace

KernelRead read_kernel(const ast::Kernel& source, DiagnosticSink& sink) { return KernelReader(source, sink).run(); }

}  // namespace dpde::stencil
