// SPDX-License-Identifier: Apache-2.0
// The printed programs of every example, read back and run instead of the original ones: programs of steps, initial
// states and losses, and of all derivatives. This includes scenes that the text of a program's scene cannot express.
#include <cmath>
#include <fstream>

#include "driver/compile/interpreter_backend.h"
#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "driver_support.h"
#include "files/imports.h"
#include "network/symmetrise.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/examples_by_day.h"
#include "syntax/parser.h"

namespace dpde::testing {
namespace {

using driver::Compiled;

/// Its programs, read back from their text and run by the interpreter.
std::shared_ptr<const Compiled> read_back(const Compiled& made) {
  auto result = std::make_shared<Compiled>(made);
  const SourceFile text("stencil.dpde", stencil::print(made.stencil));
  DiagnosticSink sink;
  result->stencil = stencil::from_ast(parse(text, sink), sink);
  EXPECT_FALSE(sink.has_errors()) << all_messages(text, sink);
  std::vector<std::string> names;
  for (const stencil::Program& program : result->stencil.programs) names.push_back(program.name);
  result->loop = loop::from_stencil(result->stencil, names, result->real());
  result->code = driver::interpreted(result->stencil, result->loop);
  for (const driver::LinkedProgram& linked : driver::linked_programs(*result))
    result->code->set_links(linked.program, linked.links);
  return result;
}

/// The states after three steps on a small grid, the loss there and its gradient.
std::vector<double> numbers_of(const SourceFile& source, const std::shared_ptr<const Compiled>& compiled) {
  driver::SessionOptions options;
  options.cells = network::grid_for(compiled->stencil.networks, {8, 6, 4});
  options.cells.resize(compiled->problem->axes.size());
  options.steps = std::min(3, compiled->problem->steps);
  options.made_up = true;
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled, options, sink);
  std::vector<double> numbers;
  if (session != nullptr) {
    session->rollout().run();
    for (std::size_t s = 0; s < session->problem().states.size(); ++s) {
      const std::vector<double> state = session->final_state(static_cast<int>(s));
      numbers.insert(numbers.end(), state.begin(), state.end());
    }
    if (const auto inverse = driver::Inverse::open(*session, source, sink)) {
      Eigen::VectorXd gradient(inverse->size());
      numbers.push_back(inverse->value_and_gradient(inverse->start(), gradient));
      numbers.insert(numbers.end(), gradient.data(), gradient.data() + gradient.size());
    }
  }
  EXPECT_FALSE(sink.has_errors()) << all_messages(source, sink);
  return numbers;
}

class ExamplePrograms : public ::testing::TestWithParam<std::filesystem::path> {};

TEST_P(ExamplePrograms, RunAsTheyWereWhenTheyAreReadBack) {
  std::ifstream file(GetParam());
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  DiagnosticSink sink;
  const SourceFile source = files::with_imports(SourceFile(GetParam().string(), text), sink);
  for (const std::string& target : targets_by_day(text)) {
    SCOPED_TRACE(target);
    driver::CompileOptions options;
    options.selection.name = target;
    options.backend = driver::Backend::interpreter;
    options.adjoint = options.certify = options.takes_jumps = true;
    const auto made = compiled(source, options);
    if (made == nullptr) continue;
    const std::vector<double> wanted = numbers_of(source, made), got = numbers_of(source, read_back(*made));
    ASSERT_EQ(got.size(), wanted.size());
    EXPECT_GT(wanted.size(), 0u);
    for (std::size_t i = 0; i < wanted.size(); ++i)
      EXPECT_TRUE(got[i] == wanted[i] || (std::isnan(got[i]) && std::isnan(wanted[i]))) << i << ": " << got[i];
  }
}

/// A few by day.
std::vector<std::filesystem::path> files_read_back() {
  const std::vector<std::filesystem::path> files = example_files();
  if (is_thorough()) return files;
  std::vector<std::filesystem::path> some;
  for (std::size_t i = 4; i < files.size(); i += 8) some.push_back(files[i]);
  return some;
}

INSTANTIATE_TEST_SUITE_P(Examples, ExamplePrograms, ::testing::ValuesIn(files_read_back()),
                         [](const auto& info) { return info.param.stem().string(); });

}  // namespace
}  // namespace dpde::testing
