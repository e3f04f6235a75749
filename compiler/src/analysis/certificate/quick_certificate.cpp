// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/quick_certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <sstream>

#include "analysis/certificate/program_check.h"
#include "analysis/certificate/solve_tolerance.h"
#include "dpde/runtime/error.h"
#include "driver/compile/interpreter_backend.h"
#include "driver/memory/cpu_time.h"
#include "driver/memory/tuning.h"
#include "driver/scene/window_start.h"
#include "loop/from_stencil.h"
#include "loop/print_loop.h"
#include "model/print/print_model.h"
#include "network/symmetrise.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::analysis {

namespace {

using driver::thread_cpu_seconds;  // CPU time: a busy machine does not change the budget

constexpr double largest_share = 0.1;  // share of the compilation time
/// Part of the compilation time for code that is not optimised: the median of 0.19 to 0.43 in dsl-examples
/// (tests/bench/README.md).
constexpr double quick_code = 0.37;
/// Cost of differentiating and interpreting, measured on the tasks of dsl-examples (2-core AMD EPYC, Zen 4): 0.2 to 2.6
/// ms, 0.7 to 2 per cent of JIT compilation.
constexpr double seconds_a_program = 1.5e-4, seconds_a_node = 3e-6, seconds_a_node_and_cell = 1.2e-7;

/// Grids narrower and wider than most stencils.
std::vector<std::vector<int>> quick_grids(std::size_t rank, const std::vector<network::Network>& networks) {
  std::vector<std::vector<int>> grids{{1, 2, 3}, {4, 3, 2}};
  if (rank == 1) grids = {{1}, {3}, {6}};
  if (rank == 2) grids = {{1, 3}, {5, 4}};
  for (std::vector<int>& cells : grids) cells = network::grid_for(networks, cells);
  return grids;
}

std::vector<std::string> certified_programs(const driver::Compiled& compiled) {
  std::vector<std::string> names;
  for (const auto& [name, derived] : compiled.derived) {
    if (derived.adjoint && compiled.program(derived.adjoint->program) != nullptr) names.push_back(name);
  }
  return names;
}

int size_of(const stencil::Kernel& kernel) {
  int nodes = 0;
  visit(kernel, [&](const stencil::Expr&) { ++nodes; });
  return nodes;
}

struct Size {
  double nodes = 0, executed = 0;  // counting repeats once; in each pass
};

Size size_of(const stencil::Module& module, const std::vector<stencil::Statement>& statements) {
  Size size;
  for (const stencil::Statement& statement : statements) {
    const Size more = match(
        statement,
        [](const OneOf<stencil::Fill, stencil::Fold, stencil::Reduce, stencil::NetworkCall, stencil::Transform> auto&) {
          return Size{};
        },
        [&](const stencil::Run& run) {
          const double nodes = size_of(*module.find_kernel(run.kernel));
          return Size{nodes, nodes};
        },
        [&](const stencil::Solve& solve) { return size_of(module, solve.body); },
        [&](const stencil::Repeat& repeat) {
          const Size block = size_of(module, repeat.body);
          return Size{block.nodes, repeat.count * block.executed};
        });
    size.nodes += more.nodes;
    size.executed += more.executed;
  }
  return size;
}

/// Cache key: the code, its programs, and the scene and task.
std::string key_of(const driver::Compiled& compiled, const SourceFile& source) {
  const std::string problem = compiled.problem ? print(*compiled.problem) : "";
  return compiled.cached.key + "\ncertificate\n" + problem + print(compiled.loop) +
         driver::stamp_of_windows(compiled, source);
}

/// One value for each line; the last line marks the end.
std::string text_of(const QuickCertificate& c) {
  std::string text = fmt::format("{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n{}\n", c.dot_product, c.program, c.grid,
                                 c.run.grid, c.run.steps, c.run.directions, c.run.unknown, c.run.error, c.run.rounding,
                                 c.run.is_steady ? "steady" : "steps", c.run.window, c.run.untested.size());
  for (const std::string& name : c.run.untested) text += name + "\n";
  for (const std::string& line : c.left_out) text += line + "\n";
  return text + "end\n";
}

template <class Number>
bool read(const std::string& line, Number& number) {
  const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), number);
  return error == std::errc{} && rest == line.data() + line.size();
}

/// Inverse of text_of(); nullopt for other text and for an error above `most`.
std::optional<QuickCertificate> certificate_of(const std::string& text, double most) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  constexpr std::size_t numbers = 12;
  std::size_t untested = 0;
  if (lines.size() <= numbers || lines.back() != "end" || !read(lines[numbers - 1], untested) ||
      untested >= lines.size() - numbers)
    return std::nullopt;
  QuickCertificate result;
  result.program = lines[1];
  result.grid = lines[2];
  RunCheck& run = result.run;
  run.grid = lines[3];
  run.unknown = lines[6];
  run.is_steady = lines[9] == "steady";
  run.window = lines[10];
  const bool read_all = read(lines[0], result.dot_product) && read(lines[4], run.steps) &&
                        read(lines[5], run.directions) && read(lines[7], run.error) && read(lines[8], run.rounding);
  const bool is_one = result.dot_product >= 0 && result.dot_product <= most && run.error >= 0 && run.error < 1;
  const auto names = lines.begin() + numbers, names_end = names + static_cast<std::ptrdiff_t>(untested);
  run.untested.assign(names, names_end);
  result.left_out.assign(names_end, lines.end() - 1);
  result.from_cache = true;
  return read_all && is_one && text_of(result) == text ? std::optional(result) : std::nullopt;
}

model::Problem problem_for(const driver::Compiled& compiled, const stencil::Program& program,
                           const std::vector<int>& cells) {
  if (compiled.problem) return *compiled.problem;
  model::Problem problem;
  for (std::size_t a = 0; a < program.axes.size(); ++a) {
    problem.axes.push_back({std::string(1, "xyz"[a]), 0.0, static_cast<double>(cells[a]), cells[a], program.axes[a]});
  }
  problem.step = 0.1;
  return problem;
}

/// Whether the program uses single precision, in its fields or in a network.
bool is_single(const driver::Compiled& compiled, const std::string& program) {
  const stencil::Interface interface = stencil::interface_of(compiled.stencil, *compiled.stencil.find_program(program));
  return compiled.real() == Precision::f32 || std::ranges::any_of(interface.networks, [&](const std::string& network) {
           return compiled.stencil.find_network(network)->real == Precision::f32;
         });
}

/// A tangent and its code.
struct TangentCode {
  adjoint::Derivative tangent;
  std::shared_ptr<const codegen::CompiledModule> code;
};

/// nullopt if the program has no tangent.
std::optional<TangentCode> interpreted_tangent(const driver::Compiled& compiled, const std::string& name) {
  DiagnosticSink silent;
  TangentCode result;
  result.tangent =
      adjoint::tangent(driver::extract(compiled.stencil, {name}), name, driver::active_inputs(compiled, name), silent);
  if (silent.has_errors()) return std::nullopt;
  result.code = driver::interpreted(
      result.tangent.module, loop::from_stencil(result.tangent.module, {result.tangent.program}, Precision::f64));
  return result;
}

std::optional<driver::Compiled> compile_with_tangents(const SourceFile& source, driver::CompileOptions options) {
  options.tangent = true;
  options.after = {};
  DiagnosticSink silent;
  return driver::compile(source, options, silent);
}

std::optional<TangentCode> tangent_in(const driver::Compiled& compiled, const std::string& name) {
  const auto found = compiled.derived.find(name);
  if (found == compiled.derived.end() || !found->second.tangent) return std::nullopt;
  return TangentCode{*found->second.tangent, compiled.code};
}

/// Compiled with the back end of the adjoint.
std::optional<TangentCode> compiled_tangent(const SourceFile& source, const driver::Compiled& compiled,
                                            const std::string& name) {
  const std::optional<driver::Compiled> again = compile_with_tangents(source, compiled.options);
  return again ? tangent_in(*again, name) : std::nullopt;
}

/// Tangent against adjoint of one program, on the grids where both are finite.
std::vector<DotCase> cases_of(const driver::Compiled& compiled, const std::string& name, const TangentCode& tangent,
                              bool single, std::vector<double>& scales) {
  const stencil::Program& program = *compiled.stencil.find_program(name);
  std::mt19937_64 random(20240229);
  std::vector<DotCase> cases;
  for (const std::vector<int>& cells : quick_grids(program.axes.size(), compiled.stencil.networks)) {
    ProgramCheck check(compiled, program, tangent.tangent, *tangent.code, problem_for(compiled, program, cells), cells,
                       random);
    try {
      DotCase result = check.dot_product(single);
      if (!std::isfinite(result.relative_error)) continue;
      scales.push_back(result.scale);
      cases.push_back(std::move(result));
    } catch (const NoSolution&) {  // for made-up values
      continue;
    }
  }
  return cases;
}

/// Whether a solve of the program leaves more than rounding, or may. Then tangent and adjoint do not agree to the last
/// digits.
bool leaves_residuals(const std::vector<stencil::Statement>& statements) {
  const auto leaves_some = [](const stencil::Solve& solve) {
    return solve.by.warns || solve.by.tolerance > SolveBy{}.tolerance;
  };
  return find_kind<stencil::Solve>(statements, leaves_some) != nullptr;
}

std::string help_for(const driver::Compiled& compiled) {
  const bool has_given_adjoints = std::ranges::any_of(
      compiled.stencil.kernels, [](const stencil::Kernel& kernel) { return !kernel.custom_adjoints.empty(); });
  return has_given_adjoints
             ? "an adjoint that the text gives is wrong for some values, else this is a bug of dpde: leave the lines "
               "adjoint ... out to see. dpde verify shows more"
             : "this is a bug of dpde: the gradient would be wrong. dpde verify shows more";
}

/// Removes cases that are 0 except for rounding.
std::vector<DotCase> telling(std::vector<DotCase> cases, const std::vector<double>& scales, bool single) {
  const double most = single ? largest_single_error : largest_dot_error;
  const double least = (single ? single_rounding_of_loss : rounding_of_loss) * usual_scale(scales);
  std::erase_if(cases, [&](const DotCase& result) {
    return result.is_rounding || (result.relative_error > most && result.difference <= least);
  });
  return cases;
}

/// For a program whose solves leave residuals: the cases with solves iterated to rounding. Omits solves that do not
/// converge; empty if the program's text sets their tolerance.
std::vector<DotCase> told_when_solved(const SourceFile& source, const driver::Compiled& compiled,
                                      const std::string& name, bool single) {
  if (!compiled.problem) return {};
  const std::optional<driver::Compiled> again = compile_with_tangents(source, with_solves_done(compiled));
  const std::optional<TangentCode> tangent = again ? tangent_in(*again, name) : std::nullopt;
  if (!tangent || leaves_residuals(again->stencil.find_program(name)->body)) return {};
  std::vector<double> scales;
  std::vector<DotCase> cases = cases_of(*again, name, *tangent, single, scales);
  return telling(std::move(cases), scales, single);
}

/// Adds the errors of one program, or a note that it was not compared. Returns false with an error if they are too
/// large. For solves with many solutions or none, as between obstacles with made-up values, interpreter and runtime
/// differ. So a difference from the interpreted tangent is checked with a compiled one; `compiling` grows by the time
/// for that.
bool certify_program(const SourceFile& source, const driver::Compiled& compiled, const std::string& name,
                     QuickCertificate& worst, double& compiling, DiagnosticSink& sink) {
  const bool single = is_single(compiled, name);
  const double most = single ? largest_single_error : largest_dot_error;
  const std::optional<TangentCode> interpreted = interpreted_tangent(compiled, name);
  std::vector<double> scales;
  std::vector<DotCase> cases;
  if (interpreted) cases = cases_of(compiled, name, *interpreted, single, scales);
  std::vector<DotCase> told = telling(cases, scales, single);
  const auto is_wrong = [&](const DotCase& result) { return result.relative_error > most; };
  if (std::ranges::any_of(told, is_wrong)) {
    const double start = thread_cpu_seconds();
    const std::optional<TangentCode> other = compiled_tangent(source, compiled, name);
    compiling += thread_cpu_seconds() - start;
    if (other) told = telling(cases_of(compiled, name, *other, single, scales), scales, single);
  }
  const auto wrong = std::ranges::find_if(told, is_wrong);
  if (wrong != told.end() && leaves_residuals(compiled.stencil.find_program(name)->body)) {
    worst.left_out.push_back(
        fmt::format("program {}: its solves stop before they come to rounding: with what they leave tangent and "
                    "adjoint differ by {:.2e} on {} cells",
                    name, wrong->relative_error, wrong->grid));
    const double start = thread_cpu_seconds();
    told = told_when_solved(source, compiled, name, single);
    compiling += thread_cpu_seconds() - start;
    if (told.empty()) return true;
  }
  const bool found = interpreted.has_value(), is_compared = !told.empty();
  for (const DotCase& result : told) {
    if (is_wrong(result)) {
      sink.report(
          "verification-failed", {},
          {name, fmt::format("tangent and adjoint differ by {:.2e} on {} cells", result.relative_error, result.grid)},
          help_for(compiled));
      return false;
    }
    if (!worst.program.empty() && result.relative_error <= worst.dot_product) continue;
    worst.dot_product = result.relative_error;
    worst.program = name;
    worst.grid = result.grid;
  }
  if (!is_compared) {
    const char* const why = !found          ? "it has no tangent"
                            : cases.empty() ? "its derivatives are not finite on a few cells"
                                            : "its derivatives are below rounding on a few cells";
    worst.left_out.push_back(fmt::format("program {}: {}", name, why));
  }
  return true;
}

}  // namespace

double expected_seconds(const driver::Compiled& compiled) {
  double seconds = 0;
  for (const std::string& name : certified_programs(compiled)) {
    const stencil::Program& program = *compiled.stencil.find_program(name);
    const Size size = size_of(compiled.stencil, program.body);
    int cells = 0;
    for (const std::vector<int>& grid : quick_grids(program.axes.size(), compiled.stencil.networks)) {
      cells += std::accumulate(grid.begin(), grid.end(), 1, std::multiplies<>());
    }
    seconds += seconds_a_program + seconds_a_node * size.nodes + seconds_a_node_and_cell * size.executed * cells;
  }
  return seconds;
}

namespace {

QuickCertificate not_certified(const driver::Compiled& compiled, const std::string& why) {
  QuickCertificate result;
  result.run.untested = unknowns_of(compiled);
  result.left_out.push_back("everything: " + why);
  return result;
}

/// Compilation time without a cache; stored next to the code.
double seconds_from_nothing(const driver::Compiled& compiled, codegen::CodeCache* cache) {
  if (cache == nullptr) return compiled.seconds;
  const std::string key = compiled.cached.key + "\nseconds\n";
  double seconds = 0;
  if (!compiled.cached.is_from_cache) cache->store(key, fmt::format("{}", compiled.seconds));
  const std::optional<std::string> kept = compiled.cached.is_from_cache ? cache->find(key) : std::nullopt;
  return kept && read(*kept, seconds) && seconds > compiled.seconds ? seconds : compiled.seconds;
}

std::optional<QuickCertificate> found_in(codegen::CodeCache& cache, const std::string& key, double most) {
  const std::optional<std::string> kept = cache.find(key);
  return kept ? certificate_of(*kept, most) : std::nullopt;
}

}  // namespace

std::optional<QuickCertificate> certify_quickly(const SourceFile& source,
                                                const std::shared_ptr<const driver::Compiled>& compiled, Certifying how,
                                                DiagnosticSink& sink) {
  codegen::CodeCache* const cache = compiled->cached.key.empty() ? nullptr : compiled->options.cache.get();
  const double compiling = seconds_from_nothing(*compiled, cache);
  const double optimising = driver::has_quick_code(*compiled) ? compiling / quick_code : compiling;
  const double affordable = how == Certifying::always ? INFINITY : largest_share * optimising;
  if (how == Certifying::never || !compiled->code) return std::nullopt;
  if (std::ranges::any_of(compiled->stencil.networks,
                          [](const network::Network& network) { return network.is_host(); })) {
    return not_certified(*compiled, "a network of it is supplied by the host");
  }
  const double start = thread_cpu_seconds();
  const double most = compiled->is_single() ? largest_single_error : largest_dot_error;
  const std::string key = cache == nullptr ? "" : key_of(*compiled, source);
  const auto seconds = [&] { return thread_cpu_seconds() - start; };
  if (cache != nullptr && how == Certifying::when_cheap) {
    std::optional<QuickCertificate> kept = found_in(*cache, key, most);
    if (kept) kept->seconds = seconds();
    if (kept) return kept;
  }
  if (expected_seconds(*compiled) > affordable)
    return not_certified(*compiled, "it would take more than a tenth of the compilation; --certify does it");
  QuickCertificate result;
  double again = 0;  // seconds for compiling again
  for (const std::string& name : certified_programs(*compiled)) {
    if (!certify_program(source, *compiled, name, result, again, sink)) return std::nullopt;
  }
  result.run = check_run(source, compiled, affordable + again - seconds());
  if (!result.run.wrong.empty()) {
    sink.report("verification-failed", {}, {"task " + compiled->problem->task->name, result.run.wrong},
                help_for(*compiled));
    return std::nullopt;
  }
  result.left_out.insert(result.left_out.end(), result.run.left_out.begin(), result.run.left_out.end());
  if (cache != nullptr && !result.run.lacked_time && !result.run.is_in_doubt) cache->store(key, text_of(result));
  result.seconds = seconds();
  return result;
}

}  // namespace dpde::analysis
