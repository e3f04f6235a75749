// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/formulas/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "support/assert.h"
#include "support/match.h"
#include "support/maths/comparisons.h"
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

bool MeasuredAxes::are_alike() const {
  return std::ranges::all_of(lengths, [&](const Measure& length) { return length == lengths.front(); });
}

Measure MeasuredAxes::volume() const {
  Measure all = around;
  for (const Measure& length : lengths) all = product(all, length);
  return all;
}

MeasureList unit_of_part(const MeasureList& whole, int axis) {
  if (whole.size() <= 1) return whole;
  return axis >= 0 && axis < std::ssize(whole) ? MeasureList{whole[static_cast<std::size_t>(axis)]} : nothing();
}

Measure Measures::of_name(const std::string& name) const {
  const auto found = names_.find(name);
  if (found != names_.end()) return found->second;
  const auto whole = names_.find(vector_of(name));
  return whole == names_.end() ? Measure{} : whole->second;
}

int Measures::axis_called(const std::string& name) const {
  const auto found = axes_.names.find(name);
  return found == axes_.names.end() ? axis_of(name) : found->second;
}

Measure Measures::coordinate(int axis) const {
  const MeasureList& all = axes_.coordinates;
  return axis >= 0 && axis < std::ssize(all) ? all[static_cast<std::size_t>(axis)] : Measure{};
}

MeasureList Measures::of_symbol(const Symbol& meaning, const std::string& name) const {
  switch (meaning.role) {
    case Role::state:
    case Role::coefficient:
    case Role::parameter:
    case Role::datum:
    case Role::let: return {of_name(name)};
    case Role::coordinate: return {coordinate(meaning.axis)};
    case Role::time: return {axes_.time};
    case Role::constant: return {{Measure::Kind::number}};
  }
  unreachable("role");
}

bool Measures::fits(const Measure& found, const Measure& wanted, SourceRange range, const std::string& what) {
  if (!found.is_known() || !wanted.is_known() || found.unit.is_same_as(wanted.unit)) return true;
  if (!reported_.emplace(range.begin, range.end).second) return false;
  const std::string here = found.unit.text(), there = wanted.unit.text();
  if (found.unit.has_dimension_of(wanted.unit)) {
    const std::string hint =
        fmt::format("1 {} is {:.6g} {}: write both in one unit", here, found.unit.scale() / wanted.unit.scale(), there);
    note_call(misfits_.report("units-of-other-scale", range, {here, what, there}, hint));
    return false;
  }
  const std::string hint = fmt::format("a factor in {} is missing: write it as a param, with this unit or with none",
                                       wanted.unit.per(found.unit).text());
  note_call(misfits_.report("units-differ", range, {here, what, there}, hint));
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
  if (!are_told_) return {};
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
    note_call(misfits_.report("not-a-pure-number", e.range(), {what, unit},
                              is_number ? fmt::format("1 {} is {:.6g}: multiply by that", unit, found.unit.scale())
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
  if (!is_comparison(e.op) && !is_logical(e.op)) return product_of(of(e.left), of(e.right), e.op);
  if (is_comparison(e.op)) common({e.left, e.right}, "");
  return {{Measure::Kind::number}};
}

MeasureList Measures::note(const ast::Expr& e, MeasureList given) {
  if (!are_told_) return given;
  const auto unit = match(
      e->kind, [](const ast::Number& n) { return n.value == 0 ? nothing() : MeasureList{{Measure::Kind::number}}; },
      [&](const ast::Binary& b) { return is_added(b.op) ? MeasureList{} : binary(b); },
      [&](const ast::Unary& u) {
        return u.op == ast::UnaryOp::magnitude ? MeasureList{one(u.operand)} : MeasureList{};
      },
      [&](const ast::Component& c) { return unit_of_part(of(c.operand), axis_called(c.name.name)); },
      [&](const OneOf<ast::Text, ast::Name, ast::Call, ast::Tuple, ast::Offsets, ast::Error> auto&) {
        return std::move(given);
      });
  return noted_.insert_or_assign(&e.node(), std::pair(e, unit)).first->second.second;
}

MeasureList Measures::define(const std::string& name, const ast::Expr& formula) {
  MeasureList unit = of(formula);
  if (knows(name)) {
    unit = {of_name(name)};
    fit(formula, unit, "let " + name);
  }
  return lets_[name] = unit;
}

MeasureList Measures::of_let(const std::string& name) const {
  const auto found = lets_.find(name);
  return found == lets_.end() ? MeasureList{of_name(name)} : found->second;
}

MeasureList Measures::leave_call(const ast::Expr& body) {
  MeasureList unit = of(body);
  calls_.pop_back();
  return unit;
}

/// Sums and lists are made of what is noted.
MeasureList Measures::of(const ast::Expr& e) {
  if (!are_told_) return {};
  if (const auto* u = std::get_if<ast::Unary>(&e->kind); u != nullptr && u->op != ast::UnaryOp::magnitude)
    return of(u->operand);
  if (const auto* b = std::get_if<ast::Binary>(&e->kind); b != nullptr && is_added(b->op))
    return common(terms_of(e), "");
  if (const auto* t = std::get_if<ast::Tuple>(&e->kind)) {
    MeasureList list;
    for (const ast::Expr& element : t->elements) {
      const MeasureList part = of(element);
      list.insert(list.end(), part.begin(), part.end());
    }
    return list;
  }
  const auto noted = noted_.find(&e.node());
  return noted == noted_.end() || noted->second.second.empty() ? nothing() : noted->second.second;
}

void Measures::note_call(Diagnostic& diagnostic) const {
  if (!calls_.empty()) diagnostic.notes.push_back({calls_.front(), "with the units of this call"});
}

}  // namespace dpde::model
