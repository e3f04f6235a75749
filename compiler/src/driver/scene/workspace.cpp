// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/workspace.h"

#include <algorithm>
#include <array>

#include "codegen/network_table.h"
#include "dpde/runtime/layout.h"

namespace dpde::driver {

Workspace make_workspace(const model::Problem& problem, const codegen::CompiledModule& code,
                         const std::vector<int>& cells) {
  Workspace::Setup setup;
  std::array<std::int64_t, 3> halo{};
  std::int32_t real = DPDE_F64;
  for (const std::string& name : code.names()) {
    const dpde_program& program = *code.find(name);
    for (std::size_t a = 0; a < 3; ++a) halo[a] = std::max(halo[a], program.halo[a]);
    real = program.real;
  }
  std::vector<std::int64_t> counts;
  for (model::Axis axis : problem.axes) {
    if (!cells.empty()) axis.cells = cells[counts.size()];
    counts.push_back(axis.cells);
    setup.axes.push_back({axis.name, axis.low, axis.spacing(), axis.topology == Topology::periodic});
  }
  setup.layout = make_layout(counts, halo, real);
  setup.t_begin = problem.t_begin;
  setup.step = problem.step;
  for (const model::Parameter& param : problem.params) setup.params.push_back({param.name, param.value});
  for (const model::Control& control : problem.controls) setup.controls[control.name] = {control.every, control.values};
  for (const std::uint64_t seed : problem.noises()) setup.noises.push_back({model::noise_name(seed), seed});
  Workspace workspace(std::move(setup));
  // Includes networks whose terms were dropped, and those of hand-written programs without a problem.
  for (const network::Network& network : problem.networks)
    workspace.add_weights(*codegen::NetworkTable(network).get(), nullptr);
  for (const std::string& name : code.names()) {
    const dpde_program& program = *code.find(name);
    for (int n = 0; n < program.network_count; ++n) workspace.add_weights(*program.networks[n], nullptr);
  }
  for (const model::Coefficient& coefficient : problem.coefficients) {
    if (coefficient.is_control())
      workspace.add_control_field(coefficient.name, coefficient.every,
                                  static_cast<std::size_t>(problem.intervals(coefficient.every)));
  }
  return workspace;
}

}  // namespace dpde::driver
