// SPDX-License-Identifier: Apache-2.0
#include "report/scene/solves.h"

namespace dpde::report {

Json json_of(const std::vector<driver::SolveReport>& solves) {
  Json result = Json::array();
  for (const driver::SolveReport& solve : solves) {
    const SolveNote& note = solve.note;
    result.push_back({{"field", solve.field},
                      {"method", note.method},
                      {"reason", note.reason},
                      {"solves", note.solves},
                      {"iterations", note.iterations},
                      {"most_iterations", note.most_iterations},
                      {"unaided", note.unaided},
                      {"residual", json_number(note.residual)},
                      {"tolerance", note.tolerance},
                      {"cpu_s", note.seconds},
                      {"setup_s", note.setup},
                      {"guess", solve.guess},
                      {"incompatible", json_number(note.out_of_reach.part)}});
  }
  return result;
}

}  // namespace dpde::report
