// SPDX-License-Identifier: Apache-2.0
// Certification of hand-written programs without a scene: one run with random inputs on small grids.
#include <cmath>
#include <random>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/program_check.h"
#include "network/symmetrise.h"

namespace dpde::analysis {

namespace {

model::Problem problem_for(const stencil::Program& program, const std::vector<int>& cells) {
  model::Problem problem;
  constexpr const char* names[] = {"x", "y", "z"};
  for (std::size_t a = 0; a < program.axes.size(); ++a) {
    problem.axes.push_back({names[a], 0.0, static_cast<double>(cells[a]), cells[a], program.axes[a]});
  }
  problem.step = 0.1;
  return problem;
}

}  // namespace

std::vector<std::vector<int>> small_grids(std::size_t rank, const std::vector<network::Network>& networks) {
  std::vector<std::vector<int>> grids{{1, 1, 1}, {2, 3, 4}, {5, 1, 3}, {4, 5, 2}, {3, 3, 3}, {1, 6, 1}};
  if (rank == 1) grids = {{1}, {2}, {3}, {4}, {5}, {6}, {7}, {11}};
  if (rank == 2) grids = {{1, 1}, {2, 3}, {3, 5}, {5, 4}, {1, 7}, {6, 2}, {7, 1}};
  for (std::vector<int>& cells : grids) cells = network::grid_for(networks, cells);
  return grids;
}

Certificate certify_programs(const driver::Compiled& compiled, const CertifyOptions& options) {
  std::mt19937_64 random(options.seed + 20240229);
  Certificate certificate;
  for (const auto& [name, derived] : compiled.derived) {
    if (!derived.tangent || !derived.adjoint) continue;
    const stencil::Program& program = *compiled.stencil.find_program(name);
    std::vector<int> last;
    const auto check_on = [&](const std::vector<int>& cells) {
      return ProgramCheck(compiled, program, *derived.tangent, *compiled.code, problem_for(program, cells), {}, random);
    };
    for (const std::vector<int>& cells : small_grids(program.axes.size(), compiled.stencil.networks)) {
      const DotCase result = check_on(cells).dot_product();
      if (std::isfinite(result.relative_error)) {
        certificate.cases.push_back(result);
      } else {
        certificate.skipped.push_back(result.grid + " cells, " + name + ": values are not finite");
      }
      last = cells;
    }
    Certificate taylor;
    check_on(std::vector<int>(last.size(), 7)).taylor(taylor);
    // Of several programs, keeps the one with the slope farthest from 2.
    const auto distance = [](const Certificate& c) {
      return c.slope ? std::abs(*c.slope - 2) : c.only_rounding ? -1.0 : INFINITY;
    };
    if (certificate.remainders.empty() || distance(taylor) > distance(certificate)) {
      certificate.slope = taylor.slope;
      certificate.only_rounding = taylor.only_rounding;
      certificate.remainders = taylor.remainders;
      certificate.note = name;
    }
  }
  return certificate;
}

}  // namespace dpde::analysis
