// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/solve_tolerance.h"

#include <algorithm>

#include "dpde/runtime/error.h"
#include "driver/scene/inverse.h"
#include "model/print/print_model.h"

namespace dpde::analysis {

namespace {

constexpr double how_much_larger = 100, tightest = 1e-13;
constexpr int enough_iterations = 1000;  // for a solve that was stopped early

struct Found {
  Eigen::VectorXd gradient;
  bool solves = false, is_by_steps = false;
  double left = 0;  // relative residual of a solve that was stopped early
};

std::optional<Found> gradient_of(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                                 const driver::SessionOptions& options) {
  DiagnosticSink silent;
  const auto session = driver::Session::open(source, compiled, options, silent);
  const auto inverse = session ? driver::Inverse::open(*session, source, silent) : nullptr;
  if (!inverse) return std::nullopt;
  Found found{Eigen::VectorXd(inverse->size())};
  inverse->value_and_gradient(inverse->start(), found.gradient);
  for (const auto& notes : {session->rollout().solve_notes(), session->rollout().adjoint_solve_notes()}) {
    for (const SolveNote& note : notes) {
      found.solves = found.solves || note.solves > 0;
      if (note.missed > 0) found.left = std::max(found.left, note.residual);
      found.is_by_steps = found.is_by_steps || (note.most_iterations > 0 && note.method != "newton");
    }
  }
  return found.gradient.allFinite() ? std::optional(found) : std::nullopt;
}

/// The same with another tolerance. A solve that cannot reach it because of rounding is no error.
std::optional<Found> gradient_with(const SourceFile& source, const driver::Compiled& compiled, SolveBy by,
                                   const driver::SessionOptions& session) {
  driver::CompileOptions options = compiled.options;
  by.most_iterations *= 2;
  by.warns = true;
  options.selection.overrides["solve"] = model::print(by);
  DiagnosticSink silent;
  std::optional<driver::Compiled> other = driver::compile(source, options, silent);
  if (!other) return std::nullopt;
  return gradient_of(source, std::make_shared<driver::Compiled>(std::move(*other)), session);
}

}  // namespace

driver::CompileOptions with_solves_done(const driver::Compiled& compiled) {
  SolveBy by = compiled.problem->scheme.solve;
  by.method = SolveMethod::automatic;
  by.tolerance = std::min(by.tolerance, SolveBy{}.tolerance);
  by.most_iterations = std::max(by.most_iterations, enough_iterations);
  by.warns = false;
  driver::CompileOptions options = compiled.options;
  options.selection.overrides["solve"] = model::print(by);
  options.after = {};
  return options;
}

bool has_loose_solves(const driver::Compiled& compiled) {
  if (!compiled.problem) return false;
  const SolveBy& by = compiled.problem->scheme.solve;
  return !by.warns && by.tolerance > SolveBy{}.tolerance;
}

std::optional<ToleranceEffect> effect_of_tolerance(const SourceFile& source,
                                                   const std::shared_ptr<const driver::Compiled>& compiled,
                                                   const CertifyOptions& options) {
  if (!compiled->problem) return std::nullopt;
  const SolveBy& by = compiled->problem->scheme.solve;
  driver::SessionOptions session;
  session.trusts_signs = true;  // the certificate has checked them
  session.threads = options.threads;
  session.stop = options.stop;
  session.window = options.window;
  try {
    const std::optional<Found> own = gradient_of(source, compiled, session);
    if (!own || !own->solves) return std::nullopt;
    ToleranceEffect effect{by.tolerance, own->is_by_steps};
    effect.left = own->left;
    if (!own->is_by_steps) return effect;
    const bool is_measured = std::max(by.tolerance, own->left) > how_much_larger * tightest;
    SolveBy other_by = by;
    other_by.tolerance = is_measured ? tightest : how_much_larger * by.tolerance;
    if (own->left > 0) other_by.method = SolveMethod::automatic;
    if (own->left > 0) other_by.most_iterations = std::max(by.most_iterations, enough_iterations);
    const std::optional<Found> other = gradient_with(source, *compiled, other_by, session);
    if (!other) return std::nullopt;
    if (is_measured) effect.reference = other_by.tolerance;
    const double size = is_measured ? other->gradient.norm() : how_much_larger * own->gradient.norm();
    effect.error = size == 0 ? 0 : (other->gradient - own->gradient).norm() / size;
    effect.bound = effect.error * (is_measured ? 1.1 : how_much_larger);
    return effect;
  } catch (const Error&) {  // the certificate reports failures
    return std::nullopt;
  }
}

}  // namespace dpde::analysis
