// SPDX-License-Identifier: Apache-2.0
#include "solve/solver/solve_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

constexpr double too_many = 20;  // times the iterations that were made

bool solves(const std::shared_ptr<const GridOperator>& a, const SolveOptions& options, std::span<const double> right) {
  std::vector<double> x(right.size(), 0.0);
  try {
    const SolveReport report = LinearSolver(a, options).solve(right, x);
    return report.converged && !report.is_indefinite && !report.is_singular;
  } catch (const Error&) {  // the method does not suit the operator
    return false;
  }
}

/// Number of iterations needed at the observed convergence rate; 0: unknown.
double enough_iterations(const SolveReport& failed) {
  if (failed.iterations == 0 || !(failed.residual < 1) || !(failed.bound > 0)) return 0;
  return std::ceil(failed.iterations * std::log(failed.bound) / std::log(failed.residual));
}

std::vector<std::string> others_that_solve(const std::shared_ptr<const GridOperator>& a, SolveOptions options,
                                           std::span<const double> right, SolverMethod failed) {
  std::vector<std::string> found;
  for (const SolverMethod method :
       {SolverMethod::cg, SolverMethod::bicgstab, SolverMethod::gmres, SolverMethod::direct}) {
    if (method == failed) continue;
    options.method = method;
    if (solves(a, options, right)) found.emplace_back(name_of(method));
  }
  return found;
}

/// "cg, gmres or direct"
std::string one_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " or " : ", ") + names[i];
  return text;
}

}  // namespace

/// First suggests another preconditioner, else a method that works without one.
static std::string advice_without_network(const std::shared_ptr<const GridOperator>& a, SolveOptions options,
                                          std::span<const double> right, const SolveReport& failed) {
  const std::string network = std::exchange(options.network, {});
  options.method = failed.method;
  options.preconditioning = Preconditioning::automatic;
  if (solves(a, options, right)) return fmt::format("leave the preconditioner {} out", network);
  return advice_on(a, options, right, failed);
}

std::string advice_on(const std::shared_ptr<const GridOperator>& a, const SolveOptions& options,
                      std::span<const double> right, const SolveReport& failed) {
  if (failed.is_singular)
    return "a part without a solution, as the mean for a Laplacian on periodic axes or between walls without values, "
           "is to be "
           "taken off the right side; or give the field a value at a wall";
  if (a->size() > most_cells_tried) return {};
  if (options.preconditioning == Preconditioning::network) return advice_without_network(a, options, right, failed);
  const std::vector<std::string> others = others_that_solve(a, options, right, failed.method);
  const std::string instead = others.empty() ? "" : "take " + one_of(others);
  if (options.preconditioning == Preconditioning::none) {
    SolveOptions preconditioned = options;
    preconditioned.preconditioning = Preconditioning::automatic;
    if (solves(a, preconditioned, right)) return "take preconditioner = automatic";
  }
  if (failed.iterations == 0 || failed.is_indefinite)
    return instead.empty()
               ? "no method solves it: the operator is singular, or nearly so; look at its coefficients and "
                 "boundaries, or take a shorter step"
               : instead;
  const double enough = enough_iterations(failed);
  SolveOptions more = options;
  more.method = failed.method;
  more.most_iterations = static_cast<int>(std::ceil(1.5 * enough));
  if (enough > 0 && enough <= too_many * failed.iterations && solves(a, more, right)) {
    const std::string text = fmt::format("at this rate {} are enough: solve = {}({:g}, {})", enough,
                                         name_of(failed.method), options.tolerance, more.most_iterations);
    return instead.empty() || enough <= 2 * failed.iterations ? text : fmt::format("{}; or {}", text, instead);
  }
  if (!instead.empty()) return "it does not converge: " + instead;
  return failed.residual < 1e-3
             ? fmt::format("no method comes closer: take a tolerance of {:.1g}", 2 * failed.residual)
             : "no method solves it: the operator is singular, or nearly so; look at its coefficients and boundaries, "
               "or take a shorter step";
}

}  // namespace dpde
