// SPDX-License-Identifier: Apache-2.0
// The time from a text to machine code of a gradient, for texts of many terms and of many fields. Linear is the aim;
// the rows end with the power of the number that fits best:
//   bench_compile --benchmark_repetitions=3 --benchmark_report_aggregates_only=true
#include <benchmark/benchmark.h>

#include <string>

#include "driver/compile/pipeline.h"

namespace dpde::bench {
namespace {

/// A rate of so many terms: products, functions, differences.
std::string with_terms(std::int64_t terms) {
  const std::string kinds[] = {"u*v", "sin(A*u)", "dx(u)*dx(v)", "(u - A)^2", "dx(u*v)", "u*exp(v*A)"};
  std::string rate = "0";
  for (std::int64_t i = 0; i < terms; ++i) {
    const std::string number = std::to_string(0.001 * static_cast<double>(i + 1));
    std::string term = kinds[i % 6];
    if (const auto a = term.find('A'); a != std::string::npos) term.replace(a, 1, number);
    rate += " + " + number + "*" + term;
  }
  return "model m { field u; field v; dt(u) = " + rate + R"(; dt(v) = -u*v }
scene s : m { grid x = 0 .. 1, cells 64, periodic; initial u = 0.1; initial v = 0.2; time 0 .. 0.1, step 0.01 }
task g : s { unknown initial u from 0; minimise mean(u^2 + v^2) at t = 0.1 }
)";
}

/// So many fields, each coupled to the next.
std::string with_fields(std::int64_t fields) {
  std::string model, initial;
  for (std::int64_t i = 0; i < fields; ++i) {
    const std::string u = "u" + std::to_string(i), next = "u" + std::to_string((i + 1) % fields);
    model += "  field " + u + "\n  dt(" + u + ") = k*lap(" + u + ") + 0.1*" + u + "*" + next + "\n";
    initial += "  initial " + u + " = 0.1\n";
  }
  return "model m {\n  param k\n" + model + "}\nscene s : m {\n  grid x = 0 .. 1, cells 64, periodic\n  k = 1e-4\n" +
         initial + "  time 0 .. 0.1, step 0.01\n}\ntask g : s { unknown k; minimise mean(u0^2) at t = 0.1 }\n";
}

void compile_gradient(benchmark::State& state, std::string (*text_of)(std::int64_t)) {
  const SourceFile source("text.dpde", text_of(state.range(0)));
  driver::CompileOptions options;
  options.selection.name = "g";
  options.backend = driver::Backend::jit;
  options.tangent = options.adjoint = true;
  options.runs = driver::any_number_of_runs;
  for (auto _ : state) {
    DiagnosticSink sink;
    const auto compiled = driver::compile(source, options, sink);
    if (!compiled) state.SkipWithError("the text does not compile");
    benchmark::DoNotOptimize(compiled);
  }
  state.SetComplexityN(state.range(0));
}
BENCHMARK_CAPTURE(compile_gradient, terms, with_terms)
    ->Arg(112)
    ->Arg(225)
    ->Arg(450)
    ->Arg(900)
    ->Complexity()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(compile_gradient, fields, with_fields)
    ->Arg(25)
    ->Arg(50)
    ->Arg(100)
    ->Arg(200)
    ->Complexity()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dpde::bench
