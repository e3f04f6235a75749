// SPDX-License-Identifier: Apache-2.0
// Metamorphic test: loss, gradient and Hessian product are the same to the last bit for any user-chosen names.
// DPDE_RENAMED: how many random programs and models (30 and 6), DPDE_RANDOM_SEED: the first of their seeds (1).
#include "random/renaming.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <set>

#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "files/imports.h"
#include "network/symmetrise.h"
#include "random/random_model.h"
#include "random/random_program.h"
#include "source/render.h"
#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/program_run.h"
#include "support/scene_run.h"
#include "support/setting.h"
#include "support/split_mix.h"
#include "syntax/parser.h"

namespace dpde::testing {
namespace {

/// By the JIT and with all scenes; else by the interpreter, which compiles nothing.
bool is_full() { return std::getenv("DPDE_RENAMED") != nullptr; }

struct Numbers {
  std::string refused;  // the code of the first error
  std::string message;
  std::vector<double> values;

  void add(const Eigen::VectorXd& more) { values.insert(values.end(), more.data(), more.data() + more.size()); }
};

bool same_bits(const Numbers& a, const Numbers& b) {
  const auto is_same = [](double left, double right) {
    return std::bit_cast<std::uint64_t>(left) == std::bit_cast<std::uint64_t>(right);
  };
  return a.refused == b.refused && std::ranges::equal(a.values, b.values, is_same);
}

std::string first_difference(const Numbers& a, const Numbers& b) {
  for (std::size_t i = 0; i < std::min(a.values.size(), b.values.size()); ++i) {
    if (std::memcmp(&a.values[i], &b.values[i], sizeof(double)) == 0) continue;
    return fmt::format("value {} of {}: {} and {}", i, a.values.size(), a.values[i], b.values[i]);
  }
  return a.message + "\n" + b.message;
}

void note(const SourceFile& source, const DiagnosticSink& sink, Numbers& numbers) {
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity != Severity::error || !numbers.refused.empty()) continue;
    numbers.refused = d.kind->code;
    numbers.message = render_text(source, d);
  }
}

/// Of a scene or task: loss, gradient and Hessian product near the start, on a few cells where `is_small`.
Numbers numbers_of(const std::string& text, const std::string& path, const std::string& selection, bool is_task,
                   bool is_small) {
  const SourceFile source(path, text);
  DiagnosticSink sink;
  Numbers numbers;
  driver::CompileOptions options;
  options.selection.name = selection;
  options.backend = is_full() ? driver::Backend::jit : driver::Backend::interpreter;
  options.tangent = options.adjoint = true;
  options.takes_jumps = true;               // random models may jump
  options.second = is_full() || !is_small;  // second derivatives of examples: at night
  options.certify = !is_task;
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  note(source, sink, numbers);
  if (!compiled || sink.has_errors()) return numbers;
  driver::SessionOptions on;
  if (is_small) {
    for (std::size_t a = 0; a < compiled->problem->axes.size(); ++a) on.cells.push_back(a == 0 ? 5 : 4);
    on.cells = network::grid_for(compiled->stencil.networks, on.cells);
    on.steps = std::min(2, compiled->problem->steps);
  }
  const auto session =
      driver::Session::open(source, std::make_shared<const driver::Compiled>(std::move(*compiled)), on, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  note(source, sink, numbers);
  if (!inverse) return numbers;
  SplitMix random(7);
  Eigen::VectorXd x = inverse->start(), direction(inverse->size()), result(inverse->size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] += random.uniform(-0.05, 0.05);
    direction[i] = random.uniform(-1, 1);
  }
  numbers.values.push_back(inverse->value_and_gradient(x, result));
  numbers.add(result);
  for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
    if (!inverse->has_products(curvature)) continue;
    inverse->product(x, direction, result, curvature);
    numbers.add(result);
  }
  return numbers;
}

/// Returns whether there were numbers to compare. A refused text must be refused under any names.
bool expect_same(const std::string& text, const std::string& path, const std::string& selection, bool is_task,
                 bool is_small, const Renaming& renaming) {
  const Numbers wanted = numbers_of(text, path, selection, is_task, is_small);
  const Numbers got = numbers_of(renaming.text, path, renaming(selection), is_task, is_small);
  EXPECT_TRUE(same_bits(wanted, got)) << path << " " << selection << ": " << first_difference(wanted, got) << "\n"
                                      << renaming.text;
  return !wanted.values.empty();
}

/// Tasks that the command runs with files of another task, or that learn from trajectories: they are refused as they
/// are here.
const std::set<std::string> refused_alone{"judge", "beforehand_test"};

class RenamedExamples : public ::testing::TestWithParam<std::string> {};

TEST_P(RenamedExamples, GiveTheSameBits) {
  const std::string path = GetParam();
  DiagnosticSink sink;
  const SourceFile whole = files::with_imports(SourceFile(path, read_file(path)), sink);
  const std::string text = files::text_without_imports(whole);
  const ast::File file = parse(SourceFile(path, text), sink);
  ASSERT_FALSE(sink.has_errors());
  const Renaming renaming = rename_all(text, 3);
  for (std::size_t count = 0; const std::string& task : model::task_names(file)) {
    if (!is_tried(count++, 3) && !is_full()) continue;
    const bool is_compared = expect_same(text, path, task, true, true, renaming);
    EXPECT_EQ(is_compared, !refused_alone.contains(task)) << task;
  }
  if (!model::task_names(file).empty() && !is_full()) return;
  for (const std::string& scene : model::scene_names(file)) expect_same(text, path, scene, false, true, renaming);
}

std::vector<std::string> examples() {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(DPDE_SOURCE_DIR "/dsl-examples")) {
    if (entry.path().extension() == ".dpde") paths.push_back(entry.path().string());
  }
  std::ranges::sort(paths);
  std::vector<std::string> some;  // a sixth of them by day
  for (std::size_t i = 0; i < paths.size(); i += is_full() ? 1 : 6) some.push_back(paths[i]);
  return some;
}

INSTANTIATE_TEST_SUITE_P(All, RenamedExamples, ::testing::ValuesIn(examples()), [](const auto& info) {
  std::string name = std::filesystem::path(info.param).stem().string();
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name + "_" + std::to_string(info.index);
});

TEST(RenamedModels, GiveTheSameBits) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1), count = setting("DPDE_RENAMED", 6);
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed < first + count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    const std::string text = print(random_model(seed));
    compared += expect_same(text, "random.dpde", "t", true, false, rename_all(text, seed)) ? 1 : 0;
  }
  EXPECT_GE(compared, count * 2 / 3);
}

/// What the interpreter makes of a program's tangent and adjoint, and of the adjoint of its tangent. Values go by the
/// names of the first text.
class ProgramNumbers {
 public:
  ProgramNumbers(const RandomProgram& program, stencil::Module module, const Renaming* renaming)
      : program_(program), module_(std::move(module)), renaming_(renaming) {
    for (const auto& [old, other] : renaming == nullptr ? std::map<std::string, std::string>{} : renaming->names)
      first_[other] = old;
  }

  Numbers run() {
    for (const stencil::Pass& pass : stencil::default_passes) module_ = pass.run(module_);
    adjoint::Activity wrt;
    for (const std::string& field : program_.wrt.fields) wrt.fields.insert(name(field));
    for (const std::string& param : program_.wrt.params) wrt.params.insert(name(param));
    for (const stencil::Program& program : module_.programs) note_names(program);
    DiagnosticSink sink;
    const adjoint::Derivative tangent = adjoint::tangent(module_, name("p"), wrt, sink);
    const adjoint::Derivative adjoint = adjoint::adjoint(module_, name("p"), wrt, sink);
    if (sink.has_errors()) numbers_.refused = sink.all()[0].kind->code;
    if (sink.has_errors()) return numbers_;
    run_one(adjoint, "_bar");
    run_one(tangent, "_dot");
    for (const std::string& field : program_.wrt.fields) wrt.fields.insert(*tangent.field(name(field)));
    for (const std::string& param : program_.wrt.params) wrt.params.insert(*tangent.param(name(param)));
    const adjoint::Derivative second = adjoint::adjoint(tangent.module, tangent.program, wrt, sink);
    if (!sink.has_errors()) run_one(second, "_bar");
    return numbers_;
  }

 private:
  std::string name(const std::string& of) const { return renaming_ == nullptr ? of : (*renaming_)(of); }
  std::string first(const std::string& of) const {
    const auto found = first_.find(of);
    return found == first_.end() ? of : found->second;
  }

  /// Those that follow another one, as u_bar does u where both are fields.
  void note_names(const stencil::Program& program) {
    const stencil::Interface known = stencil::interface_of(module_, program),
                             original = stencil::interface_of(program_.module, program_.module.programs.front());
    for (const auto& [mine, theirs] : {std::pair{&known.inputs, &original.inputs},
                                       {&known.written, &original.written},
                                       {&known.params, &original.params},
                                       {&known.sums, &original.sums}}) {
      for (const std::string& old : *theirs) {
        if (std::ranges::find(*mine, name(old)) != mine->end()) first_[name(old)] = old;
      }
    }
  }

  void run_one(const adjoint::Derivative& derivative, const std::string& ending) {
    for (const adjoint::Link& link : derivative.links) first_[link.derived] = first(link.primal) + ending + " of it";
    stencil::Module module = derivative.module;
    for (const stencil::Pass& pass : stencil::default_passes) module = pass.run(module);
    const stencil::Program& program = *module.find_program(derivative.program);
    const stencil::Interface known = stencil::interface_of(module, program);
    const auto random = [&](const std::string& of) {
      return SplitMix(program_.seed + std::hash<std::string>()(first(of)));
    };
    RunInputs inputs{program_.grid, {}, {}, 1};
    const auto cells =
        static_cast<std::size_t>(program_.grid.cells[0] * program_.grid.cells[1] * program_.grid.cells[2]);
    for (const std::string& field : known.inputs) inputs.fields[field] = random(field).uniform(cells, 0.5, 1.5);
    for (const std::string& param : known.params) inputs.params[param] = random(param).uniform(0.2, 0.8);
    const Outcome outcome = run_interpreted(module, program, inputs);
    std::map<std::string, std::vector<double>> results;
    for (const auto& [field, values] : outcome.fields) results[first(field)] = values;
    for (const auto& [sum, value] : outcome.sums) results[first(sum) + " sum"] = {value};
    for (const auto& [of, values] : results)
      numbers_.values.insert(numbers_.values.end(), values.begin(), values.end());
  }

  const RandomProgram& program_;
  stencil::Module module_;
  const Renaming* renaming_;
  std::map<std::string, std::string> first_;  // what a name is called in the first text
  Numbers numbers_;
};

TEST(RenamedPrograms, GiveTheSameBits) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1), count = setting("DPDE_RENAMED", 30);
  std::uint64_t compared = 0;
  for (std::uint64_t seed = first; seed < first + count && !HasFailure(); ++seed) {
    SCOPED_TRACE(seed);
    const RandomProgram program = random_program(seed);
    const std::string text = stencil::print(program.module);
    const Renaming renaming = rename_all(text, seed);
    DiagnosticSink sink;
    const SourceFile source("renamed.dpde", renaming.text);
    const stencil::Module renamed = stencil::from_ast(parse(source, sink), sink);
    ASSERT_FALSE(sink.has_errors()) << render_text(source, sink.all()[0]) << renaming.text;
    const Numbers wanted = ProgramNumbers(program, program.module, nullptr).run(),
                  got = ProgramNumbers(program, renamed, &renaming).run();
    EXPECT_TRUE(same_bits(wanted, got)) << first_difference(wanted, got) << "\n"
                                        << text << "\nrenamed\n"
                                        << renaming.text;
    compared += wanted.values.empty() ? 0 : 1;
  }
  EXPECT_GE(compared, count * 2 / 3);
}

}  // namespace
}  // namespace dpde::testing
