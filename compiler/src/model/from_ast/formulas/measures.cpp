// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/formulas/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/unit_rules.h"
#include "model/from_ast/parts.h"
#include "support/match.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

MeasureList nothing() { return {Measure{}}; }

bool is_added(BinaryOp op) { return op == BinaryOp::add || op == BinaryOp::subtract; }

/// The terms of a sum, in their order; `e` itself if it is not a sum.
std::vector<ast::Expr> terms_of(const ast::Expr& e) {
  std::vector<ast::Expr> terms, open{e};
  while (!open.empty()) {
    const ast::Expr next = open.back();
    open.pop_back();
    const auto* b = std::get_if<ast::Binary>(&next->kind);
    const auto* u = std::get_if<ast::Unary>(&next->kind);
    if (b != nullptr && is_added(b->op)) {
      open.push_back(b->right);
      open.push_back(b->left);
    } else if (u != nullptr && u->op == ast::UnaryOp::negate) {
      open.push_back(u->operand);
    } else {
      terms.push_back(next);
    }
  }
  return terms;
}

/// A literal number: 2, -1, 1/2.
std::optional<double> written_number(const ast::Expr& e) {
  if (const auto* n = std::get_if<ast::Number>(&e->kind)) return n->value;
  if (const auto* u = std::get_if<ast::Unary>(&e->kind)) {
    const auto operand = written_number(u->operand);
    return operand && u->op == ast::UnaryOp::negate ? std::optional(-*operand) : std::nullopt;
  }
  const auto* b = std::get_if<ast::Binary>(&e->kind);
  if (b == nullptr || b->op != BinaryOp::divide) return std::nullopt;
  const auto above = written_number(b->left), below = written_number(b->right);
  return above && below && *below != 0 ? std::optional(*above / *below) : std::nullopt;
}

/// The text, shortened.
std::string shown(const ast::Expr& e) {
  constexpr std::size_t longest = 40;
  const std::string text = ast::print(e);
  return text.size() <= longest ? text : text.substr(0, longest - 3) + "...";
}

}  // namespace

Measure measure_of(Unit unit) { return {Measure::Kind::unit, std::move(unit)}; }

/// A literal number may carry a unit where it would otherwise be a pure number.
Measure product(const Measure& a, const Measure& b) {
  if (a.kind == Measure::Kind::unknown || b.kind == Measure::Kind::unknown) return {};
  if (a.is_known() && b.is_known()) return measure_of(a.unit.times(b.unit));
  const Measure& known = a.is_known() ? a : b;
  return known.is_known() && !known.unit.is_pure_number() ? known : Measure{Measure::Kind::number};
}

Measure power(const Measure& base, Fraction exponent) {
  return base.is_known() ? measure_of(base.unit.to(exponent)) : base;
}

Measure quotient(const Measure& a, const Measure& b) { return product(a, power(b, {-1, 1})); }

bool MeasuredAxes::are_alike() const {
  return std::ranges::all_of(lengths, [&](const Measure& length) { return length == lengths.front(); });
}

Measure MeasuredAxes::volume() const {
  Measure all = around;
  for (const Measure& length : lengths) all = product(all, length);
  return all;
}

Measure Measures::of_name(const std::string& name) const {
  const auto found = names_.find(name);
  if (found != names_.end()) return found->second;
  const auto whole = names_.find(vector_of(name));
  return whole == names_.end() ? Measure{} : whole->second;
}

bool Measures::fits(const Measure& found, const Measure& wanted, SourceRange range, const std::string& what) {
  if (!found.is_known() || !wanted.is_known() || found.unit.is_same_as(wanted.unit)) return true;
  if (!reported_.emplace(range.begin, range.end).second) return false;
  const std::string here = found.unit.text(), there = wanted.unit.text();
  if (found.unit.has_dimension_of(wanted.unit)) {
    const std::string hint =
        fmt::format("1 {} is {:.6g} {}: write both in one unit", here, found.unit.scale() / wanted.unit.scale(), there);
    note_call(elaboration_.sink.report("units-of-other-scale", range, {here, what, there}, hint));
    return false;
  }
  const std::string hint = fmt::format("a factor in {} is missing: write it as a param, with this unit or with none",
                                       wanted.unit.per(found.unit).text());
  note_call(elaboration_.sink.report("units-differ", range, {here, what, there}, hint));
  return false;
}

void Measures::fit(const ast::Expr& e, const MeasureList& wanted, const std::string& what) {
  for (const ast::Expr& term : terms_of(e)) {
    const auto* row = std::get_if<ast::Tuple>(&term->kind);
    if (row != nullptr) {
      for (std::size_t i = 0; i < row->elements.size(); ++i)
        fit(row->elements[i], wanted[std::min(i, wanted.size() - 1)], what);
      continue;
    }
    const MeasureList found = of(term);
    const std::size_t count = std::max(found.size(), wanted.size());
    for (std::size_t i = 0; i < count; ++i) {
      const Measure& there = wanted[std::min(i, wanted.size() - 1)];
      if (!fits(found[std::min(i, found.size() - 1)], there, term.range(), what)) break;
    }
  }
}

/// Checks that terms fit the first one with a unit.
MeasureList Measures::common(const std::vector<ast::Expr>& terms, const std::string& what) {
  std::optional<MeasureList> first;
  bool is_number = true;
  std::string name = what;
  for (const ast::Expr& term : terms) {
    const MeasureList found = of(term);
    const bool is_known = std::ranges::all_of(found, &Measure::is_known);
    is_number = is_number && std::ranges::none_of(found, [](const Measure& m) { return m == Measure{}; });
    for (std::size_t i = 0; first && i < std::max(found.size(), first->size()); ++i) {
      const Measure& there = (*first)[std::min(i, first->size() - 1)];
      if (!fits(found[std::min(i, found.size() - 1)], there, term.range(), name)) return nothing();
    }
    if (first || !is_known) continue;
    first = found;
    if (what.empty()) name = shown(term);
  }
  return first ? *first : MeasureList{Measure{is_number ? Measure::Kind::number : Measure::Kind::unknown}};
}

MeasureList Measures::sum(const ast::Expr& e) { return common(terms_of(e), ""); }

Measure Measures::alike(const MeasureList& list, SourceRange range) {
  const auto known = std::ranges::find_if(list, &Measure::is_known);
  if (known == list.end()) return list.front();
  for (const Measure& other : list) {
    if (!fits(other, *known, range, "another component")) return {};
  }
  return *known;
}

Measure Measures::one(const ast::Expr& e) { return alike(of(e), e.range()); }

Measure Measures::pure(const ast::Expr& e, const std::string& what) {
  const Measure found = one(e);
  if (!found.is_known() || found.unit.is_pure_number()) return found;
  if (reported_.emplace(e.range().begin, e.range().end).second) {
    const std::string unit = found.unit.text();
    const bool is_number = found.unit.has_dimension_of({});  // deg, km/m
    note_call(elaboration_.sink.report("not-a-pure-number", e.range(), {what, unit},
                                       is_number
                                           ? fmt::format("1 {} is {:.6g}: multiply by that", unit, found.unit.scale())
                                           : fmt::format("divide it by something in {}, as x by the length L", unit)));
  }
  return {};
}

MeasureList Measures::product_of(const MeasureList& a, const MeasureList& b, BinaryOp op) {
  MeasureList result;
  for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
    const Measure &left = a[std::min(i, a.size() - 1)], &right = b[std::min(i, b.size() - 1)];
    result.push_back(op == BinaryOp::divide ? quotient(left, right) : product(left, right));
  }
  return result;
}

/// A literal number gives the power; any other exponent requires pure numbers.
MeasureList Measures::raised(const ast::Binary& e) {
  const MeasureList base = of(e.left);
  const auto number = written_number(e.right);
  const auto exponent = number ? fraction_near(*number) : std::nullopt;
  const bool is_pure = pure(e.right, "an exponent").kind == Measure::Kind::number;
  MeasureList result;
  for (const Measure& part : base) {
    const bool is_known = part.is_known() && !part.unit.is_pure_number();
    const bool is_number = part.kind == Measure::Kind::number || (part.is_known() && !is_known && is_pure);
    result.push_back(exponent ? power(part, *exponent) : is_number ? Measure{Measure::Kind::number} : Measure{});
  }
  return result;
}

MeasureList Measures::binary(const ast::Binary& e) {
  if (e.op == BinaryOp::power) return raised(e);
  const bool joins_conditions = e.op == BinaryOp::logical_and || e.op == BinaryOp::logical_or;
  const bool compares = precedence(e.op) < precedence(BinaryOp::add) && !joins_conditions;
  if (compares) common({e.left, e.right}, "");
  if (joins_conditions) {
    of(e.left);
    of(e.right);
  }
  if (compares || joins_conditions) return {{Measure::Kind::number}};
  return product_of(of(e.left), of(e.right), e.op);
}

MeasureList Measures::tuple(const ast::Tuple& e) {
  MeasureList list;
  for (const ast::Expr& element : e.elements) {
    const MeasureList part = of(element);
    list.insert(list.end(), part.begin(), part.end());
  }
  return list;
}

MeasureList Measures::component(const ast::Expr& operand, const std::string& part) {
  const MeasureList whole = of(operand);
  const int axis = axis_of(elaboration_, part);
  if (whole.size() == 1) return whole;
  const bool is_there = axis >= 0 && static_cast<std::size_t>(axis) < whole.size();
  return is_there ? MeasureList{whole[static_cast<std::size_t>(axis)]} : nothing();
}

MeasureList Measures::of_let(const std::string& name) {
  const auto read = read_lets_.find(name);
  if (read != read_lets_.end()) return read->second;
  const ast::LetItem& let = *lets_.at(name);
  if (!open_lets_.insert(name).second) return nothing();
  const Arguments* inside = std::exchange(arguments_, nullptr);
  MeasureList list = of(let.value);
  if (let.unit) {
    const Measure told = measure_of(std::get<Unit>(read_unit(let.unit->name)));
    fit(let.value, told, "let " + name);
    list = {told};
  }
  arguments_ = inside;
  open_lets_.erase(name);
  return read_lets_[name] = list;
}

MeasureList Measures::name(const std::string& name) {
  const std::string base = vector_of(name);
  const auto part_of = [&](const MeasureList& whole) -> MeasureList {
    const int axis = axis_of(elaboration_, name.substr(base.size() + 1));
    if (whole.size() == 1 || axis < 0 || static_cast<std::size_t>(axis) >= whole.size())
      return whole.size() == 1 ? whole : nothing();
    return {whole[static_cast<std::size_t>(axis)]};
  };
  if (arguments_ != nullptr) {
    const auto own = arguments_->find(name), whole = arguments_->find(base);
    if (own != arguments_->end()) return own->second;
    if (whole != arguments_->end()) return part_of(whole->second);
  }
  // A name of the file has precedence.
  const Symbol* meaning = elaboration_.names.scope.find(name);
  if (lets_.contains(name)) return of_let(name);
  if (meaning != nullptr && meaning->declared.is_known()) return {of_name(name)};
  if (name == "pi" || name == "identity") return {{Measure::Kind::number}};
  const bool is_spacing = name.size() == 2 && name[0] == 'h';
  const int axis = axis_of(elaboration_, is_spacing && arguments_ != nullptr ? name.substr(1) : name);
  const bool is_axis = axis >= 0 && static_cast<std::size_t>(axis) < axes_.coordinates.size();
  if (is_axis) return {axes_.coordinates[static_cast<std::size_t>(axis)]};
  if (name == "t" || name == "dt") return {axes_.time};
  if (lets_.contains(base)) return part_of(of_let(base));
  return {of_name(name)};
}

MeasureList Measures::of(const ast::Expr& e) {
  const SourceRange range = e.range();
  return match(
      e->kind, [](const ast::Number& n) { return n.value == 0 ? nothing() : MeasureList{{Measure::Kind::number}}; },
      [](const ast::Text&) { return nothing(); }, [&](const ast::Name& n) { return name(n.name); },
      [&](const ast::Unary& u) {
        return u.op == ast::UnaryOp::magnitude ? MeasureList{one(u.operand)} : of(u.operand);
      },
      [&](const ast::Binary& b) { return is_added(b.op) ? sum(e) : binary(b); },
      [&](const ast::Call& c) { return call(c, range); }, [&](const ast::Tuple& t) { return tuple(t); },
      [&](const ast::Offsets& o) { return name(o.name); },
      [&](const ast::Component& c) { return component(c.operand, c.name.name); },
      [](const ast::Error&) { return nothing(); });
}

Measure Measures::one_with(const ast::Expr& e, const std::vector<std::string>& variables, const MeasureList& ends) {
  Arguments inside = arguments_ == nullptr ? Arguments{} : *arguments_;
  for (const std::string& variable : variables) inside[variable] = ends;
  const Arguments* outside = std::exchange(arguments_, &inside);
  const Measure value = one(e);
  arguments_ = outside;
  return value;
}

void Measures::note_call(Diagnostic& diagnostic) const {
  if (!calls_.empty()) diagnostic.notes.push_back({calls_.front(), "with the units of this call"});
}

/// The body with the units of this call: a term that does not fit is reported inside it.
MeasureList Measures::user_call(const ast::Function& function, const ast::Call& e) {
  constexpr std::size_t deepest = 64;
  if (calls_.size() > deepest) return nothing();
  Arguments arguments;
  for (std::size_t i = 0; i < std::min(function.parameters.size(), e.arguments.size()); ++i)
    arguments.emplace(function.parameters[i].name, of(e.arguments[i].value));
  const Arguments* outer = std::exchange(arguments_, &arguments);
  calls_.push_back(e.callee_range);
  MeasureList list = of(function.body);
  calls_.pop_back();
  arguments_ = outer;
  return list;
}

MeasureList Measures::call(const ast::Call& e, SourceRange range) {
  if (e.arguments.empty()) return nothing();
  if (const auto* function = find_declaration<ast::Function>(elaboration_.file, e.callee))
    return user_call(*function, e);
  const formulas::BuiltIn* known = formulas::find_built_in(e.callee);
  return known == nullptr ? unit_rules::unknown(*this, e, range) : known->unit(*this, e, range);  // else a network
}

}  // namespace dpde::model
