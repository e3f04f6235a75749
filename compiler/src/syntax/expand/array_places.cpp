// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/array_places.h"

#include "support/match.h"

namespace dpde::ast {

namespace {

void add(std::vector<Expr*>& formulas, Expr& e) { formulas.push_back(&e); }
void add(std::vector<Expr*>& formulas, std::optional<Expr>& e) {
  if (e) formulas.push_back(&*e);
}
void add(std::vector<Expr*>& formulas, std::vector<Expr>& all) {
  for (Expr& e : all) formulas.push_back(&e);
}
void add(std::vector<Expr*>& formulas, When& when) {
  if (auto* at = std::get_if<WhenAt>(&when)) add(formulas, at->times);
  if (auto* steps = std::get_if<WhenSteps>(&when)) add(formulas, steps->steps);
}

}  // namespace

Identifier* target_of(Item& item) {
  if (auto* let = get_if<LetItem>(&item.kind)) return &let->name;
  if (auto* equation = get_if<EquationItem>(&item.kind)) return &equation->field;
  if (auto* held = get_if<HeldItem>(&item.kind)) return &held->field;
  if (auto* value = get_if<ValueItem>(&item.kind)) return &value->name;
  if (auto* initial = get_if<InitialItem>(&item.kind)) return &initial->field;
  if (auto* exact = get_if<ExactItem>(&item.kind)) return &exact->field;
  if (auto* boundary = get_if<BoundaryItem>(&item.kind)) return &boundary->field;
  if (auto* unknown = get_if<UnknownItem>(&item.kind)) return &unknown->name;
  if (auto* data = get_if<DataItem>(&item.kind)) return &data->name;
  if (auto* observed = get_if<ObserveItem>(&item.kind)) return &observed->name;
  if (auto* vary = get_if<VaryItem>(&item.kind)) return &vary->name;
  return nullptr;
}

std::vector<Identifier>* list_of(Item& item) {
  if (auto* field = get_if<FieldItem>(&item.kind)) return &field->names;
  if (auto* coefficient = get_if<CoefficientItem>(&item.kind)) return &coefficient->names;
  if (auto* control = get_if<ControlItem>(&item.kind)) return &control->names;
  if (auto* output = get_if<OutputItem>(&item.kind)) return &output->fields;
  if (auto* accuracy = get_if<AccuracyItem>(&item.kind)) return &accuracy->fields;
  if (auto* subcycle = get_if<SubcycleItem>(&item.kind)) return &subcycle->fields;
  return nullptr;
}

std::vector<UnitText>* units_of(Item& item) {
  if (auto* field = get_if<FieldItem>(&item.kind)) return &field->units;
  if (auto* coefficient = get_if<CoefficientItem>(&item.kind)) return &coefficient->units;
  if (auto* control = get_if<ControlItem>(&item.kind)) return &control->units;
  return nullptr;
}

std::vector<Expr*> values_of(Item& item) {
  std::vector<Expr*> found;
  const auto all = [&](auto&... formulas) { (add(found, formulas), ...); };
  if (auto* held = get_if<HeldItem>(&item.kind)) all(held->value);
  if (auto* value = get_if<ValueItem>(&item.kind)) all(value->value);
  if (auto* initial = get_if<InitialItem>(&item.kind)) all(initial->value);
  if (auto* exact = get_if<ExactItem>(&item.kind)) all(exact->value);
  if (auto* unknown = get_if<UnknownItem>(&item.kind)) all(unknown->from);
  if (auto* boundary = get_if<BoundaryItem>(&item.kind)) {
    for (BoundarySide& side : boundary->sides) all(side.value);
  }
  return found;
}

std::vector<Expr*> formulas_of(Item& item) {
  std::vector<Expr*> found;
  const auto all = [&](auto&... formulas) { (add(found, formulas), ...); };
  match_some(
      item.kind, [&](LetItem& i) { all(i.value); }, [&](EquationItem& i) { all(i.rhs); },
      [&](SolvedItem& i) { all(i.left, i.right, i.starts, i.preconditioner); },
      [&](ConstraintItem& i) { all(i.zero, i.value, i.starts, i.preconditioner); }, [&](HeldItem& i) { all(i.value); },
      [&](ValueItem& i) { all(i.value, i.every); }, [&](InitialItem& i) { all(i.value, i.at); },
      [&](ExactItem& i) { all(i.value); },
      [&](BoundaryItem& i) {
        for (BoundarySide& side : i.sides) all(side.value);
      },
      [&](ParamItem& i) {
        for (std::optional<Expr>& value : i.values) all(value);
      },
      [&](GridItem& i) { all(i.low, i.high, i.cells, i.stretched); }, [&](CellsItem& i) { all(i.counts); },
      [&](CoordinatesItem& i) { all(i.kind); }, [&](StepItem& i) { all(i.step); },
      [&](TimeItem& i) { all(i.from, i.to, i.step, i.courant, i.speed, i.tolerance, i.absolute, i.first, i.steady); },
      [&](EventItem& i) {
        all(i.every, i.times);
        for (EventItem::Update& update : i.updates) all(update.value);
      },
      [&](SubcycleItem& i) { all(i.parts); }, [&](OutputItem& i) { all(i.every); },
      [&](AccuracyItem& i) { all(i.tolerance); }, [&](ObserveItem& i) { all(i.value); },
      [&](UnknownItem& i) { all(i.from, i.low, i.high); }, [&](DataItem& i) { all(i.value, i.when); },
      [&](MinimiseItem& i) { all(i.loss, i.when); }, [&](VaryItem& i) { all(i.low, i.high, i.from, i.values); },
      [&](ErrorItem& i) { all(i.norms, i.at); },
      [&](TestItem& i) {
        all(i.value, i.when, i.above, i.steps);
        for (TestItem::Baseline& beside : i.beside) {
          for (NamedFormula& each : beside.map) all(each.value);
        }
      },
      [&](FramesItem& i) {
        all(i.every, i.from, i.to);
        for (NamedFormula& each : i.of) all(each.value);
      });
  return found;
}

void take_part(Expr& value, const std::vector<int>& at) {
  for (const int index : at) {
    const auto* tuple = std::get_if<Tuple>(&value->kind);
    if (tuple != nullptr) value = Expr(tuple->elements[static_cast<std::size_t>(index - 1)]);
  }
}

void put_names(std::vector<NamedFormula>& list,
               const std::function<std::vector<Identifier>(const Identifier& name)>& elements) {
  std::vector<NamedFormula> all;
  for (const NamedFormula& each : list) {
    if (each.value) {
      all.push_back(each);
    } else {
      for (const Identifier& name : elements(each.name)) all.push_back({name, {}, {}});
    }
  }
  list = std::move(all);
}

}  // namespace dpde::ast
