// SPDX-License-Identifier: Apache-2.0
// Tasks that learn from trajectories: data, sample lengths, and the options of `using`.
#include "model/training.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "model/build.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/print/words.h"

namespace dpde::model {

namespace {

constexpr const char* subject = "a task that learns from trajectories";
constexpr double largest = 1e9;
constexpr std::array<std::string_view, 11> option_names{"trials", "batch", "epochs",   "seed",     "unroll",  "cut",
                                                        "noise",  "clip",  "validate", "patience", "schedule"};

void refuse(Elaboration& elaboration, SourceRange range, const std::string& what, const std::string& hint = "") {
  elaboration.sink.report("not-allowed-here", range, {what, subject}, hint);
}

/// trajectories("train.nc", u) with its arguments.
const ast::Call* as_trajectories(const ast::Expr& e) {
  const auto* call = std::get_if<ast::Call>(&e->kind);
  return call && call->callee == "trajectories" ? call : nullptr;
}

/// The file name; "" after a diagnostic.
std::string file_in(Elaboration& elaboration, const ast::Expr& e, std::size_t arguments) {
  const ast::Call* call = as_trajectories(e);
  const auto* file =
      call && call->arguments.size() == arguments ? std::get_if<ast::Text>(&call->arguments[0].value->kind) : nullptr;
  if (file && file->value.ends_with(".nc")) return file->value;
  elaboration.sink.report(
      "bad-data", e.range(), {},
      arguments == 2 ? "write trajectories(\"train.nc\", u), or trajectories(\"train.nc\") for where windows begin"
                     : "write trajectories(\"test.nc\")");
  return "";
}

double at_least(Elaboration& elaboration, const ast::Expr& e, const std::string& option, double least,
                double otherwise) {
  const auto value = evaluate(elaboration, e, option);
  if (!value) return otherwise;
  if (*value >= least && *value <= largest) return *value;
  elaboration.sink.report("bad-optimiser-option", e.range(),
                          {option, "using", fmt::format("must be {} or more, not {}", least, *value)});
  return otherwise;
}

std::int64_t whole(Elaboration& elaboration, const ast::Expr& e, const std::string& option, double least,
                   std::int64_t otherwise, const std::string& of = "using") {
  const auto value = evaluate(elaboration, e, option);
  if (!value) return otherwise;
  if (*value >= least && *value <= largest && *value == std::floor(*value)) return static_cast<std::int64_t>(*value);
  elaboration.sink.report("bad-optimiser-option", e.range(),
                          {option, of, fmt::format("is a whole number from {} on, not {}", least, *value)});
  return otherwise;
}

/// cosine, or halve(1000)
RateSchedule schedule_of(Elaboration& elaboration, const ast::Expr& e) {
  const auto* word = std::get_if<ast::Name>(&e->kind);
  const auto* call = std::get_if<ast::Call>(&e->kind);
  if (word && word->name == "constant") return {};
  if (word && word->name == "cosine") return {RateSchedule::Kind::cosine, 1};
  if (call && call->callee == "halve" && call->arguments.size() == 1) {
    return {RateSchedule::Kind::halve, static_cast<int>(whole(elaboration, call->arguments[0].value, "halve", 1, 1))};
  }
  elaboration.sink.report("bad-optimiser-option", e.range(),
                          {"schedule", "using", "is constant, cosine or halve(updates)"});
  return {};
}

std::vector<int> lengths_of(Elaboration& elaboration, const ast::Expr& e) {
  std::vector<int> lengths;
  const auto* tuple = std::get_if<ast::Tuple>(&e->kind);
  for (const ast::Expr& each : tuple ? tuple->elements : std::vector<ast::Expr>{e})
    lengths.push_back(static_cast<int>(whole(elaboration, each, "unroll", 1, 1)));
  return lengths;
}

void bind_option(Elaboration& elaboration, const ast::Argument& option, Training& training) {
  const ast::Expr& value = option.value;
  if (option.name == "batch") training.batch = static_cast<int>(whole(elaboration, value, option.name, 1, 1));
  if (option.name == "trials") training.trials = static_cast<int>(whole(elaboration, value, option.name, 1, 1));
  if (option.name == "epochs") training.epochs = static_cast<int>(whole(elaboration, value, option.name, 1, 1));
  if (option.name == "seed") training.seed = static_cast<std::uint64_t>(whole(elaboration, value, option.name, 0, 0));
  if (option.name == "unroll") training.unroll = lengths_of(elaboration, value);
  if (option.name == "cut") training.cut = static_cast<int>(whole(elaboration, value, option.name, 1, 0));
  if (option.name == "noise") training.noise = at_least(elaboration, value, option.name, 0, 0);
  if (option.name == "clip") training.clip = at_least(elaboration, value, option.name, 0, 0);
  if (option.name == "patience") training.patience = static_cast<int>(whole(elaboration, value, option.name, 1, 0));
  if (option.name == "schedule") training.schedule = schedule_of(elaboration, value);
  if (option.name != "validate") return;
  training.validate = at_least(elaboration, value, option.name, 0, 0);
  if (training.validate < 1) return;
  elaboration.sink.report(
      "bad-optimiser-option", value.range(),
      {"validate", "using", fmt::format("is a share of the runs, below 1, not {}", training.validate)});
}

/// The number of states that a loss uses, the same for all losses.
int length_of_losses(Elaboration& elaboration) {
  int length = 0;
  for (const Loss& loss : elaboration.problem.task->losses) {
    if (loss.when.kind != When::Kind::steps) {
      refuse(elaboration, loss.origin.range, "a loss that is not over a number of steps",
             "write minimise mean((u - u_ref)^2) over 4 steps, or after 4 steps");
    } else if (length != 0 && loss.when.count != length) {
      refuse(elaboration, loss.origin.range,
             fmt::format("a loss over {} steps together with one over {}", loss.when.count, length));
    } else {
      length = loss.when.count;
    }
  }
  return length;
}

/// The datum with which samples begin has no values; refuses formulas that read it.
void check_unread(Elaboration& elaboration, const Datum& datum) {
  const Task& task = *elaboration.problem.task;
  const auto check = [&](const Expr& value, const Origin& origin) {
    if (reads(value, datum.name))
      elaboration.sink.report("not-allowed-here", origin.range, {datum.name, "a formula"},
                              fmt::format("{0} is where windows begin and has no values: write data r = "
                                          "trajectories(\"{1}\", u) for those of u",
                                          datum.name, datum.file));
  };
  for (const Loss& loss : task.losses) check(loss.value, loss.origin);
  for (const Test& test : task.tests) {
    check(test.quantity.value, test.quantity.origin);
    for (const Expr& field : test.fields) check(field, test.quantity.origin);
  }
}

void check_data(Elaboration& elaboration) {
  const std::vector<Datum>& data = elaboration.problem.task->data;
  const Datum* windows = elaboration.problem.task->datum_of_windows();
  for (const Datum& datum : data) {
    if (!datum.trajectories) {
      refuse(elaboration, datum.origin.range, "data that are no trajectories");
    } else if (datum.file != windows->file && (datum.begins_windows() || !windows->begins_windows())) {
      refuse(elaboration, datum.origin.range,
             fmt::format("a second file of trajectories ({} and {})", windows->file, datum.file),
             fmt::format("one line without a variable says which file windows begin with: data begin = "
                         "trajectories(\"{}\")",
                         windows->file));
    } else if (datum.begins_windows()) {
      check_unread(elaboration, datum);
    }
  }
}

bool is_sought(const Problem& problem, const std::string& name) {
  return std::ranges::find(problem.task->unknowns, name, &Unknown::name) != problem.task->unknowns.end();
}

/// Unknown controls are optimised for each sample separately.
bool seeks_controls(const Problem& problem) {
  const auto is_control = [](const Coefficient& coefficient) { return coefficient.is_control(); };
  return std::ranges::any_of(problem.controls,
                             [&](const Control& control) { return is_sought(problem, control.name); }) ||
         std::ranges::any_of(problem.coefficients, [&](const Coefficient& coefficient) {
           return is_control(coefficient) && is_sought(problem, coefficient.name);
         });
}

/// Then every unknown belongs to one sample, and nothing is learnt across samples.
void check_for_controls(Elaboration& elaboration, const std::vector<Found<ast::UsingItem>>& lines) {
  constexpr const char* such_task = "a task that seeks controls for each window of trajectories";
  const Problem& problem = elaboration.problem;
  const auto refuse_here = [&](SourceRange range, const std::string& what, const std::string& hint) {
    elaboration.sink.report("not-allowed-here", range, {what, such_task}, hint);
  };
  for (const Unknown& unknown : problem.task->unknowns) {
    const Coefficient* coefficient = problem.find_coefficient(unknown.name);
    if (unknown.kind == Unknown::Kind::control || (coefficient != nullptr && coefficient->is_control())) continue;
    refuse_here(unknown.origin.range, fmt::format("unknown {}", unknown.name),
                "a value that all windows share is learnt by a task without unknown controls");
  }
  for (const auto& [item, range] : lines) {
    for (const ast::Argument& option : item.options) {
      if (option.name != "iterations")
        refuse_here(option.name_range, option.name, "understood here: iterations, of each window");
    }
  }
  const std::optional<Optimiser>& optimiser = problem.task->optimiser;
  if (optimiser && (optimiser->momentum > 0 || optimiser->decay > 0))
    refuse_here(lines[0].range, "momentum or decay", "write using lbfgs(), iterations 50");
  for (const std::vector<Test>* tests : {&problem.task->tests, &problem.task->growths}) {
    for (const Test& test : *tests)
      refuse_here(test.quantity.origin.range, "a test",
                  "other trajectories have no controls; a task that learns from the file can have tests");
  }
}

/// Refuses items that do not restart with each sample.
void check_scene(Elaboration& elaboration) {
  const Problem& problem = elaboration.problem;
  for (const Unknown& unknown : problem.task->unknowns) {
    if (unknown.kind == Unknown::Kind::initial)
      refuse(elaboration, unknown.origin.range, "an unknown initial state",
             "each window begins with a state of the data");
  }
  const std::string hint =
      "it counts steps from the begin of the scene, which windows do not begin with; one that is sought has its own "
      "values in each window";
  for (const Control& control : problem.controls) {
    if (!is_sought(problem, control.name))
      refuse(elaboration, control.origin.range, fmt::format("control {}", control.name), hint);
  }
  for (const Coefficient& coefficient : problem.coefficients) {
    if (coefficient.is_control() && !is_sought(problem, coefficient.name))
      refuse(elaboration, coefficient.value.origin.range, fmt::format("control {}", coefficient.name), hint);
  }
  for (const Event& event : problem.events) {
    const bool is_each_step = event.after_step || event.every == 1;
    if (!is_each_step)
      refuse(elaboration, event.origin.range, "an event that is not after each step",
             "it counts steps from the begin of the scene, which windows do not begin with");
  }
}

/// L-BFGS and Newton's method compare losses: loss and gradient must belong to one fixed function.
void check_for_all_windows(Elaboration& elaboration, const ast::UsingItem& item, const std::string& method,
                           const Training& training) {
  constexpr std::array<std::string_view, 6> of_batches{"batch", "seed", "noise", "clip", "cut", "schedule"};
  for (const ast::Argument& option : item.options) {
    const bool grows = option.name == "unroll" && training.unroll.size() > 1;
    if (!grows && std::ranges::find(of_batches, option.name) == of_batches.end()) continue;
    elaboration.sink.report("not-allowed-here", option.name_range,
                            {grows ? "unroll with several lengths" : option.name,
                             fmt::format("a task that learns by {}, whose iterations see all windows at once", method)},
                            "leave it out, or write using adam(rate = 1e-3), batch 4, epochs 20");
  }
}

void check_optimiser(Elaboration& elaboration, const ast::UsingItem& item, const Training& training) {
  if (!elaboration.problem.task->optimiser) return;
  switch (elaboration.problem.task->optimiser->kind) {
    case Optimiser::Kind::adam:
    case Optimiser::Kind::gradient_descent: return;
    case Optimiser::Kind::lbfgs: return check_for_all_windows(elaboration, item, "lbfgs", training);
    case Optimiser::Kind::newton_cg: return check_for_all_windows(elaboration, item, "newton_cg", training);
  }
}

/// Comparison scenes start from the file of the task's own scene, unless they name another.
void bind_beside(Elaboration& elaboration, const ast::TestItem& item, Test& test) {
  std::map<std::string, SourceRange> seen{{elaboration.problem.scene, elaboration.blocks.task->of.range}};
  for (const ast::TestItem::Baseline& beside : item.beside) {
    const auto [first, is_new] = seen.emplace(beside.scene.name, beside.scene.range);
    if (!find_declaration<ast::Scene>(elaboration.file, beside.scene.name)) {
      elaboration.sink.report("unknown-block", beside.scene.range, {"scene", beside.scene.name},
                              did_you_mean(beside.scene.name, names_of<ast::Scene>(elaboration.file)));
    } else if (!is_new) {
      report_duplicate(elaboration, "scene " + beside.scene.name, beside.scene.range, first->second);
    } else {
      test.beside.push_back(
          {beside.scene.name, beside.on ? file_in(elaboration, *beside.on, 1) : test.on, {beside.scene.range}});
    }
  }
}

void check_lengths(Elaboration& elaboration, SourceRange range, const Training& training, int length) {
  if (training.unroll.size() > static_cast<std::size_t>(training.epochs)) {
    elaboration.sink.report("bad-optimiser-option", range,
                            {"unroll", "using",
                             fmt::format("has {} lengths for {} epochs: the last ones would have none",
                                         training.unroll.size(), training.epochs)},
                            fmt::format("write epochs {} or more", training.unroll.size()));
  }
  for (const int each : training.unroll) {
    if (each <= length) continue;
    elaboration.sink.report(
        "bad-optimiser-option", range,
        {"unroll", "using", fmt::format("is at most the {} steps of the loss, not {}", length, each)});
  }
}

}  // namespace

std::vector<std::string> words_of_training() { return {option_names.begin(), option_names.end()}; }

bool is_training_option(const std::string& name) { return std::ranges::find(option_names, name) != option_names.end(); }

bool learns_from_trajectories(const Elaboration& elaboration) {
  if (!elaboration.blocks.task) return false;
  const auto items = items_of<ast::DataItem>(elaboration.blocks.task->items);
  return std::ranges::any_of(items, [](const auto& item) { return as_trajectories(item.kind.value) != nullptr; });
}

namespace {

constexpr const char* variable_hint = "write trajectories(\"train.nc\", u), or of a vector the components, (q.x, q.y)";

bool is_vector_let(const Elaboration& elaboration, const std::string& name) {
  const auto let = elaboration.names.lets.find(name);
  return let != elaboration.names.lets.end() && let->second.type == TypedExpr::Type::vector;
}

/// Variables of the file; for a vector its components. A name that is not a field of the scene counts as a vector if it
/// is given as a tuple, has a placement for vectors, or is a vector let of the model.
std::vector<std::string> variables_of(Elaboration& elaboration, const ast::DataItem& item, const ast::Expr& argument) {
  std::vector<std::string> names;
  const auto* tuple = std::get_if<ast::Tuple>(&argument->kind);
  for (const ast::Expr& e : tuple != nullptr ? tuple->elements : std::vector<ast::Expr>{}) {
    if (!std::get_if<ast::Name>(&e->kind)) return {};
    names.push_back(std::get<ast::Name>(e->kind).name);
  }
  const auto* name = std::get_if<ast::Name>(&argument->kind);
  if (name == nullptr) return names;
  const std::vector<std::string> fields = components_of(elaboration, name->name);
  const bool is_placed_as_vector = item.on && (item.on->name == "faces" || item.on->name == "edges");
  const bool is_vector = is_placed_as_vector || is_vector_let(elaboration, name->name);
  if (!is_vector || elaboration.problem.find_state(fields.front()) != nullptr) return fields;
  for (std::size_t axis = 0; axis < elaboration.problem.axes.size(); ++axis)
    names.push_back(fmt::format("{}.{}", name->name, "xyz"[axis]));
  return names;
}

}  // namespace

std::optional<std::vector<Datum>> data_of_trajectories(Elaboration& elaboration, const ast::DataItem& item) {
  const ast::Call* call = as_trajectories(item.value);
  if (!call) return std::nullopt;
  std::vector<Datum> data;
  const bool begins_windows = call->arguments.size() == 1;
  const std::string file = file_in(elaboration, item.value, begins_windows ? 1 : 2);
  if (file.empty()) return data;
  if (begins_windows) {
    data.emplace_back().file = file;
    data.back().trajectories = true;
    return data;
  }
  const std::vector<std::string> names = variables_of(elaboration, item, call->arguments[1].value);
  const bool is_tuple = std::holds_alternative<ast::Tuple>(call->arguments[1].value->kind);
  if (names.empty() || (is_tuple && names.size() != elaboration.problem.axes.size())) {
    elaboration.sink.report("bad-data", item.value.range(), {}, variable_hint);
    return data;
  }
  for (const std::string& name : names) {
    Datum& datum = data.emplace_back();
    datum.file = file;
    datum.variable = name;
    datum.trajectories = true;
    const State* state = elaboration.problem.find_state(name);
    datum.placement = state && !item.on ? state->placement
                                        : placement_of(elaboration, item.on,
                                                       names.size() > 1 ? static_cast<int>(data.size()) - 1 : -1);
  }
  return data;
}

void bind_test_on(Elaboration& elaboration, const ast::TestItem& item, Test& test) {
  if (!item.on) {
    if (learns_from_trajectories(elaboration))
      refuse(elaboration, test.quantity.origin.range, "a test on the run of the scene",
             "write test e = mean(abs(u - u_ref)) on trajectories(\"test.nc\") for 100 steps");
    return;
  }
  if (!learns_from_trajectories(elaboration)) {
    elaboration.sink.report("not-allowed-here", item.on->range(),
                            {"a set of trajectories", "a task that does not learn from trajectories"});
    return;
  }
  test.on = file_in(elaboration, *item.on, 1);
  test.on_origin = {item.on->range()};
  test.when = {When::Kind::steps, {}, 1};
  if (item.steps) {
    test.when.count =
        static_cast<int>(whole(elaboration, *item.steps, "the number of steps", 1, 1, test.quantity.name));
  } else {
    elaboration.sink.report("bad-data", item.on->range(), {}, "write on trajectories(\"test.nc\") for 100 steps");
  }
  if (elaboration.selection.beside.empty()) bind_beside(elaboration, item, test);
}

void bind_training(Elaboration& elaboration) {
  if (!learns_from_trajectories(elaboration)) return;
  Task& task = *elaboration.problem.task;
  Training& training = task.training.emplace();
  const auto lines = items_of<ast::UsingItem>(elaboration.blocks.task->items);
  const bool by_window = seeks_controls(elaboration.problem);
  for (const auto& [item, range] : lines) {
    for (const ast::Argument& option : item.options) {
      if (option.name == "iterations" && !by_window)
        refuse(elaboration, option.name_range, "iterations", "write epochs 20");
      bind_option(elaboration, option, training);
    }
  }
  const int length = length_of_losses(elaboration);
  check_data(elaboration);
  check_scene(elaboration);
  if (by_window) {
    check_for_controls(elaboration, lines);
  } else if (lines.empty()) {
    refuse(elaboration, elaboration.blocks.task->name.range, "the want of an optimiser",
           "write using adam(rate = 1e-3), batch 4, epochs 20");
  } else {
    check_optimiser(elaboration, lines[0].kind, training);
    check_lengths(elaboration, lines[0].range, training, length);
  }
  for (Datum& datum : task.data) datum.when = {When::Kind::steps, {}, length};
  elaboration.problem.steps = std::max(length, 1);
  bind_controls_of_windows(elaboration);
}

}  // namespace dpde::model
