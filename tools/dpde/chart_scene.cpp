// SPDX-License-Identifier: Apache-2.0
#include "chart_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <numeric>
#include <type_traits>

#include "chart/common_steps.h"
#include "chart/finer_runs.h"
#include "interrupt.h"
#include "model/from_ast/names/names.h"
#include "model/from_ast/parts.h"
#include "preparing.h"
#include "scene_session.h"
#include "support/contains.h"
#include "syntax/parser.h"

namespace dpde::tools {

namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

/// A number written as 0.03125 or 1/32; 0 if it is neither.
template <class Number>
Number number_from(std::string_view text) {
  const auto read = [](std::string_view part) {
    Number value{};
    const auto [stop, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && stop == part.data() + part.size() ? value : Number{};
  };
  const std::size_t slash = std::is_integral_v<Number> ? std::string_view::npos : text.find('/');
  if (slash == std::string_view::npos) return read(text);
  const Number bottom = read(text.substr(slash + 1));
  return bottom > 0 ? read(text.substr(0, slash)) / bottom : Number{};
}

/// Returns the first text that is not a number above 0; "": all are.
template <class Number>
std::string read_numbers(const std::vector<std::string>& texts, std::vector<Number>& numbers) {
  for (const std::string& text : texts) {
    const Number value = number_from<Number>(text);
    if (!(value > 0)) return text;
    numbers.push_back(value);
  }
  return "";
}

std::optional<chart::Wishes> refuse(const std::string& text, const std::string& why, const std::string& hint,
                                    DiagnosticSink& sink) {
  sink.report("bad-option", {}, {fmt::format("--vary {}{}", text, why)}, hint);
  return std::nullopt;
}

/// Adds the numbers or methods of a key; returns the first invalid number.
std::string add_choices(const std::string& key, const std::vector<std::string>& values, chart::Wishes& wishes) {
  if (key == "cells") return read_numbers(values, wishes.cells = {});
  if (key == "step") return read_numbers(values, wishes.steps = {});
  if (key == "fraction") return read_numbers(values, wishes.fractions = {});
  wishes.method[key] = values;
  return "";
}

chart::Wishes wishes_of(const model::Chart& block) {
  chart::Wishes wishes;
  for (const model::Chart::Choices& choices : block.vary) add_choices(choices.key, choices.values, wishes);
  return wishes;
}

/// Each KEY=V1,V2,... replaces the key's values in `wishes`; nullopt after a diagnostic.
std::optional<chart::Wishes> with_options(chart::Wishes wishes, const std::vector<std::string>& vary,
                                          const std::vector<std::string>& schemes, DiagnosticSink& sink) {
  for (const std::string& text : vary) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const std::vector<std::string> values = split(equals == std::string::npos ? "" : text.substr(equals + 1));
    const bool is_list = equals != std::string::npos && equals > 0 &&
                         std::ranges::none_of(values, [](const std::string& v) { return v.empty(); });
    const bool is_number = key == "cells" || key == "step" || key == "fraction";
    if (is_list && !is_number && key != chart::scheme_block && !contains(model::scheme_keys(), key))
      return refuse(text, fmt::format(": {} is no key of a scheme", key),
                    fmt::format("scheme, cells, step, fraction, or one of: {}", fmt::join(model::scheme_keys(), ", ")),
                    sink);
    const std::string example = "as in --vary advect=central2,upwind3 --vary cells=32,64,128 --vary step=0.01,0.005";
    if (!is_list) return refuse(text, " is no list of values", example, sink);
    const std::string wrong = add_choices(key, values, wishes);
    if (!wrong.empty())
      return refuse(text, fmt::format(": {} is no {} above 0", wrong, key == "cells" ? "whole number" : "number"),
                    example, sink);
    for (const std::string& value : values) {
      if (key == chart::scheme_block && !contains(schemes, value))
        return refuse(text, fmt::format(": there is no scheme {}", value), model::did_you_mean(value, schemes), sink);
    }
  }
  return wishes;
}

/// The named chart; without a name the only chart of the file itself; "": none. Several are an error.
std::string chart_name(const ast::File& file, const std::string& name, DiagnosticSink& sink) {
  if (!name.empty()) return contains(model::chart_names(file), name) ? name : "";
  ast::File own = file;
  std::erase_if(own.declarations, [](const ast::Declaration& declaration) { return declaration.imported; });
  const std::vector<std::string> names = model::chart_names(own);
  if (names.size() > 1)
    sink.report("choose-one", {}, {"charts"}, fmt::format("name one, or a scene: {}", fmt::join(names, ", ")));
  return names.size() == 1 ? names.front() : "";
}

/// False after a diagnostic.
bool read_block(Job& job, const ChartWishes& wishes, ChartScene& scene) {
  DiagnosticSink unread;  // reported when the scene is compiled
  const ast::File file = ast::parse(job.source(), unread);
  const std::string name = chart_name(file, job.options().name, job.sink());
  if (job.failed()) return false;
  if (!name.empty()) {
    scene.block = model::chart_from_ast(file, name, job.sink());
    if (!scene.block) return false;
    scene.wishes = wishes_of(*scene.block);
    scene.reference_cells = scene.block->reference_cells;
  }
  if (wishes.reference_cells > 0) scene.reference_cells = wishes.reference_cells;
  const auto all = with_options(scene.wishes, wishes.vary, model::scheme_names(file), job.sink());
  if (all) scene.wishes = *all;
  return all.has_value();
}

/// Finds the task whose gradient is compared: from the option, the block, or the command's name. False after a
/// diagnostic.
bool find_task(Job& job, const ChartWishes& wishes, ChartScene& scene) {
  DiagnosticSink unread;
  const std::vector<std::string> tasks = model::task_names(ast::parse(job.source(), unread));
  if (!wishes.task.empty()) {
    scene.options.task = wishes.task;
    if (contains(tasks, wishes.task)) return true;
    job.sink().report("unknown-block", {}, {"task", wishes.task}, model::did_you_mean(wishes.task, tasks));
    return false;
  }
  if (scene.block) scene.options.task = scene.block->gradient;
  if (!scene.block && contains(tasks, job.options().name)) scene.options.task = job.options().name;
  return true;
}

/// Finds a number of steps that divides all times of the scene, and of the task, if there is one. False after a
/// diagnostic.
bool find_common_steps(Job& job, ChartScene& scene) {
  scene.options.common_steps = chart::common_steps(scene.session->problem());
  if (scene.options.task.empty()) return true;
  driver::CompileOptions compile = scene.options.compile;
  compile.selection.name = scene.options.task;
  compile.without_task = false;
  compile.backend.reset();
  DiagnosticSink unread;  // its warnings repeat those of the scene
  const std::optional<driver::Compiled> task = driver::compile(job.source(), compile, unread);
  if (task && task->problem)
    scene.options.common_steps = std::gcd(scene.options.common_steps, chart::common_steps(*task->problem));
  return task || driver::compile(job.source(), compile, job.sink());
}

/// Parses l2(u); nullopt for other texts.
std::optional<model::Chart::Error> error_from(const std::string& text) {
  const std::size_t open = text.find('(');
  if (open == std::string::npos || !text.ends_with(")")) return std::nullopt;
  for (const model::ErrorNorm norm : {model::ErrorNorm::l1, model::ErrorNorm::l2, model::ErrorNorm::linf}) {
    if (text.substr(0, open) == model::name_of(norm))
      return model::Chart::Error{text.substr(open + 1, text.size() - open - 2), norm, {}};
  }
  return std::nullopt;
}

/// Reads the error measures, for states of the scene, from the options or the block.
void find_measures(Job& job, const ChartWishes& wishes, ChartScene& scene) {
  std::vector<model::Chart::Error> errors;
  if (scene.block) errors = scene.block->errors;
  if (!wishes.errors.empty()) errors.clear();
  for (const std::string& text : wishes.errors) {
    const std::optional<model::Chart::Error> error = error_from(text);
    if (error) errors.push_back(*error);
    if (!error)
      job.sink().report("bad-option", {}, {fmt::format("--error {} is no norm of a field", text)},
                        "l1(u), l2(u) or linf(u)");
  }
  std::vector<std::string> names;
  for (const model::State& state : scene.session->problem().states) {
    if (state.history_of.empty()) names.push_back(state.name);
  }
  for (const model::Chart::Error& error : errors) {
    const std::size_t before = scene.options.measures.size();
    for (const std::string& name : names) {
      if (name == error.field || name.starts_with(error.field + "."))
        scene.options.measures.push_back({name, error.norm});
    }
    if (scene.options.measures.size() == before)
      job.sink().report("unknown-name", error.range, {error.field}, model::did_you_mean(error.field, names));
  }
}

/// Whether everything that is measured has an exact solution; without measures, whether anything has one.
bool has_exact(const ChartScene& scene) {
  const model::Problem& problem = scene.session->problem();
  const auto is_exact = [](const model::State& state) { return state.exact.has_value(); };
  if (scene.options.measures.empty()) return std::ranges::any_of(problem.states, is_exact);
  return std::ranges::all_of(scene.options.measures,
                             [&](const chart::Measure& m) { return is_exact(*problem.find_state(m.state)); });
}

}  // namespace

void add_chart_options(CLI::App& verb, ChartWishes& wishes, const std::string& which_timing) {
  verb.add_option("--vary", wishes.vary,
                  "values of a key of --set; also cells, step, scheme: blocks of the file, and fraction: parts of the "
                  "largest stable step")
      ->type_name("KEY=V1,V2,...")
      ->allow_extra_args(false);
  verb.add_option("--error", wishes.errors, "what is called the error: l1, l2 or linf of a field; the largest counts")
      ->type_name("NORM(FIELD)")
      ->allow_extra_args(false);
  verb.add_option("--task", wishes.task, "compare its gradient, too: error against seconds for value and gradient")
      ->type_name("TASK");
  verb.add_option("--reference-cells", wishes.reference_cells,
                  "compare with a run on so many cells along the first axis, not with the exact solution")
      ->check(CLI::Range(2, 1000000000));
  verb.add_flag("--manufactured", wishes.manufactured,
                "compare with a smooth solution that is made up: a source term in each equation makes it one");
  verb.add_option("--samples", wishes.timing.samples, fmt::format("timings of each point; {} counts", which_timing))
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb.add_option("--sample-seconds", wishes.timing.seconds, "least duration of each")
      ->check(not_negative())
      ->capture_default_str();
}

/// With a tolerance errors depend on it, not on the step that would be varied.
bool has_whole_steps(Job& job, const ChartScene& scene) {
  const model::Problem& problem = scene.session->problem();
  if (!problem.substeps.control) return true;
  job.sink().report("not-allowed-here", problem.time_origin.range,
                    {"a tolerance for steps", "a scene of a chart or of tune, which vary the step"},
                    "take a scene without it; dpde run --set tolerance=1e-6 tells the error of each");
  return false;
}

bool open_chart_scene(Job& job, const ChartWishes& wishes, ChartScene& scene) {
  std::optional<driver::CompileOptions> compile = job.compile_options();
  if (!compile || !read_block(job, wishes, scene) || !find_task(job, wishes, scene)) return false;
  compile->without_task = true;
  if (scene.block) {
    compile->selection.name = scene.block->scene;
    if (compile->selection.scheme.empty()) compile->selection.scheme = scene.block->scheme;
    if (scene.block->end) compile->selection.overrides.try_emplace("end", fmt::format("{}", *scene.block->end));
  }
  compile->manufactured =
      wishes.manufactured || (scene.block && scene.block->reference == model::Chart::Reference::manufactured);
  if (compile->manufactured && (scene.reference_cells > 0 || !scene.options.task.empty())) {
    job.sink().report("bad-option", {},
                      {"a manufactured solution is no reference of gradients, and needs no finer run"});
    return false;
  }
  scene.options.compile = *compile;
  scene.options.threads = thread_count(job.options());
  scene.options.samples = wishes.timing.samples;
  scene.options.sample_seconds = wishes.timing.seconds;
  scene.options.stop = &interrupt_flag();
  const Preparing preparing(job);
  scene.session = open_scene(job, *compile, job.sink());
  if (scene.session == nullptr || !has_whole_steps(job, scene) || !find_common_steps(job, scene)) return false;
  find_measures(job, wishes, scene);
  if (scene.reference_cells == 0) has_finite_exact(*scene.session, job.sink());
  return !job.failed();
}

namespace {

constexpr double most_seconds_of_tuning = 300;  // for one run of the reference

/// Finest grid of the reference, in units of the scene's cells; 0, with the reason in `why`, if there can be none.
double finest_of(const ChartScene& scene, double most_cells, bool is_exact_wanted, std::string& why) {
  const int cells = scene.session->problem().axes.front().cells;
  if (scene.reference_cells > 0) {
    const double finest = static_cast<double>(scene.reference_cells) / cells;
    if (finest > most_cells) return finest;
    why = fmt::format("{} cells are no more than the finest of the variants and the scene has, {:g}",
                      scene.reference_cells, most_cells * cells);
    return 0;
  }
  if (is_exact_wanted) why = "the measured quantity has no exact solution";
  return is_exact_wanted ? 0 : 2 * most_cells;
}

/// Refines directly to `finest`, or only as far as the wanted accuracy requires.
chart::Refinement refinement(const ChartScene& scene, double finest) {
  if (!(scene.accuracy > 0) || scene.reference_cells > 0) return {finest / 2, finest};
  return {1, std::max(2.0, finest), scene.accuracy, most_seconds_of_tuning};
}

bool find_state_reference(Job& job, const ChartScene& scene, double most_cells, chart::Reference& reference) {
  const model::Problem& problem = scene.session->problem();
  const bool is_of_block = scene.block && scene.reference_cells == scene.block->reference_cells;
  const SourceRange place = !is_of_block                                               ? job.place()
                            : scene.block->reference == model::Chart::Reference::found ? scene.block->range
                                                                                       : scene.block->reference_range;
  if (scene.options.compile.manufactured) reference = chart::Reference("a manufactured solution");
  if (scene.reference_cells == 0 && has_exact(scene)) return true;
  std::string why;
  const bool wants_exact = scene.block && scene.block->reference == model::Chart::Reference::exact;
  const double finest = finest_of(scene, most_cells, wants_exact, why);
  std::optional<chart::Reference> found;
  if (finest > 0) found = chart::make_reference(job.source(), scene.options, problem, refinement(scene, finest), why);
  if (found) reference = std::move(*found);
  if (!found && !interrupt_flag().load())
    job.sink().report("no-reference", place, {problem.scene, why},
                      scene.reference_cells > 0 ? "" : "give it an exact solution: exact u = ...");
  return found.has_value();
}

bool find_gradient_reference(Job& job, const ChartScene& scene, double most_cells,
                             chart::GradientReference& reference) {
  std::string why;
  const double finest = finest_of(scene, most_cells, false, why);
  std::optional<chart::GradientReference> found;
  if (finest > 0)
    found = chart::make_gradient_reference(job.source(), scene.options, scene.session->problem(),
                                           refinement(scene, finest), why);
  if (found) reference = std::move(*found);
  if (!found && !interrupt_flag().load())
    job.sink().report("no-reference", scene.block ? scene.block->range : job.place(),
                      {scene.session->problem().scene, fmt::format("task {}: {}", scene.options.task, why)});
  return found.has_value();
}

bool find_both(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
               chart::References& references) {
  progress.show("the reference", 0, 1);
  if (!scene.is_gradient_alone && !find_state_reference(job, scene, most_cells, references.states)) return false;
  if (!scene.options.task.empty()) {
    progress.show("the reference of the gradient", 0, 1);
    if (!interrupt_flag().load() && !find_gradient_reference(job, scene, most_cells, references.gradient)) return false;
  }
  return true;
}

}  // namespace

bool find_references(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
                     chart::References& references) {
  const bool found = find_both(job, scene, most_cells, progress, references);
  if (!interrupt_flag().load()) return found;
  job.sink().report("run-failed", {}, {"stopped before there was anything to compare with"});
  return false;
}

}  // namespace dpde::tools
