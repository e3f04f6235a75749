// SPDX-License-Identifier: Apache-2.0
#include "training/plain_methods.h"

#include <fmt/format.h>

#include <algorithm>

#include "chart/sweep.h"
#include "training/beside.h"

namespace dpde::training {

namespace {

struct Known {
  std::string on;
  model::Scheme scheme;
  bool operator==(const Known&) const = default;
};

/// The name of a block is none of its method.
Known known_as(const std::string& on, model::Scheme scheme) {
  scheme.name.clear();
  return {on, std::move(scheme)};
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
      known.push_back(known_as(beside.on, scene->problem->scheme));
      plain.emplace_back(beside, &*scene->problem);
    }
    for (const auto& [beside, problem] : plain) {
      for (const auto& method : chart::methods_for(*problem, {})) {
        const Known next = known_as(beside.on, model::with_settings(problem->scheme, method));
        if (std::ranges::find(known, next) != known.end()) continue;
        known.push_back(next);
        add(test, {beside.scene, beside.on, beside.origin, method});
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
  void add(model::Test& test, model::Test::Beside beside) {
    DiagnosticSink why;
    if (compile_beside(*own_.compiled, beside, source_, why)) {
      test.beside.push_back(std::move(beside));
    } else {
      found_.left_out.push_back(fmt::format("{}: {}", title_of(beside), why.all().front().message));
    }
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
