// SPDX-License-Identifier: Apache-2.0
// Stencil modules from text, and random states to run them on.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "source/render.h"
#include "stencil/build.h"
#include "stencil/interpret/interpret.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "syntax/parser.h"

namespace dpde::stencil {

/// The module of a text that has no errors.
inline Module module_of(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  const ast::File file = parse(source, sink);
  const Module module = from_ast(file, sink);
  for (const Diagnostic& diagnostic : sink.all()) ADD_FAILURE() << render_text(source, diagnostic);
  return module;
}

/// "E0350 message | text pointed at | hint" of each diagnostic.
inline std::vector<std::string> complaints(const std::string& text) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  from_ast(parse(source, sink), sink);
  std::vector<std::string> result;
  for (const Diagnostic& d : sink.all()) {
    const std::string place(source.text().substr(d.range.begin, d.range.end - d.range.begin));
    result.push_back(std::string(d.kind->code) + " " + d.message + " | " + place +
                     (d.hint.empty() ? "" : " | " + d.hint));
  }
  return result;
}

inline std::vector<std::string> one(const std::string& text) { return {text}; }

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()() { return std::uniform_real_distribution<>(-1, 1)(engine_); }
  void fill_interior(State& state, const std::string& field) {
    std::vector<double> values(state.grid().cells[0] * state.grid().cells[1] * state.grid().cells[2]);
    for (double& value : values) value = (*this)();
    state.set(field, values);
  }

 private:
  std::mt19937 engine_;
};

/// Calls f for every grid with 1 to max_cells cells along each of `rank` axes.
template <class F>
void for_each_grid(int rank, int max_cells, const F& f) {
  Grid grid{rank, {1, 1, 1}};
  for (grid.cells[0] = 1; grid.cells[0] <= max_cells; ++grid.cells[0]) {
    for (grid.cells[1] = 1; grid.cells[1] <= (rank > 1 ? max_cells : 1); ++grid.cells[1]) {
      for (grid.cells[2] = 1; grid.cells[2] <= (rank > 2 ? max_cells : 1); ++grid.cells[2]) f(grid);
    }
  }
}

/// Every cell, `width` halo cells on each side included.
template <class F>
void for_each_cell(const Grid& grid, int width, const F& f) {
  const auto reach = [&](int axis) { return axis < grid.rank ? width : 0; };
  for (int k = -reach(2); k < grid.cells[2] + reach(2); ++k) {
    for (int j = -reach(1); j < grid.cells[1] + reach(1); ++j) {
      for (int i = -reach(0); i < grid.cells[0] + reach(0); ++i) f(i, j, k);
    }
  }
}

}  // namespace dpde::stencil
