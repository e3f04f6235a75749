// SPDX-License-Identifier: Apache-2.0
#include "model/scheme.h"

#include "support/assert.h"

namespace dpde::model {

const char* name_of(Split::Terms terms) {
  switch (terms) {
    case Split::Terms::advect: return "advect";
    case Split::Terms::sources: return "sources";
    case Split::Terms::diffusion: return "diffusion";
  }
  unreachable("terms");
}

const char* name_of(Guess guess) {
  switch (guess) {
    case Guess::automatic: return "automatic";
    case Guess::none: return "none";
    case Guess::last: return "last";
    case Guess::extrapolate: return "extrapolate";
  }
  unreachable("a guess");
}

const char* name_of(Project project) {
  switch (project) {
    case Project::automatic: return "automatic";
    case Project::stage: return "stage";
    case Project::step: return "step";
  }
  unreachable("kind of projection");
}

Scheme with_differences(Scheme scheme) {
  const auto make_central = [](Transport& transport) {
    if (is_semi_lagrangian(transport.advect)) transport = {};
  };
  make_central(scheme.transport);
  for (auto& [state, own] : scheme.transports) make_central(own);
  return scheme;
}

}  // namespace dpde::model
