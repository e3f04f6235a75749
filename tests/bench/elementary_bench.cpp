// SPDX-License-Identifier: Apache-2.0
// Functions of cells: a step that adds f(w) over 4096 cells, in the caches next to the processor. What `w` itself takes
// is to be subtracted; `hand` asks the C library for one value after the other. items_per_second counts values.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>

#include "generated.h"

namespace dpde::bench {
namespace {

dpde_layout row(Code code) { return make_layout(std::vector<int64_t>{4096}, {1, 0, 0}, real_of(code)); }

void generated(benchmark::State& state, const std::string& formula, Code code) {
  run_generated(state,
                "model m { field u; coefficient w; dt(u) = " + formula + " - u }\nscheme c { time = euler }\n" +
                    "scene s : m with c {\n  grid x = 0 .. 64, cells 64, periodic\n  w = 1 + x\n  initial u = 0\n  "
                    "time 0 .. 1, step 1/100\n}\n",
                code, false, row(code));
}

template <class F>
void by_library(benchmark::State& state, F f) {
  std::vector<Field> fields = make_fields(row(hand), 2);
  double* u = fields[0].as<double>();
  const double* w = fields[1].as<double>();
  for (auto _ : state) {
    for (int64_t i = 0; i < 4096; ++i) u[i] += 0.01 * (f(w[i]) - u[i]);
    benchmark::ClobberMemory();
  }
  count(state, row(hand));
}

const int registered = [] {
  const auto name = [](const std::string& of, const char* code) { return of + "/" + code; };
  for (const std::string formula : {"w", "sin(w + 2)", "cos(w + 2)", "exp(w + 2)", "log(w + 2)", "tanh(w + 2)",
                                    "(w + 2)^1.4", "tan(w + 2)", "sinh(w + 2)", "cosh(w + 2)", "atan(w + 2)"}) {
    for (const auto& [label, code] :
         {std::pair{"jit", jit}, {"cpp", cpp}, {"jit_f32", jit_f32}, {"cpp_f32", cpp_f32}}) {
      benchmark::RegisterBenchmark(name(formula, label).c_str(),
                                   [formula, code](benchmark::State& state) { generated(state, formula, code); });
    }
  }
  benchmark::RegisterBenchmark("w/hand", [](benchmark::State& s) { by_library(s, [](double x) { return x; }); });
  benchmark::RegisterBenchmark("sin(w + 2)/hand",
                               [](benchmark::State& s) { by_library(s, [](double x) { return std::sin(x + 2); }); });
  benchmark::RegisterBenchmark("exp(w + 2)/hand",
                               [](benchmark::State& s) { by_library(s, [](double x) { return std::exp(x + 2); }); });
  benchmark::RegisterBenchmark("log(w + 2)/hand",
                               [](benchmark::State& s) { by_library(s, [](double x) { return std::log(x + 2); }); });
  benchmark::RegisterBenchmark("tanh(w + 2)/hand",
                               [](benchmark::State& s) { by_library(s, [](double x) { return std::tanh(x + 2); }); });
  benchmark::RegisterBenchmark(
      "(w + 2)^1.4/hand", [](benchmark::State& s) { by_library(s, [](double x) { return std::pow(x + 2, 1.4); }); });
  return 0;
}();

}  // namespace
}  // namespace dpde::bench
