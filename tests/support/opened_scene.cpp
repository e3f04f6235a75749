// SPDX-License-Identifier: Apache-2.0
#include "support/opened_scene.h"

#include <gtest/gtest.h>

#include "source/render.h"
#include "support/kept_code.h"

namespace dpde::testing {

OpenedScene::OpenedScene(const std::string& text, const std::string& name, const OpenWith& with)
    : source(with.path, text) {
  driver::CompileOptions options;
  options.selection.name = name;
  options.selection.overrides = with.overrides;
  options.backend = with.backend;
  options.adjoint = with.adjoint;
  options.tangent = with.tangent;
  options.verify = true;
  options.cache = kept_code();
  auto compiled = driver::compile(source, options, sink);
  if (compiled) {
    const auto code = std::make_shared<const driver::Compiled>(std::move(*compiled));
    session = driver::Session::open(source, code, with.session, sink);
  }
  report();
}

std::unique_ptr<driver::Inverse> OpenedScene::inverse() {
  if (!session) return nullptr;
  auto made = driver::Inverse::open(*session, source, sink);
  report();
  return made;
}

std::vector<std::vector<double>> OpenedScene::states_of(const Snapshot& snapshot) const {
  std::vector<std::vector<double>> states;
  for (void* state : snapshot.states) {
    std::vector<double>& values = states.emplace_back(session->workspace().cell_count());
    copy_out(session->workspace().layout(), state, values);
  }
  return states;
}

void OpenedScene::report() const {
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity == Severity::error) ADD_FAILURE() << render_text(source, d);
  }
}

}  // namespace dpde::testing
