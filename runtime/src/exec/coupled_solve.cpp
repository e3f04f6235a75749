// SPDX-License-Identifier: Apache-2.0
#include "exec/coupled_solve.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/processor_watch.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "solve/operator/finite.h"

namespace dpde {

namespace {

CoupledMatrix::Method coupled_method_of(const dpde_solve& solve, const std::string& names) {
  switch (solve.method) {
    case DPDE_SOLVE_AUTOMATIC: return CoupledMatrix::Method::automatic;
    case DPDE_SOLVE_DIRECT: return CoupledMatrix::Method::direct;
    case DPDE_SOLVE_BICGSTAB: return CoupledMatrix::Method::bicgstab;
    default: break;
  }
  throw Error(ErrorKind::run,
              fmt::format("solve for {}: the method does not fit several fields at once, nor a step of Newton's "
                          "method; take direct or bicgstab",
                          names));
}

}  // namespace

void FieldGroup::read(void* const* fields, std::span<double> values) const {
  for (std::size_t i = 0; i < numbers_.size(); ++i)
    read_cells(layout_, fields[numbers_[i]], values.subspan(i * cells_, cells_));
}
void FieldGroup::write(void* const* fields, std::span<const double> values) const {
  for (std::size_t i = 0; i < numbers_.size(); ++i)
    write_cells(layout_, fields[numbers_[i]], values.subspan(i * cells_, cells_));
}

std::string names_of_unknowns(const dpde_solve& solve, const dpde_program& program) {
  std::string names;
  for (int32_t i = 0; i < solve.count; ++i)
    names += (i == 0 ? "" : ", ") + std::string(program.fields[solve.unknowns[i]]);
  return names;
}

double largest_size(std::span<const double> values) {
  double most = 0;
  for (const double value : values) most = std::isnan(value) ? value : std::max(most, std::abs(value));
  return most;
}

CoupledSolve::CoupledSolve(const dpde_solve& solve, const dpde_program& program, const dpde_layout& given,
                           SolveNote& note)
    : names_(names_of_unknowns(solve, program)), inputs_(solve, given), note_(&note) {
  const dpde_layout layout = with_three_axes(given);
  images_ = {solve.images, solve.count, layout};
  rights_ = {solve.rights, solve.count, layout};
  unknowns_ = {solve.unknowns, solve.count, layout};
  CoupledShape shape{.periodic = periodic_axes(solve, given), .unknowns = solve.count};
  std::copy_n(layout.cells, 3, shape.cells.begin());
  std::copy_n(solve.reach, 3, shape.reach.begin());
  matrix_ = std::make_shared<CoupledMatrix>(shape, coupled_method_of(solve, names_), solve.tolerance);
  near_ = std::max(std::sqrt(rounding_of(layout)), 10 * solve.tolerance);
  note_->method = matrix_->has_factors() ? "direct" : "bicgstab";
  note_->reason = matrix_->has_factors() ? "several fields at once: sparse factors"
                                         : "a wide band: BiCGStab, preconditioned by incomplete factors";
  for (auto* values : {&right_, &solution_, &left_, &correction_}) values->assign(unknowns_.size(), 0.0);
}

std::vector<OwnedMemory> CoupledSolve::memory(const std::string& owner) const {
  if (matrix_ == nullptr) return {};
  const std::size_t values = right_.size() + solution_.size() + left_.size() + correction_.size();
  return {{.owner = owner,
           .kept = matrix_->bytes() + static_cast<std::int64_t>(values * sizeof(double)),
           .making = matrix_->bytes_of_making()}};
}

void CoupledSolve::fail(const std::string& why, const char* advice, double residual) const {
  throw Unsolved({.text = fmt::format("solve for {}: {}", names_, why),
                  .reason = why,
                  .method = note_->method,
                  .residual = residual,
                  .advice = [advice] { return std::string(advice); }});
}

void CoupledSolve::run(void* const* fields, const double* params, const std::function<void()>& apply) {
  rights_.read(fields, right_);
  const double factor = factor_into_range(right_);
  if (factor == 0) {  // the run has blown up: its caller finds it in the result
    std::ranges::fill(solution_, std::nan(""));
    return unknowns_.write(fields, solution_);
  }
  multiply_all(right_, factor);
  const bool has_changed = inputs_.have_changed(fields, params);
  if (has_changed || !is_made_) {
    const auto image = [&](std::span<const double> values, std::span<double> made) {
      unknowns_.write(fields, values);
      apply();
      images_.read(fields, made);
    };
    const ProcessorWatch setup(note_->setup);
    is_made_ = false;  // stays false if make() throws
    is_made_ = matrix_->make(std::ref(image));
    if (!is_made_) fail("the operator is singular or not finite", "take a shorter step, or other first values", NAN);
  }
  const ProcessorWatch solving(note_->seconds);
  if (!matrix_->solve(right_, solution_))
    fail("BiCGStab does not come to the tolerance", "take direct, or a shorter step", NAN);
  refine(fields, apply);
  multiply_all(solution_, 1 / factor);
  unknowns_.write(fields, solution_);
  ++note_->solves;
}

/// One step of iterative refinement with the residual computed by the operations. This also checks that the matrix
/// agrees with the operations.
void CoupledSolve::refine(void* const* fields, const std::function<void()>& apply) {
  unknowns_.write(fields, solution_);
  apply();
  images_.read(fields, left_);
  for (std::size_t i = 0; i < left_.size(); ++i) left_[i] = right_[i] - left_[i];
  matrix_->solve(left_, correction_);
  const double change = largest_size(correction_), size = largest_size(solution_);
  if (!(change <= near_ * size))
    fail(fmt::format("the operator applied to the solution is off by {:.3g} of it: it is nearly singular",
                     change / size),
         "take a shorter step, or other first values", change / size);
  for (std::size_t i = 0; i < solution_.size(); ++i) solution_[i] += correction_[i];
}

}  // namespace dpde
