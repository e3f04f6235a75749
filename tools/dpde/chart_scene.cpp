// SPDX-License-Identifier: Apache-2.0
#include "chart_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "interrupt.h"
#include "model/from_ast/parts.h"
#include "preparing.h"
#include "scene_session.h"
#include "support/contains.h"

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

template <class Number>
bool read_numbers(const std::vector<std::string>& texts, std::vector<Number>& numbers) {
  for (const std::string& text : texts) {
    Number value{};
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || stop != text.data() + text.size() || !(value > 0)) return false;
    numbers.push_back(value);
  }
  return true;
}

}  // namespace

std::optional<chart::Wishes> parse_wishes(const std::vector<std::string>& vary, DiagnosticSink& sink) {
  chart::Wishes wishes;
  for (const std::string& text : vary) {
    const std::size_t equals = text.find('=');
    const std::string key = text.substr(0, equals);
    const std::vector<std::string> values = split(equals == std::string::npos ? "" : text.substr(equals + 1));
    bool is_understood = equals != std::string::npos && equals > 0 &&
                         std::ranges::none_of(values, [](const std::string& v) { return v.empty(); });
    if (is_understood && key == "cells") {
      is_understood = read_numbers(values, wishes.cells);
    } else if (is_understood && key == "step") {
      is_understood = read_numbers(values, wishes.steps);
    } else if (is_understood && key == "fraction") {
      is_understood = read_numbers(values, wishes.fractions);
    } else if (is_understood && !contains(model::scheme_keys(), key)) {
      sink.report("bad-option", {}, {fmt::format("--vary {}: {} is no key of a scheme", text, key)},
                  fmt::format("cells, step, fraction, or one of: {}", fmt::join(model::scheme_keys(), ", ")));
      return std::nullopt;
    } else if (is_understood) {
      wishes.method[key] = values;
    }
    if (is_understood) continue;
    sink.report("bad-option", {}, {fmt::format("--vary {} is no list of values", text)},
                "as in --vary advect=central2,upwind3 --vary cells=32,64,128 --vary step=0.01,0.005");
    return std::nullopt;
  }
  return wishes;
}

void add_chart_options(CLI::App& verb, std::vector<std::string>& vary, Timing& timing) {
  verb.add_option("--vary", vary,
                  "values of a key of --set; also cells, step, and fraction: parts of the largest stable step")
      ->type_name("KEY=V1,V2,...")
      ->allow_extra_args(false);
  verb.add_option("--samples", timing.samples, "timings of each point; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb.add_option("--sample-seconds", timing.seconds, "least duration of each")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
}

bool open_chart_scene(Job& job, const Timing& timing, ChartScene& scene) {
  std::optional<driver::CompileOptions> compile = job.compile_options();
  if (!compile) return false;
  compile->without_task = true;
  scene.options = {*compile, thread_count(job.options()), timing.samples, timing.seconds, &interrupt_flag()};
  const Preparing preparing(job);
  scene.session = open_scene(job, job.sink());
  return scene.session != nullptr;
}

bool find_reference(Job& job, const ChartScene& scene, double most_cells, Progress& progress,
                    chart::Reference& reference) {
  const model::Problem& problem = scene.session->problem();
  if (std::ranges::any_of(problem.states, [](const model::State& state) { return state.exact.has_value(); }))
    return true;
  progress.show("the reference", 0, 1);
  std::string why;
  std::optional<chart::Reference> found = chart::make_reference(job.source(), scene.options, problem, most_cells, why);
  if (found) reference = std::move(*found);
  if (!found)
    job.sink().report("no-reference", job.place(), {problem.scene, why}, "give it an exact solution: exact u = ...");
  return found.has_value() && !interrupt_flag().load();
}

}  // namespace dpde::tools
