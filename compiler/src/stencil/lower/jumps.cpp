// SPDX-License-Identifier: Apache-2.0
#include "stencil/lower/jumps.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "stencil/build.h"
#include "support/match.h"
#include "support/maths/piecewise.h"

namespace dpde::stencil {

namespace {

/// Converts a value of a kernel, with lets substituted, to an expression of independent symbols.
class Converter {
 public:
  Converter(const Kernel& kernel, const Movement& movement) : movement_(movement) {
    for (const Let& let : kernel.lets) lets_.emplace(let.name, let.value);
  }

  Piecewise::Id convert(const Expr& e);
  const Piecewise& formula() const { return formula_; }
  /// Fields and parameters on which the switch depends.
  std::set<std::string> movers_of(Piecewise::Id id);
  /// The function that switches; "" for if.
  std::string function_of(Piecewise::Id id) const;
  bool is_pole(Piecewise::Id id) const;

 private:
  using Id = Piecewise::Id;
  Id convert_new(const Expr& e);
  Id local(const std::string& name);
  Id symbol(const Expr& e, const Piecewise::Symbol& symbol);
  bool moves(const Expr& e) { return !names_in(e).empty(); }
  std::set<std::string> names_in(const Expr& e);
  const std::set<std::string>& names_in_let(const std::string& name);

  const Movement& movement_;
  std::map<std::string, Expr> lets_;
  std::map<std::string, Id> known_lets_;
  std::map<std::string, std::set<std::string>> names_of_lets_;
  std::map<const Node*, Id> known_;
  std::map<Id, Expr> sources_;
  std::vector<std::pair<Expr, Id>> symbols_;
  Piecewise formula_;
};

/// Names of the fields and parameters in `e` that vary.
std::set<std::string> Converter::names_in(const Expr& e) {
  std::set<std::string> names;
  const auto add = [&](const std::string& name) {
    if (movement_.moves(name)) names.insert(name);
  };
  visit(e, [&](const Expr& part) {
    if (const auto* param = as<Param>(part)) add(param->name);
    if (const auto* access = as<Access>(part)) add(access->field);
    if (const auto* interp = as<Interp>(part)) add(interp->field);
    const auto* local = as<Local>(part);
    if (local == nullptr || !lets_.contains(local->name)) return;
    const std::set<std::string>& of_let = names_in_let(local->name);
    names.insert(of_let.begin(), of_let.end());
  });
  return names;
}

/// Cached for each let: in a chain of lets each may occur twice in the next, which would take exponential time.
const std::set<std::string>& Converter::names_in_let(const std::string& name) {
  const auto found = names_of_lets_.find(name);
  if (found != names_of_lets_.end()) return found->second;
  return names_of_lets_.emplace(name, names_in(lets_.at(name))).first->second;
}

std::set<std::string> Converter::movers_of(Piecewise::Id id) {
  const Expr& e = sources_.at(id);
  const auto* select = as<Select>(e);
  return names_in(select ? select->condition : e);
}

std::string Converter::function_of(Piecewise::Id id) const {
  const auto* call = std::get_if<Call>(&sources_.at(id)->kind);
  return call ? std::string(name_of(call->fn)) : "";
}

bool Converter::is_pole(Piecewise::Id id) const {
  const Expr& e = sources_.at(id);
  const auto* call = as<Call>(e);
  return is<Binary>(e) || (call && has_poles(call->fn));
}

Piecewise::Id Converter::symbol(const Expr& e, const Piecewise::Symbol& symbol) {
  const auto found = std::ranges::find(symbols_, e, &std::pair<Expr, Id>::first);
  if (found != symbols_.end()) return found->second;
  return symbols_.emplace_back(e, formula_.symbol(symbol)).second;
}

Piecewise::Id Converter::local(const std::string& name) {
  const auto found = known_lets_.find(name);
  if (found != known_lets_.end()) return found->second;
  const Id id = convert(lets_.at(name));
  known_lets_.emplace(name, id);
  return id;
}

Piecewise::Id Converter::convert(const Expr& e) {
  const auto found = known_.find(&e.node());
  if (found != known_.end()) return found->second;
  const Id id = convert_new(e);
  known_.emplace(&e.node(), id);
  sources_.emplace(id, e);
  return id;
}

Piecewise::Id Converter::convert_new(const Expr& e) {
  return match(
      e->kind, [&](const Literal& l) { return formula_.number(l.value); },
      [&](const Param& p) { return symbol(e, movement_.param(p.name)); }, [&](const Local& l) { return local(l.name); },
      [&](const Access&) { return symbol(e, {.moves = moves(e), .has_unknown_sign = movement_.keeps_signs}); },
      [&](const Interp&) { return symbol(e, {.moves = moves(e), .has_unknown_sign = movement_.keeps_signs}); },
      [&](const Inside&) { return symbol(e, {.value = 1.0}); },
      [&](const Neg& n) { return formula_.negate(convert(n.operand)); },
      [&](const Binary& b) {
        const Id left = convert(b.left);
        return formula_.binary(b.op, left, convert(b.right));
      },
      [&](const Call& c) {
        const Id first = convert(c.arguments.front());
        return formula_.call(c.fn, first,
                             c.arguments.size() > 1 ? std::optional(convert(c.arguments[1])) : std::nullopt);
      },
      [&](const Select& s) {
        const Id condition = convert(s.condition), yes = convert(s.yes);
        return formula_.choice(condition, yes, convert(s.no));
      });
}

}  // namespace

std::optional<KernelJump> jump_in(const Kernel& kernel, const Movement& movement) {
  std::vector<std::pair<Expr, SourceRange>> values;
  for (const Store& store : kernel.stores) values.emplace_back(store.value, store.origin.range);
  for (const Sum& sum : kernel.sums) values.emplace_back(sum.value, kernel.origin.range);
  for (const Scatter& scatter : kernel.scatters) values.emplace_back(scatter.value, kernel.origin.range);
  for (const auto& [value, range] : values) {
    Converter converter(kernel, movement);
    converter.convert(value);
    if (const std::optional<Piecewise::Id> jump = find_jump(converter.formula()))
      return KernelJump{range.is_known() ? range : kernel.origin.range, converter.function_of(*jump),
                        converter.movers_of(*jump), converter.is_pole(*jump)};
  }
  return std::nullopt;
}

}  // namespace dpde::stencil
