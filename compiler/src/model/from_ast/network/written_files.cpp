// SPDX-License-Identifier: Apache-2.0
// Output files of optimize --out are named after items of the task. Two items with the same file name are refused here,
// before a long training run.
#include <fmt/format.h>

#include "model/from_ast/parts.h"

namespace dpde::model {

namespace {

class WrittenFiles {
 public:
  explicit WrittenFiles(Elaboration& elaboration) : elaboration_(elaboration) {}

  /// A file that the task always writes.
  void own(const std::string& file) { first_.emplace(file, SourceRange{}); }
  void add(const std::string& file, SourceRange range, const std::string& name) {
    const auto [first, is_new] = first_.emplace(file, range);
    if (is_new || first->second == range) return;
    Diagnostic& told = elaboration_.sink.report("duplicate", range, {"the file " + file + " of optimize --out"},
                                                fmt::format("choose another name than {}", name));
    if (first->second.is_known()) told.notes.push_back({first->second, "this writes it too"});
  }

 private:
  Elaboration& elaboration_;
  std::map<std::string, SourceRange> first_;
};

/// Comparison scenes first: if a test has the same name as one of them, the report is at that other test.
void add_tests(const std::vector<Test>& tests, WrittenFiles& files) {
  for (const Test& test : tests) {
    if (test.beside.empty()) continue;
    for (const char* suffix : {"_beside.csv", "_chart.csv"}) files.own(test.quantity.name + suffix);
  }
  for (const Test& test : tests) files.add(test.quantity.name + ".csv", test.quantity.origin.range, test.quantity.name);
}

}  // namespace

void check_written_files(Elaboration& elaboration) {
  const Task& task = *elaboration.problem.task;
  WrittenFiles files(elaboration);
  for (const char* file : {"loss.csv", "loss.svg"}) files.own(file);
  if (task.training) files.own("epochs.csv");
  for (const Unknown& unknown : task.unknowns) {
    const bool is_initial = unknown.kind == Unknown::Kind::initial;
    if (unknown.is_field())
      files.add(unknown.name + (is_initial ? "_initial.npy" : ".npy"), unknown.origin.range, unknown.name);
  }
  if (task.training) return add_tests(task.tests, files);
  files.add(task.name + ".svg", elaboration.blocks.task->name.range, task.name);
}

}  // namespace dpde::model
