// SPDX-License-Identifier: Apache-2.0
#include "training/plain_methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "chart/common_steps.h"
#include "chart/sweep.h"
#include "training/beside.h"
#include "training/mapped_data.h"

namespace dpde::training {

namespace {

constexpr double alike = 1e-9;  // steps that are the same but for rounding

struct Known {
  std::string on;
  model::Scheme scheme;
  double step;

  bool is(const Known& other) const {
    return on == other.on && scheme == other.scheme && std::abs(step - other.step) <= alike * step;
  }
};

/// The name of a block is none of its method.
Known known_as(const std::string& on, model::Scheme scheme, double step) {
  scheme.name.clear();
  return {on, std::move(scheme), step};
}

class Finder {
 public:
  Finder(const TrainingScene& own, const SourceFile& source, PlainMethods& found)
      : own_(own), source_(source), found_(found) {}

  model::Test expanded(model::Test test) {
    std::vector<std::pair<model::Test::Beside, const model::Problem*>> plain;
    std::vector<Known> known;
    for (const model::Test::Beside& beside : test.beside) {
      const auto scene = compile(beside);
      if (!scene || !scene->problem->networks.empty()) continue;
      known.push_back(known_as(beside.on, scene->problem->scheme, scene->problem->step));
      plain.emplace_back(beside, &*scene->problem);
    }
    for (const auto& [beside, problem] : plain) {
      for (const chart::Entry& entry : with_steps(beside, *problem)) {
        model::Test::Beside next{beside.scene, beside.on, beside.origin, entry.variant.method};
        next.method.insert(entry.variant.resolution.begin(), entry.variant.resolution.end());
        const bool has_step = entry.variant.resolution.contains("step");
        const double step = has_step ? std::stod(entry.variant.resolution.at("step")) : problem->step;
        const Known method = known_as(beside.on, model::with_settings(problem->scheme, entry.variant.method), step);
        if (std::ranges::any_of(known, [&](const Known& other) { return method.is(other); })) continue;
        known.push_back(method);
        if (has_step && std::abs(step - problem->step) <= alike * step) next.method.erase("step");
        add(test, std::move(next));
      }
    }
    return test;
  }

 private:
  std::shared_ptr<const driver::Compiled> compile(const model::Test::Beside& beside) {
    DiagnosticSink silent;  // told when the scenes are opened
    kept_.push_back(compile_beside(*own_.compiled, beside, source_, silent));
    return kept_.back();
  }

  /// The methods with their steps; what has none is left out.
  std::vector<chart::Entry> with_steps(const model::Test::Beside& beside, const model::Problem& problem) {
    DiagnosticSink silent;
    const auto on = load_beside(*own_.compiled, problem, beside.on, source_, beside.origin.range, silent);
    if (!on) return {};
    chart::PointOptions options;
    options.compile = options_beside(*own_.compiled, beside.scene);
    options.compile.selection.name = beside.scene;
    options.compile.selection.beside.clear();
    options.compile.without_task = true;
    options.common_steps = std::gcd(on->every, chart::common_steps(problem));
    std::vector<chart::Entry> entries = chart::entries_on(problem, {}, {});
    std::erase_if(entries, [&](chart::Entry& entry) {
      chart::Point point;
      if (!chart::choose_step(source_, options, problem, entry, point)) {
        leave_out({beside.scene, beside.on, beside.origin, entry.variant.method}, point.failure);
        return true;
      }
      if (!(point.largest_step > 0)) entry.variant.resolution.clear();
      return false;
    });
    return entries;
  }

  void add(model::Test& test, model::Test::Beside beside) {
    DiagnosticSink why;
    if (compile_beside(*own_.compiled, beside, source_, why)) {
      test.beside.push_back(std::move(beside));
    } else {
      leave_out(beside, why.all().front().message);
    }
  }

  void leave_out(const model::Test::Beside& beside, const std::string& why) {
    std::string text = fmt::format("{}: {}", title_of(beside), why);
    if (std::ranges::find(found_.left_out, text) == found_.left_out.end()) found_.left_out.push_back(std::move(text));
  }

  const TrainingScene& own_;
  const SourceFile& source_;
  PlainMethods& found_;
  std::vector<std::shared_ptr<const driver::Compiled>> kept_;
};

}  // namespace

PlainMethods with_plain_methods(const TrainingScene& own, const SourceFile& source) {
  PlainMethods found;
  Finder finder(own, source, found);
  for (const model::Test& test : own.task().tests) {
    if (test.kind == model::Test::Kind::number && !test.beside.empty()) found.tests.push_back(finder.expanded(test));
  }
  return found;
}

}  // namespace dpde::training
