// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/verify_solve.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "stencil/analyse/effects.h"

namespace dpde::stencil {

namespace {

/// The preconditioner's local fields must not have any other use.
void check_preconditioner(const Solve& solve, const std::string& all, std::vector<std::string>& misfits) {
  const NetworkCall& call = *solve.preconditioner;
  const bool is_flexible = solve.by.method == SolveMethod::cg || solve.by.method == SolveMethod::gmres;
  if (!solve.is_linear || solve.unknowns.size() != 1 || !is_flexible)
    misfits.push_back(
        fmt::format("solves for {} with a network as the preconditioner: one field, by cg or gmres", all));
  if (call.results.size() != 1)
    misfits.push_back(fmt::format("solves for {} along {} directions at once", all, call.results.size()));
  const std::vector<std::string> beside = fields_beside_residual(solve);
  for (const std::string& own : {call.inputs.front(), call.results.front()}) {
    const auto has_it = [&](const auto* fields) { return std::ranges::count(*fields, own) > 0; };
    if (std::ranges::any_of(std::vector{&beside, &solve.images, &solve.rights, &solve.unknowns, &solve.guesses},
                            has_it))
      misfits.push_back(fmt::format(
          "solves for {} with {} for what an iteration leaves or looks along, and something else", all, own));
  }
}

}  // namespace

std::vector<std::string> misfits_of(const Solve& solve) {
  std::vector<std::string> misfits;
  const std::string all = fmt::format("{}", fmt::join(solve.unknowns, ", "));
  if (solve.images.size() != solve.unknowns.size() || solve.rights.size() != solve.unknowns.size())
    misfits.push_back(fmt::format("solves for {}: as many images, right sides and unknowns", all));
  if (!(solve.by.tolerance > 0 && solve.by.tolerance < 1))
    misfits.push_back(
        fmt::format("solves for {} to the tolerance {}: it lies between 0 and 1", all, solve.by.tolerance));
  if (solve.preconditioner) check_preconditioner(solve, all, misfits);
  return misfits;
}

}  // namespace dpde::stencil
