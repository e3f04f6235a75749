// SPDX-License-Identifier: Apache-2.0
// What benchmarks of generated code share: compiling a text, and running one of its programs on fields of its own.
#pragma once

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "driver/compile/pipeline.h"

namespace dpde::bench {

/// Steps in which the sweeps of a large grid surely find out how they are done best.
constexpr int runs_to_tune = 120;

enum Code { hand, jit, cpp, jit_f32, cpp_f32 };
inline bool is_single(Code code) { return code == jit_f32 || code == cpp_f32; }

/// A text for 64 cells an axis, compiled for `cells`: rows of large grids have variants.
inline std::shared_ptr<const driver::Compiled> compile(std::string text, Code code, int64_t cells = 64) {
  const std::string written = "cells 64";
  for (size_t at = text.find(written); at != std::string::npos; at = text.find(written, at + 1))
    text.replace(at, written.size(), "cells " + std::to_string(cells));
  const SourceFile source("bench.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.backend = code == cpp || code == cpp_f32 ? driver::Backend::cpp : driver::Backend::jit;
  options.runs = driver::any_number_of_runs;
  if (is_single(code)) options.real = Precision::f32;
  options.adjoint = true;
  auto compiled = driver::compile(source, options, sink);
  if (!compiled) std::abort();
  return std::make_shared<const driver::Compiled>(std::move(*compiled));
}

/// The 3-D wave of 25 points on a periodic cube; c2, the velocity squared, is a "param" or a "coefficient".
inline std::string wave_of(const std::string& speed, const std::string& times) {
  std::string text = "model waves { field u; " + speed + " c2; dt(dt(u)) = c2*lap(u) }\n";
  text += "scheme plain { lap = central(8); time = leapfrog }\nscene s : waves with plain {\n";
  for (const char axis : {'x', 'y', 'z'}) text += std::string("  grid ") + axis + " = 0 .. 1, cells 64, periodic\n";
  return text + "  c2 = 1\n  initial u = sin(2*pi*x)\n  initial dt(u) = 0\n  " + times + "\n}\n";
}

/// Fields of one layout with smooth values of order 1, halo included.
inline std::vector<Field> make_fields(const dpde_layout& layout, int count) {
  std::vector<Field> fields;
  for (int n = 0; n < count; ++n) {
    fields.emplace_back(layout, n);
    const auto set = [&](auto* start) {
      for (int64_t i = 0; i < layout.size; ++i) start[i - layout.origin] = std::sin(0.001 * static_cast<double>(i) + n);
    };
    layout.real == DPDE_F32 ? set(fields.back().as<float>()) : set(fields.back().as<double>());
  }
  return fields;
}

/// Runs one program on fields of its own; every parameter is small enough for nothing to blow up.
class Runner {
 public:
  Runner(const dpde_program& program, const dpde_layout& layout)
      : executor_(program, layout, 1), fields_(make_fields(layout, program.field_count)) {
    for (int f = 0; f < program.field_count; ++f) executor_.bind(f, fields_[f].as<double>());
    for (int p = 0; p < program.param_count; ++p) executor_.set_param(p, program.params[p][0] == 'h' ? 1.0 : 1e-2);
    for (int s = 0; s < program.swap_count; ++s) {
      const dpde_swap& swap = program.swaps[s];
      if (swap.is_over != 0) executor_.bind(swap.next, executor_.bound(swap.state));
    }
    executor_.update_uniforms();
    executor_.prepare();
    while (executor_.is_tuning()) run();
  }
  void run() {
    executor_.run();
    for (int s = 0; s < executor_.program().swap_count; ++s) {
      const dpde_swap& swap = executor_.program().swaps[s];
      if (swap.is_over != 0) continue;
      void* state = executor_.bound(swap.state);
      executor_.bind(swap.state, executor_.bound(swap.next));
      executor_.bind(swap.next, state);
    }
  }

 private:
  Executor executor_;
  std::vector<Field> fields_;
};

inline int32_t real_of(Code code) { return is_single(code) ? DPDE_F32 : DPDE_F64; }
inline dpde_layout square(int64_t n, Code code = jit) {
  return make_layout(std::vector<int64_t>{n, n}, {1, 1, 0}, real_of(code));
}
inline dpde_layout cube(int64_t n, Code code = jit, int64_t halo = 1) {
  return make_layout(std::vector<int64_t>{n, n, n}, {halo, halo, halo}, real_of(code));
}

inline void count(benchmark::State& state, const dpde_layout& layout) {
  state.SetItemsProcessed(static_cast<int64_t>(state.iterations()) * cell_count(layout));
}

inline void run_generated(benchmark::State& state, const std::string& text, Code code, bool adjoint,
                          const dpde_layout& layout) {
  const auto compiled = compile(text, code, layout.cells[0]);
  const std::string step = compiled->step_name();
  Runner runner(adjoint ? *compiled->adjoint_of(step) : *compiled->program(step), layout);
  for (auto _ : state) runner.run();
  count(state, layout);
}

}  // namespace dpde::bench
