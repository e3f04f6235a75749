// SPDX-License-Identifier: Apache-2.0
// Tasks that learn from trajectories: their data, the lengths of windows, and what `using` says of batches.
#include "model/training.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "model/build.h"
#include "model/from_ast/formulas/expressions.h"
#include "model/from_ast/parts.h"
#include "model/print/words.h"

namespace dpde::model {

namespace {

constexpr const char* subject = "a task that learns from trajectories";
constexpr double largest = 1e9;
constexpr std::array<std::string_view, 11> option_names{"trials", "batch", "epochs",   "seed",     "unroll",  "cut",
                                                        "noise",  "clip",  "validate", "patience", "schedule"};

void refuse(Draft& draft, SourceRange range, const std::string& what, const std::string& hint = "") {
  draft.sink.report("not-allowed-here", range, {what, subject}, hint);
}

/// trajectories("train.nc", u) with its arguments.
const ast::Call* as_trajectories(const ast::Expr& e) {
  const auto* call = std::get_if<ast::Call>(&e->kind);
  return call && call->callee == "trajectories" ? call : nullptr;
}

/// The name of the file; "" after a diagnostic.
std::string file_in(Draft& draft, const ast::Expr& e, std::size_t arguments) {
  const ast::Call* call = as_trajectories(e);
  const auto* file =
      call && call->arguments.size() == arguments ? std::get_if<ast::Text>(&call->arguments[0].value->kind) : nullptr;
  if (file && file->value.ends_with(".nc")) return file->value;
  draft.sink.report("bad-data", e.range(), {},
                    arguments == 2
                        ? "write trajectories(\"train.nc\", u), or trajectories(\"train.nc\") for where windows begin"
                        : "write trajectories(\"test.nc\")");
  return "";
}

double at_least(Draft& draft, const ast::Expr& e, const std::string& option, double least, double otherwise) {
  const auto value = evaluate(draft, e, option);
  if (!value) return otherwise;
  if (*value >= least && *value <= largest) return *value;
  draft.sink.report("bad-optimiser-option", e.range(),
                    {option, "using", fmt::format("must be {} or more, not {}", least, *value)});
  return otherwise;
}

std::int64_t whole(Draft& draft, const ast::Expr& e, const std::string& option, double least, std::int64_t otherwise,
                   const std::string& of = "using") {
  const auto value = evaluate(draft, e, option);
  if (!value) return otherwise;
  if (*value >= least && *value <= largest && *value == std::floor(*value)) return static_cast<std::int64_t>(*value);
  draft.sink.report("bad-optimiser-option", e.range(),
                    {option, of, fmt::format("is a whole number from {} on, not {}", least, *value)});
  return otherwise;
}

/// cosine, or halve(1000)
RateSchedule schedule_of(Draft& draft, const ast::Expr& e) {
  const auto* word = std::get_if<ast::Name>(&e->kind);
  const auto* call = std::get_if<ast::Call>(&e->kind);
  if (word && word->name == "constant") return {};
  if (word && word->name == "cosine") return {RateSchedule::Kind::cosine, 1};
  if (call && call->callee == "halve" && call->arguments.size() == 1) {
    return {RateSchedule::Kind::halve, static_cast<int>(whole(draft, call->arguments[0].value, "halve", 1, 1))};
  }
  draft.sink.report("bad-optimiser-option", e.range(), {"schedule", "using", "is constant, cosine or halve(updates)"});
  return {};
}

std::vector<int> lengths_of(Draft& draft, const ast::Expr& e) {
  std::vector<int> lengths;
  const auto* tuple = std::get_if<ast::Tuple>(&e->kind);
  for (const ast::Expr& each : tuple ? tuple->elements : std::vector<ast::Expr>{e})
    lengths.push_back(static_cast<int>(whole(draft, each, "unroll", 1, 1)));
  return lengths;
}

void bind_option(Draft& draft, const ast::Argument& option, Training& training) {
  const ast::Expr& value = option.value;
  if (option.name == "batch") training.batch = static_cast<int>(whole(draft, value, option.name, 1, 1));
  if (option.name == "trials") training.trials = static_cast<int>(whole(draft, value, option.name, 1, 1));
  if (option.name == "epochs") training.epochs = static_cast<int>(whole(draft, value, option.name, 1, 1));
  if (option.name == "seed") training.seed = static_cast<std::uint64_t>(whole(draft, value, option.name, 0, 0));
  if (option.name == "unroll") training.unroll = lengths_of(draft, value);
  if (option.name == "cut") training.cut = static_cast<int>(whole(draft, value, option.name, 1, 0));
  if (option.name == "noise") training.noise = at_least(draft, value, option.name, 0, 0);
  if (option.name == "clip") training.clip = at_least(draft, value, option.name, 0, 0);
  if (option.name == "patience") training.patience = static_cast<int>(whole(draft, value, option.name, 1, 0));
  if (option.name == "schedule") training.schedule = schedule_of(draft, value);
  if (option.name != "validate") return;
  training.validate = at_least(draft, value, option.name, 0, 0);
  if (training.validate < 1) return;
  draft.sink.report("bad-optimiser-option", value.range(),
                    {"validate", "using", fmt::format("is a share of the runs, below 1, not {}", training.validate)});
}

/// How many states the losses look at: the same of all.
int length_of_losses(Draft& draft) {
  int length = 0;
  for (const Loss& loss : draft.problem.task->losses) {
    if (loss.when.kind != When::Kind::steps) {
      refuse(draft, loss.origin.range, "a loss that is not over a number of steps",
             "write minimise mean((u - u_ref)^2) over 4 steps, or after 4 steps");
    } else if (length != 0 && loss.when.count != length) {
      refuse(draft, loss.origin.range, fmt::format("a loss over {} steps beside one over {}", loss.when.count, length));
    } else {
      length = loss.when.count;
    }
  }
  return length;
}

/// What windows begin with has no values of its own.
void check_unread(Draft& draft, const Datum& datum) {
  const Task& task = *draft.problem.task;
  const auto check = [&](const Expr& value, const Origin& origin) {
    if (reads(value, datum.name))
      draft.sink.report("not-allowed-here", origin.range, {datum.name, "a formula"},
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

void check_data(Draft& draft) {
  const std::vector<Datum>& data = draft.problem.task->data;
  const Datum* windows = draft.problem.task->datum_of_windows();
  for (const Datum& datum : data) {
    if (!datum.trajectories) {
      refuse(draft, datum.origin.range, "data that are no trajectories");
    } else if (datum.file != windows->file && (datum.begins_windows() || !windows->begins_windows())) {
      refuse(draft, datum.origin.range,
             fmt::format("a second file of trajectories ({} and {})", windows->file, datum.file),
             fmt::format("one line without a variable says which file windows begin with: data begin = "
                         "trajectories(\"{}\")",
                         windows->file));
    } else if (datum.begins_windows()) {
      check_unread(draft, datum);
    }
  }
}

bool is_sought(const Problem& problem, const std::string& name) {
  return std::ranges::find(problem.task->unknowns, name, &Unknown::name) != problem.task->unknowns.end();
}

/// Controls that are sought are found for each window by itself.
bool seeks_controls(const Problem& problem) {
  const auto is_control = [](const Coefficient& coefficient) { return coefficient.is_control(); };
  return std::ranges::any_of(problem.controls,
                             [&](const Control& control) { return is_sought(problem, control.name); }) ||
         std::ranges::any_of(problem.coefficients, [&](const Coefficient& coefficient) {
           return is_control(coefficient) && is_sought(problem, coefficient.name);
         });
}

/// All that is sought is each window's own then, and nothing is learnt from one for another.
void check_for_controls(Draft& draft, const std::vector<Found<ast::UsingItem>>& lines) {
  constexpr const char* such_task = "a task that seeks controls for each window of trajectories";
  const Problem& problem = draft.problem;
  const auto refuse_here = [&](SourceRange range, const std::string& what, const std::string& hint) {
    draft.sink.report("not-allowed-here", range, {what, such_task}, hint);
  };
  for (const Unknown& unknown : problem.task->unknowns) {
    const Coefficient* coefficient = problem.find_coefficient(unknown.name);
    if (unknown.kind == Unknown::Kind::control || (coefficient != nullptr && coefficient->is_control())) continue;
    refuse_here(unknown.origin.range, fmt::format("unknown {}", unknown.name),
                "what all windows share is learnt by a task without unknown controls");
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

/// What does not begin anew with each window.
void check_scene(Draft& draft) {
  const Problem& problem = draft.problem;
  for (const Unknown& unknown : problem.task->unknowns) {
    if (unknown.kind == Unknown::Kind::initial)
      refuse(draft, unknown.origin.range, "an unknown initial state", "each window begins with a state of the data");
  }
  const std::string hint =
      "it counts steps from the begin of the scene, which windows do not begin with; one that is sought has its own "
      "values in each window";
  for (const Control& control : problem.controls) {
    if (!is_sought(problem, control.name))
      refuse(draft, control.origin.range, fmt::format("control {}", control.name), hint);
  }
  for (const Coefficient& coefficient : problem.coefficients) {
    if (coefficient.is_control() && !is_sought(problem, coefficient.name))
      refuse(draft, coefficient.value.origin.range, fmt::format("control {}", coefficient.name), hint);
  }
  for (const Event& event : problem.events) {
    const bool is_each_step = event.after_step || event.every == 1;
    if (!is_each_step)
      refuse(draft, event.origin.range, "an event that is not after each step",
             "it counts steps from the begin of the scene, which windows do not begin with");
  }
}

/// L-BFGS and Newton's method compare losses: they have to be those of one function, and the gradient its own.
void check_for_all_windows(Draft& draft, const ast::UsingItem& item, const std::string& method,
                           const Training& training) {
  constexpr std::array<std::string_view, 6> of_batches{"batch", "seed", "noise", "clip", "cut", "schedule"};
  for (const ast::Argument& option : item.options) {
    const bool grows = option.name == "unroll" && training.unroll.size() > 1;
    if (!grows && std::ranges::find(of_batches, option.name) == of_batches.end()) continue;
    draft.sink.report("not-allowed-here", option.name_range,
                      {grows ? "unroll with several lengths" : option.name,
                       fmt::format("a task that learns by {}, whose iterations see all windows at once", method)},
                      "leave it out, or write using adam(rate = 1e-3), batch 4, epochs 20");
  }
}

void check_optimiser(Draft& draft, const ast::UsingItem& item, const Training& training) {
  if (!draft.problem.task->optimiser) return;
  switch (draft.problem.task->optimiser->kind) {
    case Optimiser::Kind::adam:
    case Optimiser::Kind::gradient_descent: return;
    case Optimiser::Kind::lbfgs: return check_for_all_windows(draft, item, "lbfgs", training);
    case Optimiser::Kind::newton_cg: return check_for_all_windows(draft, item, "newton_cg", training);
  }
}

/// Each from the same file as the task's own scene, unless it has one of its own.
void bind_beside(Draft& draft, const ast::TestItem& item, Test& test) {
  std::map<std::string, SourceRange> seen{{draft.problem.scene, draft.task->of.range}};
  for (const ast::TestItem::Beside& beside : item.beside) {
    const auto [first, is_new] = seen.emplace(beside.scene.name, beside.scene.range);
    if (!find_declaration<ast::Scene>(draft.file, beside.scene.name)) {
      draft.sink.report("unknown-block", beside.scene.range, {"scene", beside.scene.name},
                        did_you_mean(beside.scene.name, names_of<ast::Scene>(draft.file)));
    } else if (!is_new) {
      report_duplicate(draft, "scene " + beside.scene.name, beside.scene.range, first->second);
    } else {
      test.beside.push_back(
          {beside.scene.name, beside.on ? file_in(draft, *beside.on, 1) : test.on, {beside.scene.range}});
    }
  }
}

void check_lengths(Draft& draft, SourceRange range, const Training& training, int length) {
  if (training.unroll.size() > static_cast<std::size_t>(training.epochs)) {
    draft.sink.report("bad-optimiser-option", range,
                      {"unroll", "using",
                       fmt::format("has {} lengths for {} epochs: the last ones would have none",
                                   training.unroll.size(), training.epochs)},
                      fmt::format("write epochs {} or more", training.unroll.size()));
  }
  for (const int each : training.unroll) {
    if (each <= length) continue;
    draft.sink.report("bad-optimiser-option", range,
                      {"unroll", "using", fmt::format("is at most the {} steps of the loss, not {}", length, each)});
  }
}

}  // namespace

std::vector<std::string> words_of_training() { return {option_names.begin(), option_names.end()}; }

bool is_training_option(const std::string& name) { return std::ranges::find(option_names, name) != option_names.end(); }

bool learns_from_trajectories(const Draft& draft) {
  if (!draft.task) return false;
  const auto items = items_of<ast::DataItem>(draft.task->items);
  return std::ranges::any_of(items, [](const auto& item) { return as_trajectories(item.kind.value) != nullptr; });
}

namespace {

constexpr const char* variable_hint = "write trajectories(\"train.nc\", u), or of a vector the components, (q.x, q.y)";

bool is_vector_let(const Draft& draft, const std::string& name) {
  const auto let = draft.lets.find(name);
  return let != draft.lets.end() && let->second.type == Typed::Type::vector;
}

/// What is read of the file: of a vector its components. What is no field of the scene is one where that is said: by a
/// tuple, by a placement that numbers have not, or by a shorthand of the model.
std::vector<std::string> variables_of(Draft& draft, const ast::DataItem& item, const ast::Expr& argument) {
  std::vector<std::string> names;
  const auto* tuple = std::get_if<ast::Tuple>(&argument->kind);
  for (const ast::Expr& e : tuple != nullptr ? tuple->elements : std::vector<ast::Expr>{}) {
    if (!std::get_if<ast::Name>(&e->kind)) return {};
    names.push_back(std::get<ast::Name>(e->kind).name);
  }
  const auto* name = std::get_if<ast::Name>(&argument->kind);
  if (name == nullptr) return names;
  const std::vector<std::string> fields = components_of(draft, name->name);
  const bool is_placed_as_vector = item.on && (item.on->name == "faces" || item.on->name == "edges");
  const bool is_vector = is_placed_as_vector || is_vector_let(draft, name->name);
  if (!is_vector || draft.problem.find_state(fields.front()) != nullptr) return fields;
  for (std::size_t axis = 0; axis < draft.problem.axes.size(); ++axis)
    names.push_back(fmt::format("{}.{}", name->name, "xyz"[axis]));
  return names;
}

}  // namespace

std::optional<std::vector<Datum>> data_of_trajectories(Draft& draft, const ast::DataItem& item) {
  const ast::Call* call = as_trajectories(item.value);
  if (!call) return std::nullopt;
  std::vector<Datum> data;
  const bool begins_windows = call->arguments.size() == 1;
  const std::string file = file_in(draft, item.value, begins_windows ? 1 : 2);
  if (file.empty()) return data;
  if (begins_windows) {
    data.emplace_back().file = file;
    data.back().trajectories = true;
    return data;
  }
  const std::vector<std::string> names = variables_of(draft, item, call->arguments[1].value);
  const bool is_tuple = std::holds_alternative<ast::Tuple>(call->arguments[1].value->kind);
  if (names.empty() || (is_tuple && names.size() != draft.problem.axes.size())) {
    draft.sink.report("bad-data", item.value.range(), {}, variable_hint);
    return data;
  }
  for (const std::string& name : names) {
    Datum& datum = data.emplace_back();
    datum.file = file;
    datum.variable = name;
    datum.trajectories = true;
    const State* state = draft.problem.find_state(name);
    datum.placement = state && !item.on
                          ? state->placement
                          : placement_of(draft, item.on, names.size() > 1 ? static_cast<int>(data.size()) - 1 : -1);
  }
  return data;
}

void bind_test_on(Draft& draft, const ast::TestItem& item, Test& test) {
  if (!item.on) {
    if (learns_from_trajectories(draft))
      refuse(draft, test.quantity.origin.range, "a test on the run of the scene",
             "write test e = mean(abs(u - u_ref)) on trajectories(\"test.nc\") for 100 steps");
    return;
  }
  if (!learns_from_trajectories(draft)) {
    draft.sink.report("not-allowed-here", item.on->range(),
                      {"a set of trajectories", "a task that does not learn from trajectories"});
    return;
  }
  test.on = file_in(draft, *item.on, 1);
  test.on_origin = {item.on->range()};
  test.when = {When::Kind::steps, {}, 1};
  if (item.steps) {
    test.when.count = static_cast<int>(whole(draft, *item.steps, "the number of steps", 1, 1, test.quantity.name));
  } else {
    draft.sink.report("bad-data", item.on->range(), {}, "write on trajectories(\"test.nc\") for 100 steps");
  }
  if (draft.selection.beside.empty()) bind_beside(draft, item, test);
}

void bind_training(Draft& draft) {
  if (!learns_from_trajectories(draft)) return;
  Task& task = *draft.problem.task;
  Training& training = task.training.emplace();
  const auto lines = items_of<ast::UsingItem>(draft.task->items);
  const bool by_window = seeks_controls(draft.problem);
  for (const auto& [item, range] : lines) {
    for (const ast::Argument& option : item.options) {
      if (option.name == "iterations" && !by_window) refuse(draft, option.name_range, "iterations", "write epochs 20");
      bind_option(draft, option, training);
    }
  }
  const int length = length_of_losses(draft);
  check_data(draft);
  check_scene(draft);
  if (by_window) {
    check_for_controls(draft, lines);
  } else if (lines.empty()) {
    refuse(draft, draft.task->name.range, "the want of an optimiser",
           "write using adam(rate = 1e-3), batch 4, epochs 20");
  } else {
    check_optimiser(draft, lines[0].kind, training);
    check_lengths(draft, lines[0].range, training, length);
  }
  for (Datum& datum : task.data) datum.when = {When::Kind::steps, {}, length};
  draft.problem.steps = std::max(length, 1);
  bind_controls_of_windows(draft);
}

}  // namespace dpde::model
