// SPDX-License-Identifier: Apache-2.0
#include "stability/report/known_networks.h"

#include <algorithm>
#include <iterator>

#include "stability/frozen/zero_step.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

bool is_known(const Module& module, const NetworkCall& call) {
  const auto network = std::ranges::find(module.networks, call.network, &network::Network::name);
  return call.mode == NetworkCall::Mode::value && network != module.networks.end() && !network->is_host();
}

/// Networks in blocks of solves stay: such blocks are not analysed.
void take_out_networks(const Module& module, std::vector<Statement>& body, std::set<std::string>& results) {
  const auto add_results = [&](const NetworkCall& call) {
    if (!is_known(module, call)) return;
    for (const std::string& result : fields_written(call)) results.insert(result);
  };
  for_each_kind<NetworkCall>(body, add_results, Blocks::passes);
  const auto is_out = [&](const Statement& statement) {
    bool is_known_call = false;
    match_some(statement, [&](const NetworkCall& call) { is_known_call = is_known(module, call); });
    return is_known_call;
  };
  erase_statements(body, is_out, Blocks::passes);
}

}  // namespace

Module without_known_networks(Module module, std::set<std::string>& results) {
  Program& program = module.programs.front();
  std::vector<Statement> body = std::move(program.body);
  take_out_networks(module, body, results);
  program.body = std::move(body);
  return module;
}

std::map<std::string, std::vector<double>> values_of_networks(driver::Session& session,
                                                              const std::set<std::string>& results, double t) {
  if (results.empty()) return {};
  const Module& module = session.compiled().stencil;
  std::vector<Statement> body = module.find_program(session.compiled().step_name())->body;
  std::set<std::string> made;  // a step of another scheme has more stages, with outputs that this one lacks
  take_out_networks(module, body, made);
  std::vector<std::string> fields;
  std::ranges::set_intersection(results, made, std::back_inserter(fields));
  return after_step_of_no_length(session, fields, t, CoarseGrid::own(session.axes()));
}

}  // namespace dpde::stability
