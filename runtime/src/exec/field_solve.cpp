// SPDX-License-Identifier: Apache-2.0
#include "exec/field_solve.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <utility>

#include "base/processor_watch.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/solve_memory.h"
#include "dpde/runtime/unsolved.h"
#include "solve/operator/finite.h"
#include "solve/solver/solve_advice.h"

namespace dpde {
namespace {

/// On grids this small (used by certificates) the method of the scheme may be unsuitable although it suits larger
/// grids.
constexpr std::int64_t few_cells = 64;
constexpr std::int64_t most_of_second_try = 100'000;
constexpr std::int64_t tape_header = 64;  // bytes, one cache line

SolverMethod method_of(int32_t kind) {
  switch (kind) {
    case DPDE_SOLVE_AUTOMATIC: return SolverMethod::automatic;
    case DPDE_SOLVE_DIRECT: return SolverMethod::direct;
    case DPDE_SOLVE_TRIDIAGONAL: return SolverMethod::tridiagonal;
    case DPDE_SOLVE_FOURIER: return SolverMethod::fourier;
    case DPDE_SOLVE_MULTIGRID: return SolverMethod::multigrid;
    case DPDE_SOLVE_CG: return SolverMethod::cg;
    case DPDE_SOLVE_BICGSTAB: return SolverMethod::bicgstab;
    case DPDE_SOLVE_GMRES: return SolverMethod::gmres;
    default: throw Error(ErrorKind::run, fmt::format("no method of solves has the number {}", kind));
  }
}

Preconditioning preconditioning_of(int32_t kind) {
  switch (kind) {
    case DPDE_PRECONDITIONER_MULTIGRID: return Preconditioning::multigrid;
    case DPDE_PRECONDITIONER_NONE: return Preconditioning::none;
    default: return Preconditioning::automatic;
  }
}

SmootherKind smoother_of(int32_t kind) {
  switch (kind) {
    case DPDE_SMOOTHER_RED_BLACK: return SmootherKind::red_black;
    case DPDE_SMOOTHER_JACOBI: return SmootherKind::jacobi;
    case DPDE_SMOOTHER_CHEBYSHEV: return SmootherKind::chebyshev;
    default: return SmootherKind::automatic;
  }
}

SolveOptions options_of(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout) {
  return {
      .method = method_of(solve.method),
      .tolerance = solve.tolerance,
      .most_iterations = solve.most_iterations,
      .smoother = smoother_of(solve.smoother),
      .preconditioning = solve.network != nullptr ? Preconditioning::network : preconditioning_of(solve.preconditioner),
      .network = solve.network == nullptr ? "" : program.networks[solve.network->network]->name,
      .rounding = rounding_of(layout)};
}

OperatorKnowledge known_of(const dpde_solve& solve) {
  return {.is_symmetric = solve.is_symmetric != 0,
          .takes_constants_to_zero = solve.takes_constants_to_zero != 0,
          .sums_to_zero = solve.sums_to_zero != 0,
          .has_coefficients = solve.coefficient_count > 0};
}

/// Names of the coefficients and parameters of the operator.
std::vector<std::string> made_of(const dpde_solve& solve, const dpde_program& program) {
  std::vector<std::string> names;
  for (int32_t i = 0; i < solve.coefficient_count; ++i) names.emplace_back(program.fields[solve.coefficients[i]]);
  for (int32_t i = 0; i < solve.param_count; ++i) {
    if (solve.params[i] < program.param_count) names.emplace_back(program.params[solve.params[i]]);
  }
  return names;
}

}  // namespace

FieldSolve::FieldSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& layout,
                       std::shared_ptr<SolverShelf> shelf)
    : solve_(solve),
      layout_(with_three_axes(layout)),
      name_(program.fields[solve.unknowns[0]]),
      made_of_(made_of(solve, program)),
      shape_(shape_of(solve, layout)),
      wanted_(options_of(solve, program, layout_)),
      inputs_(solve, layout),
      probe_({layout_.cells[0], layout_.cells[1], layout_.cells[2]}, shape_.periodic,
             {solve_.reach[0], solve_.reach[1], solve_.reach[2]}, rounding_of(layout_), name_, known_of(solve_)),
      shelf_(std::move(shelf)),
      note_(&shelf_->add_note(name_)) {
  shape_.changes = has_changing_coefficients(solve, program);
}

std::vector<OwnedMemory> FieldSolve::memory(const std::string& owner) const {
  const SolveMemory all = memory_of(shape_);
  const auto vector = static_cast<std::int64_t>(cells_of(layout_) * sizeof(double));
  const std::int64_t guesses = solve_.guess_count * vector, own = 2 * vector + guesses;
  std::string operator_key =
      fmt::format("{} {} {:g} {} {} of {}", fmt::join(solve_.reach, " "), solve_.method, solve_.tolerance,
                  fmt::join(shape_.periodic, " "), fmt::join(made_of_, " "),
                  fmt::join(std::span(solve_.params, static_cast<std::size_t>(solve_.param_count)), " "));
  const char* of_all = "right sides and solutions";
  return {{.owner = of_all, .kept = 2 * vector, .shared = of_all},
          {.owner = of_all, .kept = guesses, .shared = fmt::format("{} guesses", solve_.guess_count)},
          {.owner = owner,
           .kept = static_cast<std::int64_t>(all.kept) - own,
           .making = static_cast<std::int64_t>(all.peak - all.kept),
           .shared = std::move(operator_key)}};
}

/// Reuses the memory of a spare solver's operator if no other object holds it.
void FieldSolve::find_operator(const LinearImage& image, LinearSolver* spare) {
  std::shared_ptr<GridOperator> found;
  if (spare != nullptr) found = std::const_pointer_cast<GridOperator>(spare->give_operator());
  if (found == nullptr || found.use_count() > 1) found = std::make_shared<GridOperator>();
  try {
    *found = probe_.find(image, std::move(*found), room_of_vectors());
  } catch (const NotFinite& error) {
    throw Unsolved({.text = error.what(), .advice = [] {
                      return std::string(
                          "look at the coefficients of its equation: one is no number, or far too large");
                    }});
  } catch (const Error& error) {
    throw Unsolved({.text = error.what()});
  }
  operator_ = std::move(found);
}

void FieldSolve::make_solver(void* const* fields, const std::function<void()>& apply) {
  const auto image = [&](std::span<const double> values, std::span<double> made) {
    write_cells(layout_, fields[solve_.unknowns[0]], values, shelf_->team());
    apply();
    read_cells(layout_, fields[solve_.images[0]], made, shelf_->team());
  };
  operator_.reset();
  drop_solver();  // on failure no solver for old coefficients remains
  std::shared_ptr<LinearSolver> spare =
      shelf_->take_spare(wanted_, {layout_.cells[0], layout_.cells[1], layout_.cells[2]});
  find_operator(std::ref(image), spare.get());
  options_ = wanted_;
  if (fits(options_.method, std::move(spare))) return;
  if (operator_->size() <= few_cells) {
    const std::string asked_for(name_of(options_.method));
    options_.method = SolverMethod::automatic;
    if (fits(options_.method)) {
      reason_.all += fmt::format("; {} does not fit", asked_for);
      return;
    }
  }
  SolveReport none;
  none.method = options_.method;
  none.residual = 1;
  read_right(fields);  // for the advice
  fail(why_not_, none);
}

/// Computed on demand: a search that continues with a shorter step does not need it. Copies share the system.
std::function<std::string()> FieldSolve::advice_for(const SolveReport& report) const {
  struct System {
    std::shared_ptr<const GridOperator> a;
    SolveOptions options;
    std::vector<double> right;
    SolveReport report;
  };
  const auto system = std::make_shared<const System>(System{operator_, options_, vectors_->right, report});
  return [system] { return advice_on(system->a, system->options, system->right, system->report); };
}

void FieldSolve::fail(const std::string& why, const SolveReport& report) const {
  throw Unsolved({.text = fmt::format("solve for {}: {}", name_, why),
                  .reason = why,
                  .method = std::string(name_of(report.method)),
                  .residual = report.residual,
                  .advice = advice_for(report)});
}

/// Tapes identify solvers by address, so they are cleared together with the solver. A solver that no other object holds
/// donates its memory to the next one.
void FieldSolve::drop_solver() {
  if (solver_ != nullptr && written_to_ != nullptr) written_to_->clear();
  shelf_->give_spare(std::exchange(solver_, nullptr), wanted_);
}

/// The vectors of solves are free before the right side is read, so the probe may use them. Before they exist, it
/// allocates its own and frees these before the solver is made.
ProbeRoom FieldSolve::room_of_vectors() const {
  if (vectors_ == nullptr) return {};
  return {vectors_->right, vectors_->solution};
}

/// Makes the solver; sets `why_not_` if the method does not suit the operator.
bool FieldSolve::fits(SolverMethod method, std::shared_ptr<LinearSolver> spare) {
  try {
    SolveOptions options = options_;
    options.method = method;
    solver_ = shelf_->solver_of(operator_, options, std::move(spare));
    operator_ = solver_->grid_operator();
    reason_.of_solver = solver_->reason();
    reason_.all = solver_->reason();
    return true;
  } catch (const Error& error) {
    why_not_ = error.what();
    return false;
  }
}

/// If the automatic method does not converge: by sparse factors, until the operator changes.
SolveReport FieldSolve::solve_again(const SolveReport& first) {
  const bool may =
      options_.method == SolverMethod::automatic && first.iterations > 0 && operator_->size() <= most_of_second_try;
  if (!may) return first;
  const std::shared_ptr<LinearSolver> before = solver_;
  drop_solver();
  if (!fits(SolverMethod::direct)) {
    solver_ = before;
    return first;
  }
  reason_.all =
      fmt::format("{} had not converged after {} iterations: sparse factors", name_of(first.method), first.iterations);
  std::ranges::fill(vectors_->solution, 0.0);
  return solver_->solve(vectors_->right, vectors_->solution);
}

std::int64_t FieldSolve::tape_bytes() const {
  const auto values = static_cast<std::int64_t>(cells_of(layout_)) * bytes_of_real(layout_);
  return tape_header + (values + tape_header - 1) / tape_header * tape_header;
}

/// Identifies the inputs of the solution, if tapes are in use.
FieldSolve::TapeKey FieldSolve::tape_key(void* const* fields) const {
  const bool is_written = written_to_ != nullptr && written_to_->is_recording();
  if (read_from_ == nullptr && !is_written) return {};
  const Team& team = shelf_->team();
  TapeKey key{.solver = solver_.get(), .hash = hash_of(layout_, fields[solve_.rights[0]], team)};
  for (int32_t i = 0; solver_->has_first_guess() && i < solve_.guess_count; ++i)
    key.hash = hash_of(layout_, fields[solve_.guesses[i]], team, key.hash);
  return key;
}

bool FieldSolve::find_on_tape(void* const* fields, const TapeKey& key) {
  if (read_from_ == nullptr) return false;
  char* const tape = read_from_->find([&](const char* other) { return std::memcmp(&key, other, sizeof key) == 0; });
  if (tape == nullptr) return false;
  copy_from_rows(layout_, tape + tape_header, fields[solve_.unknowns[0]], shelf_->team());
  read_from_->release(tape);
  return true;
}

void FieldSolve::keep_on_tape(void* const* fields, const TapeKey& key) {
  if (written_to_ == nullptr || !written_to_->is_recording()) return;
  char* const tape = written_to_->take();
  std::memcpy(tape, &key, sizeof key);
  copy_to_rows(layout_, fields[solve_.unknowns[0]], tape + tape_header, shelf_->team());
}

template <class Real>
std::optional<SolveReport> FieldSolve::solve_rows_as(void* const* fields) {
  const auto read = [&, from = fields[solve_.rights[0]]](std::int64_t first, std::span<Real> values) {
    read_rows<Real>(layout_, from, first, values);
  };
  const auto write = [&, to = fields[solve_.unknowns[0]]](std::int64_t first, std::span<const Real> values) {
    write_rows<Real>(layout_, to, first, values);
  };
  return solver_->solve_rows(ReadRowsOf<Real>(std::ref(read)), WriteRowsOf<Real>(std::ref(write)));
}

/// Solves directly on the fields, without copies.
bool FieldSolve::solve_rows(void* const* fields, bool is_counted) {
  if (solve_.rights[0] == solve_.unknowns[0]) return false;
  const ProcessorWatch solving(note_->seconds, shelf_->team());
  const auto report = solver_->has_floats() ? solve_rows_as<float>(fields) : solve_rows_as<double>(fields);
  if (report && is_counted) note(*report);
  return report.has_value();
}

void FieldSolve::run(void* const* fields, const double* params, const std::function<void()>& apply,
                     const std::function<void()>& precondition) {
  if (inputs_.have_changed(fields, params, shelf_->team())) drop_solver();
  const bool is_made = solver_ != nullptr;
  TapeKey key;
  if (is_made) {
    key = tape_key(fields);
    if (find_on_tape(fields, key)) return;
    if (solve_rows(fields)) return keep_on_tape(fields, key);
  }
  if (!is_made && is_finite(layout_, fields[solve_.rights[0]])) {  // before vectors exist: setup needs memory too
    const ProcessorWatch setup(note_->setup, shelf_->team());
    make_solver(fields, apply);
    key = tape_key(fields);
    if (find_on_tape(fields, key)) return;
  }
  const double factor = read_right(fields);
  if (factor == 0) {  // the run has blown up: its caller finds it in the result
    std::ranges::fill(vectors_->solution, std::nan(""));
    return write_cells(layout_, fields[solve_.unknowns[0]], vectors_->solution);
  }
  solve_cells(fields, factor, precondition);
  // The first solve, in double precision, has validated the series. It is repeated in single precision like all later
  // ones, so that results do not depend on the order of solves.
  if (!is_made && solver_->has_floats() && !solve_rows(fields, false))
    write_cells(layout_, fields[solve_.unknowns[0]], vectors_->solution, shelf_->team());
  keep_on_tape(fields, key);
}

/// Reads the right side, scaled to avoid overflow. Returns the factor; 0: a value is not finite.
double FieldSolve::read_right(void* const* fields) {
  if (vectors_ == nullptr) vectors_ = shelf_->vectors(cells_of(layout_), static_cast<std::size_t>(solve_.guess_count));
  read_cells(layout_, fields[solve_.rights[0]], vectors_->right, shelf_->team());
  const double factor = factor_into_range(vectors_->right, shelf_->team());
  if (factor != 0) multiply_all(vectors_->right, factor, shelf_->team());
  return factor;
}

void FieldSolve::solve_cells(void* const* fields, double factor, const std::function<void()>& precondition) {
  const Team& team = shelf_->team();
  if (solver_->has_first_guess()) read_guesses(fields);
  const auto search = [&](std::span<const double> left, std::span<double> towards) {
    write_cells(layout_, fields[solve_.network->inputs[0]], left, team);
    precondition();
    read_cells(layout_, fields[solve_.network->results[0]], towards, team);
  };
  const SolveReport report = solve_timed(std::ref(search));  // std::ref allocates nothing
  note(report);
  check(report);
  multiply_all(vectors_->solution, 1 / factor, team);
  write_cells(layout_, fields[solve_.unknowns[0]], vectors_->solution, team);
}

/// `search`: the network's search direction for a residual.
SolveReport FieldSolve::solve_timed(const VectorFunction& search) {
  const ProcessorWatch solving(note_->seconds, shelf_->team());
  if (solver_->has_first_guess()) begin();
  const SolveReport report = solver_->solve(vectors_->right, vectors_->solution, &search);
  return report.converged ? report : solve_again(report);
}

void FieldSolve::read_guesses(void* const* fields) {
  const std::size_t cells = vectors_->right.size();
  for (std::size_t i = 0; i * cells < guesses().size(); ++i)
    read_cells(layout_, fields[solve_.guesses[i]], guesses().subspan(i * cells, cells), shelf_->team());
}

void FieldSolve::begin() {
  if (guesses().empty()) {
    std::ranges::fill(vectors_->solution, 0.0);
  } else {
    solver_->begin(vectors_->right, guesses(), vectors_->solution);
  }
}

void FieldSolve::note(const SolveReport& report) {
  ++note_->solves;
  if (solver_->reason() != reason_.of_solver) {  // it continues in f64 if f32 was not accurate enough
    if (reason_.all.starts_with(reason_.of_solver)) reason_.all.replace(0, reason_.of_solver.size(), solver_->reason());
    reason_.of_solver = solver_->reason();
  }
  if (note_->reason != reason_.all) {
    note_->method = name_of(solver_->method());
    note_->reason = reason_.all;
  }
  note_->iterations += report.iterations;
  note_->unaided += report.unaided;
  note_->most_iterations = std::max(note_->most_iterations, report.iterations);
  const bool is_missed = !report.converged && solve_.warns != 0;
  const bool is_worst = is_missed && (note_->missed == 0 || report.residual > note_->residual);
  if (is_worst && operator_->size() <= most_cells_tried) note_->advice = advice_for(report);  // copies the system
  if (report.residual >= note_->residual) {
    note_->residual = report.residual;
    note_->tolerance = report.bound;
  }
  note_->out_of_reach.part = std::max(note_->out_of_reach.part, report.incompatible);
  const double by_rounding = rounding_of(layout_) > 1e-12 ? 1e-3 : 1e-6;
  if (report.is_least_squares && report.incompatible > by_rounding)
    note_->out_of_reach.of_least_squares = std::max(note_->out_of_reach.of_least_squares, report.incompatible);
  if (report.incompatible > by_rounding && solve_.takes_constants_to_zero == 0 && note_->out_of_reach.made_of.empty())
    note_->out_of_reach.made_of = made_of_;
  if (is_missed) ++note_->missed;
}

void FieldSolve::check(const SolveReport& report) const {
  if (!std::isfinite(report.residual))
    fail(fmt::format("the result of {} is not finite", name_of(report.method)), report);
  if (report.is_indefinite) fail("the operator is not definite, so that cg does not fit", report);
  if (report.is_singular)
    fail(fmt::format("the operator is singular, and {:.3g} of the right side is out of its reach", report.residual),
         report);
  if (!report.converged && solve_.warns == 0)
    fail(fmt::format("after {} iterations of {} the residual is {:.3g} of the right side, above the tolerance {:.3g}",
                     report.iterations, name_of(report.method), report.residual, report.bound),
         report);
}

}  // namespace dpde
