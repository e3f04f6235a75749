// SPDX-License-Identifier: Apache-2.0
// Units declared in a model, its scene and its task, and what each line wants of its formulas: compared when all are
// elaborated. Records units for pictures and files.
#include <fmt/format.h>

#include <algorithm>

#include "model/from_ast/formulas/measures.h"
#include "model/from_ast/parts.h"
#include "support/match.h"
#include "support/side_conditions.h"
#include "syntax/item_kinds.h"

namespace dpde::model {

namespace {

Measure told_by(const ast::UnitText& unit) {
  return unit ? measure_of(std::get<Unit>(read_unit(unit->name))) : Measure{};
}

/// The lines of a model, its scene and its task.
class UnitLines {
 public:
  explicit UnitLines(Elaboration& elaboration) : elaboration_(elaboration), measures_(elaboration.measures) {}

  void read_names() {
    for (const ast::Model* model : models()) {
      for (const ast::Item& item : model->items) declare(item);
    }
    for (const ast::Item& item : elaboration_.blocks.scene->items) declare(item);
    if (elaboration_.blocks.task == nullptr) return;
    for (const ast::Item& item : elaboration_.blocks.task->items) declare(item);
  }

  /// Angles are pure numbers, with or without a declared unit.
  void measure_axes() {
    MeasuredAxes axes{elaboration_.names.axis_names};
    for (const auto& [item, range] : items_of<ast::TimeItem>(elaboration_.blocks.scene->items))
      axes.time = told_by(item.unit);
    axes.coordinates.resize(elaboration_.problem.axes.size());
    const auto tell_axis = [&](int axis, const Measure& measure) {
      if (axis < std::ssize(axes.coordinates)) axes.coordinates[static_cast<std::size_t>(axis)] = measure;
    };
    for (const auto& [name, axis] : elaboration_.names.axis_names) {
      if (name == "theta" || name == "lon" || name == "lat") tell_axis(axis, {Measure::Kind::number});
    }
    for (const auto& [item, range] : items_of<ast::GridItem>(elaboration_.blocks.scene->items)) {
      if (item.unit) tell_axis(axis_of(elaboration_, item.axis.name), told_by(item.unit));
    }
    axes.lengths = axes.coordinates;
    measures_.set_axes(axes);
    for (const auto& [item, range] : items_of<ast::CoordinatesItem>(elaboration_.blocks.scene->items))
      stretch(axes, item);
    measures_.set_axes(std::move(axes));
  }

  void read_data() {
    if (elaboration_.blocks.task == nullptr) return;
    for (const auto& [item, range] : items_of<ast::DataItem>(elaboration_.blocks.task->items)) tell_data(item);
  }

  void compare() {
    for (const auto& [item, range] : items_of<ast::ObserveItem>(elaboration_.blocks.scene->items))
      observed_[item.name.name] = item.unit ? told_by(item.unit) : measures_.of(item.value).front();
    if (elaboration_.blocks.model != nullptr) {
      for (const ast::Item& item : elaboration_.blocks.model->items) check_model(item);
    }
    for (const ast::Item& item : elaboration_.blocks.scene->items) check_scene(item);
    for (const ast::NamedFormula& each : elaboration_.selection.shown) {
      if (each.value) shown_[each.name.name] = measures_.of(*each.value);
    }
    if (elaboration_.blocks.task == nullptr) return;
    for (const ast::Item& item : elaboration_.blocks.task->items) check_task(item);
  }

  /// Stores the units in the problem, by the names in files and pictures.
  void keep() {
    Problem& problem = elaboration_.problem;
    const auto note = [&](const std::string& name, const Measure& measure) {
      if (measure.is_known()) problem.remarks.units[name] = measure.unit.text();
    };
    for (const State& state : problem.states) {
      const bool is_rate = !state.velocity_of.empty();
      const Measure moved = measures_.of_name(is_rate ? state.velocity_of : state.name);
      if (state.history_of.empty()) note(state.name, is_rate ? quotient(moved, measures_.axes().time) : moved);
    }
    for (const Coefficient& coefficient : problem.coefficients)
      note(coefficient.name, measures_.of_name(coefficient.name));
    for (const Parameter& parameter : problem.params) note(parameter.name, measures_.of_name(parameter.name));
    for (const Quantity& quantity : problem.observables) {
      if (observed_.contains(quantity.name)) note(quantity.name, observed_.at(quantity.name));
    }
    for (std::size_t a = 0; a < problem.axes.size(); ++a) note(problem.axes[a].name, measures_.axes().coordinates[a]);
    note("t", measures_.axes().time);
    for (const auto& [name, list] : measures_.lets()) {
      if (list.size() == 1) note(name, list.front());
      for (std::size_t i = 0; list.size() > 1 && i < std::min(list.size(), problem.axes.size()); ++i)
        note(fmt::format("{}.{}", name, "xyz"[i]), list[i]);
    }
    for (const OutputField& shown : problem.shown) {
      const std::string name = shown.name.substr(0, shown.name.find('.'));
      const auto formula = shown_.find(name);
      const MeasureList list = formula == shown_.end() ? measures_.of_let(name) : formula->second;
      const bool is_let = formula == shown_.end(), is_part = name != shown.name;
      const bool has_parts = list.size() > 1 && list.size() == problem.axes.size() && is_part;
      if (list.size() == 1 && (is_part || !is_let)) note(shown.name, list.front());
      if (!is_let && has_parts) note(shown.name, list[std::string_view("xyz").find(shown.name.back())]);
    }
    for (const std::string& name : elaboration_.solves.solved) note(name, measures_.of_name(name));
    if (!problem.task) return;
    for (const Datum& datum : problem.task->data) note(datum.name, measures_.of_name(datum.name));
  }

 private:
  /// As written in the text: in a coupled model, a coefficient that is a field of another one has no line left.
  /// Programs have none.
  std::vector<const ast::Model*> models() const {
    std::vector<const ast::Model*> all{
        find_declaration<ast::Model>(elaboration_.file, elaboration_.blocks.scene->of.name)};
    for (const ast::Identifier& name : elaboration_.blocks.scene->also)
      all.push_back(find_declaration<ast::Model>(elaboration_.file, name.name));
    std::erase(all, nullptr);
    return all;
  }

  void be_told_by(const ast::UnitText& unit) {
    if (unit) measures_.be_told(true);
  }
  void tell(const ast::Identifier& name, const ast::UnitText& unit) {
    if (!unit) return;
    be_told_by(unit);
    if (measures_.knows(name.name))
      measures_.fits(told_by(unit), measures_.of_name(name.name), unit->range, name.name);
    else
      measures_.tell(name.name, told_by(unit));
  }
  void tell_all(const std::vector<ast::Identifier>& names, const std::vector<ast::UnitText>& units) {
    for (std::size_t i = 0; i < names.size(); ++i) tell(names[i], units[i]);
  }

  void declare(const ast::Item& item) {
    match_some(
        item.kind, [&](const ast::FieldItem& i) { tell_all(i.names, i.units); },
        [&](const ast::CoefficientItem& i) { tell_all(i.names, i.units); },
        [&](const ast::ControlItem& i) { tell_all(i.names, i.units); },
        [&](const ast::ParamItem& i) { tell_all(i.names, i.units); },
        [&](const ast::SolvedItem& i) { tell(i.unknown, i.unit); },
        [&](const OneOf<ast::GridItem, ast::TimeItem, ast::ObserveItem, ast::DataItem> auto& i) { be_told_by(i.unit); },
        [&](const ast::ValueItem& i) { tell(i.name, i.unit); }, [&](const ast::LetItem& i) { tell(i.name, i.unit); });
  }

  /// In curvilinear coordinates a length has the unit of the coordinate times that of its scale; an angle counts as a
  /// number.
  void stretch(MeasuredAxes& axes, const ast::CoordinatesItem& item) {
    for (Measure& length : axes.lengths) {
      if (length.is_known() && length.unit.is_pure_number()) length = {Measure::Kind::number};
    }
    const auto* call = std::get_if<ast::Call>(&item.kind->kind);
    const auto* name = std::get_if<ast::Name>(&item.kind->kind);
    if (name != nullptr && name->name == "cylinder") axes.around = axes.coordinates[0];
    if (name != nullptr && name->name == "polar" && axes.lengths.size() > 1)
      axes.lengths[1] = product(axes.lengths[1], axes.coordinates[0]);
    for (std::size_t a = 0; call != nullptr && !call->arguments.empty() && a < axes.lengths.size(); ++a) {
      const std::size_t of = std::min(a, call->arguments.size() - 1);
      axes.lengths[a] = product(axes.lengths[a], measures_.one(call->arguments[of].value));
      // An angle times a literal number, whose unit is not declared: the length's unit is unknown.
      if (axes.lengths[a].kind == Measure::Kind::number) axes.lengths[a] = {};
    }
  }

  /// A datum of a scene has the unit of the field or observable there, if both have the same model. Times and positions
  /// are compared with those of this scene.
  void tell_data(const ast::DataItem& item) {
    Measure measure = told_by(item.unit);
    const auto* name = std::get_if<ast::Name>(&item.value->kind);
    const auto* other = item.scene ? find_declaration<ast::Scene>(elaboration_.file, item.scene->name) : nullptr;
    const bool is_alike = other != nullptr && other->of.name == elaboration_.blocks.scene->of.name && name != nullptr;
    if (!item.unit && is_alike) measure = measure_in(*other, name->name);
    measures_.tell(item.name.name, measure);
    if (other != nullptr) compare(*other, item.scene->range);
  }

  Measure measure_in(const ast::Scene& other, const std::string& name) {
    for (const auto& [item, range] : items_of<ast::ObserveItem>(other.items)) {
      if (item.name.name != name) continue;
      if (item.unit) return told_by(item.unit);
      DiagnosticSink ignored;  // its own errors are reported where it runs
      const auto problem = from_ast(elaboration_.file, {other.name.name, {}, ""}, ignored);
      const std::string unit = problem ? problem->unit_of(name) : "";
      return unit.empty() ? Measure{} : measure_of(std::get<Unit>(read_unit(unit)));
    }
    return measures_.of_name(name);
  }

  void compare(const ast::Scene& other, SourceRange range) {
    for (const auto& [item, where] : items_of<ast::TimeItem>(other.items))
      measures_.fits(told_by(item.unit), measures_.axes().time, range, "the time of this scene");
    for (const auto& [item, where] : items_of<ast::ValueItem>(other.items)) {
      if (item.unit && other.of.name == elaboration_.blocks.scene->of.name)
        measures_.fits(told_by(item.unit), measures_.of_name(item.name.name), item.unit->range, item.name.name);
    }
    for (const auto& [item, where] : items_of<ast::GridItem>(other.items)) {
      const int axis = axis_of(elaboration_, item.axis.name);
      if (axis < 0 || static_cast<std::size_t>(axis) >= measures_.axes().coordinates.size()) continue;
      measures_.fits(told_by(item.unit), measures_.axes().coordinates[static_cast<std::size_t>(axis)], range,
                     "axis " + item.axis.name + " of this scene");
    }
  }

  /// "u" or "dt(u)"
  Measure measure_of_state(const std::string& written) const {
    const std::string rated = rated_field(written);
    return rated.empty() ? measures_.of_name(written) : quotient(measures_.of_name(rated), measures_.axes().time);
  }
  void fit_time(const std::optional<ast::Expr>& e, const std::string& what) {
    if (e) measures_.fit(*e, measures_.axes().time, what);
  }

  void check_model(const ast::Item& item) {
    match_some(
        item.kind,
        [&](const ast::ParamItem& i) {
          for (std::size_t n = 0; n < i.names.size(); ++n) {
            const std::string& name = i.names[n].name;
            if (i.values[n]) measures_.fit(*i.values[n], measures_.of_name(name), name);
          }
        },
        [&](const ast::EquationItem& i) {
          const Measure rate = quotient(measure_of_state(i.field.name), measures_.axes().time);
          measures_.fit(i.rhs, rate, fmt::format("dt({})", i.field.name));
        },
        [&](const ast::SolvedItem& i) {
          measures_.fit(i.right, measures_.one(i.left), "the left side");
          for (const ast::Expr& start : i.starts) {
            if (i.iterations) {
              measures_.fit(start, measures_.of_let(i.unknown.name), i.unknown.name);
            } else {
              measures_.one(start);  // any unit: only multiples of it are used
            }
          }
          look_beside(i.preconditioner);
        },
        [&](const ast::ConstraintItem& i) {
          measures_.fit(i.value, measures_.one(i.zero), "the left side");
          for (const ast::Expr& start : i.starts) measures_.one(start);
          look_beside(i.preconditioner);
        },
        [&](const ast::HeldItem& i) { fit_state(i.value, i.field.name); });
  }

  /// Inputs of a preconditioner other than the residual. Its output is a direction, of any unit.
  void look_beside(const std::optional<ast::Expr>& preconditioner) {
    const auto* call = preconditioner ? std::get_if<ast::Call>(&(*preconditioner)->kind) : nullptr;
    for (std::size_t i = 1; call != nullptr && i < call->arguments.size(); ++i) measures_.one(call->arguments[i].value);
  }

  void fit_state(const ast::Expr& value, const std::string& field) {
    measures_.fit(value, measure_of_state(field), field);
  }

  void check_scene(const ast::Item& item) {
    match_some(
        item.kind, [&](const ast::GridItem& i) { check_grid(i); },
        [&](const ast::ValueItem& i) {
          measures_.fit(i.value, measures_.of_name(i.name.name), i.name.name);
          fit_time(i.every, "the time");
        },
        [&](const ast::InitialItem& i) { fit_state(i.value, i.field.name); },
        [&](const ast::ExactItem& i) { fit_state(i.value, i.field.name); },
        [&](const ast::BoundaryItem& i) {
          for (const ast::BoundarySide& side : i.sides) check_side(i.field.name, side);
        },
        [&](const ast::TimeItem& i) { check_time(i); }, [&](const ast::StepItem& i) { fit_time(i.step, "the time"); },
        [&](const ast::EventItem& i) { check_event(i); },
        [&](const ast::ObserveItem& i) { measures_.fit(i.value, observed_.at(i.name.name), i.name.name); },
        [&](const ast::OutputItem& i) { fit_time(i.every, "the time"); });
  }

  void check_grid(const ast::GridItem& item) {
    const Measure& along =
        measures_.axes().coordinates[static_cast<std::size_t>(axis_of(elaboration_, item.axis.name))];
    const std::string what = "axis " + item.axis.name;
    measures_.fit(item.low, along, what);
    measures_.fit(item.high, along, what);
    if (item.stretched) measures_.fit(*item.stretched, along, what);
  }

  void check_time(const ast::TimeItem& item) {
    for (const auto& e : {std::optional(item.from), std::optional(item.to), item.step, item.first})
      fit_time(e, "the time");
    const MeasuredAxes& axes = measures_.axes();
    if (item.speed && axes.are_alike() && !axes.lengths.empty())
      measures_.fit(*item.speed, quotient(axes.lengths.front(), axes.time), "a speed");
  }

  void check_event(const ast::EventItem& item) {
    fit_time(item.every, "the time");
    for (const ast::Expr& time : item.times) fit_time(time, "the time");
    for (const ast::EventItem::Update& update : item.updates) fit_state(update.value, update.field.name);
  }

  /// The arguments of a condition: WORD(a, b, c) of a*u + b*du/dn = c, radiating(speed), or a value.
  void check_side(const std::string& field, const ast::BoundarySide& side) {
    const auto* word = std::get_if<ast::Name>(&side.value->kind);
    if (word != nullptr && is_side_word(word->name)) return;
    const MeasuredAxes& axes = measures_.axes();
    const int axis = axis_of(elaboration_, side.place.name.substr(0, side.place.name.find('.')));
    const Measure across = axis >= 0                                   ? axes.lengths.at(static_cast<std::size_t>(axis))
                           : axes.are_alike() && !axes.lengths.empty() ? axes.lengths.front()
                                                                       : Measure{};
    const Measure own = measure_of_state(field), slope = quotient(own, across);
    const auto* call = std::get_if<ast::Call>(&side.value->kind);
    const SideCondition* condition =
        call != nullptr ? find_condition(call->callee, SideCondition::Level::models) : nullptr;
    if (condition == nullptr) return measures_.fit(side.value, own, field);
    if (condition->takes_rate())
      measures_.fit(call->arguments[0].value, quotient(across, axes.time), "a speed");
    else if (condition->gives_slope())
      measures_.fit(call->arguments[0].value, slope, fmt::format("the slope of {}", field));
    else if (call->arguments.size() == 3)
      check_mixed(*call, own, slope);
  }

  void check_mixed(const ast::Call& call, const Measure& own, const Measure& slope) {
    const Measure value_term = product(measures_.one(call.arguments[0].value), own);
    const Measure slope_term = product(measures_.one(call.arguments[1].value), slope);
    measures_.fits(slope_term, value_term, call.arguments[1].value.range(), "a*u, of a*u + b*du/dn = c,");
    measures_.fit(call.arguments[2].value, value_term.is_known() ? value_term : slope_term,
                  "the left side of a*u + b*du/dn = c");
  }

  void check_task(const ast::Item& item) {
    match_some(
        item.kind,
        [&](const ast::UnknownItem& i) {
          for (const auto& e : {i.from, i.low, i.high}) {
            if (e) fit_state(*e, i.name.name);
          }
        },
        [&](const ast::MinimiseItem& i) {
          measures_.of(i.loss);
          check_when(i.when);
        },
        [&](const ast::TestItem& i) {
          if (i.kind != ast::TestItem::Kind::growth) measures_.of(i.value);
          check_when(i.when);
        },
        [&](const ast::DataItem& i) { check_when(i.when); });
  }

  void check_when(const ast::When& when) {
    if (const auto* at = std::get_if<ast::WhenAt>(&when)) {
      for (const ast::Expr& time : at->times) fit_time(time, "the time");
    }
  }

  Elaboration& elaboration_;
  Measures& measures_;
  std::map<std::string, Measure> observed_;
  std::map<std::string, MeasureList> shown_;  // formulas of Selection::shown
};

}  // namespace

void declare_units(Elaboration& elaboration) { UnitLines(elaboration).read_names(); }

void measure_axes(Elaboration& elaboration) {
  if (elaboration.measures.are_told()) UnitLines(elaboration).measure_axes();
}

void measure_data(Elaboration& elaboration) {
  if (elaboration.measures.are_told()) UnitLines(elaboration).read_data();
}

void check_units(Elaboration& elaboration) {
  if (!elaboration.measures.are_told() || elaboration.sink.has_errors()) return;
  UnitLines lines(elaboration);
  lines.compare();
  for (const Diagnostic& misfit : elaboration.measures.misfits()) elaboration.sink.add(misfit);
  lines.keep();
}

}  // namespace dpde::model
