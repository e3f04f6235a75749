// SPDX-License-Identifier: Apache-2.0
#include "driver/report/solve_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "stencil/walk.h"

namespace dpde::driver {

namespace {

/// The solve for a field, also inside repeats; null if there is none.
const stencil::Solve* find_solve(const std::vector<stencil::Statement>& statements, const std::string& unknown) {
  const auto is_it = [&](const stencil::Solve& solve) { return solve.unknowns.front() == unknown; };
  return find_kind<stencil::Solve>(statements, is_it, Blocks::passes);
}

/// Merges notes: all stages of a step solve the same equation.
void add_note(SolveNote& to, const SolveNote& note) {
  to.solves += note.solves;
  to.iterations += note.iterations;
  to.unaided += note.unaided;
  to.missed += note.missed;
  to.seconds += note.seconds;
  to.setup += note.setup;
  to.most_iterations = std::max(to.most_iterations, note.most_iterations);
  to.out_of_reach.part = std::max(to.out_of_reach.part, note.out_of_reach.part);
  if (to.out_of_reach.made_of.empty()) to.out_of_reach.made_of = note.out_of_reach.made_of;
  if (note.residual < to.residual) return;
  to.residual = note.residual;
  to.tolerance = note.tolerance;
  if (note.advice) to.advice = note.advice;
}

}  // namespace

namespace {

/// Searches the step first, then all programs: solves of adjoints have their own unknowns.
const stencil::Solve* find_solve(const Compiled& compiled, const std::string& unknown) {
  const stencil::Program& step = *compiled.stencil.find_program(compiled.step_name());
  const stencil::Solve* found = find_solve(step.body, unknown);
  for (std::size_t i = 0; found == nullptr && i < compiled.stencil.programs.size(); ++i)
    found = find_solve(compiled.stencil.programs[i].body, unknown);
  return found;
}

/// "psi_last and a formula of the model"; "" if none.
std::string begun_with(const Compiled& compiled, const stencil::Solve& solve) {
  std::vector<std::string> names;
  for (const std::string& guess : solve.guesses) {
    const bool is_of_model = compiled.problem && compiled.problem->program.empty();
    const bool is_named = !is_of_model || compiled.problem->find_state(guess) != nullptr;
    const std::string name = is_named ? guess : "a formula of the model";
    if (names.empty() || names.back() != name) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, " and "));
}

/// CPU time, so that it also shows savings of an initial guess.
std::string times_of(const SolveNote& note) {
  const double each = note.seconds / static_cast<double>(std::max<std::int64_t>(note.solves, 1));
  return fmt::format("{:.3g} ms a solve, {:.3g} ms to set up", 1e3 * each, 1e3 * note.setup);
}

}  // namespace

SourceRange place_of_solve(const Compiled& compiled, const std::string& unknown) {
  const auto watched = std::ranges::find(compiled.watched, unknown, &Watched::field);
  if (watched != compiled.watched.end()) return watched->origin.range;
  const stencil::Solve* solve = unknown.empty() ? nullptr : find_solve(compiled, unknown);
  return solve == nullptr ? SourceRange{} : solve->written.range;
}

std::vector<SolveReport> solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes) {
  const bool is_asked = compiled.problem && model::is_asked_for(compiled.problem->scheme.guess);
  std::vector<SolveReport> reports;
  for (const SolveNote& note : notes) {
    if (note.solves == 0) continue;
    const std::string first = note.unknown.substr(0, note.unknown.find(','));
    const stencil::Solve* solve = find_solve(compiled, first);
    const std::string field = solve != nullptr && !solve->written.field.empty() ? solve->written.field : note.unknown;
    const SourceRange range = solve != nullptr ? solve->written.range : SourceRange{};
    const auto same = std::ranges::find_if(reports, [&](const SolveReport& other) {
      return other.field == field && other.note.method == note.method && other.note.reason == note.reason;
    });
    if (same == reports.end()) {
      reports.push_back({field, range, solve != nullptr ? begun_with(compiled, *solve) : "", note, is_asked});
    } else {
      add_note(same->note, note);
    }
  }
  return reports;
}

std::vector<SolveReport> adjoint_solves_of(const Compiled& compiled, const std::deque<SolveNote>& notes) {
  std::vector<SolveReport> reports = solves_of(compiled, notes);
  for (SolveReport& report : reports) {
    report.is_adjoint = true;
    report.field = "the adjoint of " + report.field;
  }
  return reports;
}

std::string text_of(const std::vector<SolveReport>& solves, SolveTimes times) {
  std::string text;
  for (const SolveReport& solve : solves) {
    const int most = solve.note.most_iterations;
    const double mean =
        static_cast<double>(solve.note.iterations) / static_cast<double>(std::max<std::int64_t>(solve.note.solves, 1));
    const bool is_idle = solve.is_guess_asked_for && !solve.guess.empty();
    const std::string guess = solve.guess.empty() ? "" : fmt::format(", beginning with {}", solve.guess);
    const std::string unaided =
        solve.note.unaided == 0 ? "" : fmt::format(", without the network in {} of all", solve.note.unaided);
    text +=
        fmt::format("solve for {}: {} ({}){}{}\n", solve.field, solve.note.method, solve.note.reason,
                    most > 0  ? fmt::format("; {:.1f} iterations a solve, at most {}{}{}", mean, most, unaided, guess)
                    : is_idle ? fmt::format("; nothing begins with {}", solve.guess)
                              : "",
                    times == SolveTimes::shown ? "; " + times_of(solve.note) : "");
  }
  return text;
}

std::string times_text(const std::vector<SolveReport>& solves) {
  std::string text;
  for (const SolveReport& solve : solves) text += fmt::format("  for {}: {}\n", solve.field, times_of(solve.note));
  return text;
}

namespace {

/// Advice on the method, found by trials; if there are too many cells for trials, from known iteration counts.
std::string what_solves(const SolveNote& note) {
  const std::string tried = note.advice ? note.advice() : "";
  if (!tried.empty() || !(note.residual < 1)) return tried;
  return fmt::format("a tolerance of {:.1g} is what these iterations come to", 2 * note.residual);
}

}  // namespace

void report_solves(const model::Problem& problem, const std::vector<SolveReport>& solves, DiagnosticSink& sink) {
  const double rounding = problem.scheme.real == Precision::f32 ? 1e-3 : 1e-6;
  for (const SolveReport& solve : solves) {
    const SolveNote& note = solve.note;
    if (note.missed > 0)
      sink.report("tolerance-missed", solve.range,
                  {solve.field, fmt::format("{}", note.missed), fmt::format("{}", note.solves),
                   fmt::format("{:.3g}", note.residual), fmt::format("{:.3g}", note.tolerance)},
                  what_solves(note));
    if (solve.is_adjoint) continue;  // its unreachable part can be changed by no right-hand side
    const bool is_constraint = problem.find_projection(solve.field) != nullptr;  // reported by W0807
    if (!(note.out_of_reach.part > rounding) || is_constraint) continue;
    sink.report("incompatible-right-side", solve.range, {solve.field, fmt::format("{:.3g}", note.out_of_reach.part)},
                "a part without a solution, as the mean for a Laplacian on periodic axes or between walls without "
                "values, is left "
                "out: take it off the right side yourself, or give the field a value at a wall");
  }
}

}  // namespace dpde::driver
