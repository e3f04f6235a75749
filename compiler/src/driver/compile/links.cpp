// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/links.h"

#include "support/assert.h"

namespace dpde::driver {

namespace {

using Kind = adjoint::Link::Kind;

int table_kind(Kind kind) {
  switch (kind) {
    case Kind::field: return DPDE_LINK_FIELD;
    case Kind::param: return DPDE_LINK_PARAM;
    case Kind::sum: return DPDE_LINK_SUM;
  }
  unreachable("kind of link");
}

/// Kind of the derivative value of a value of `kind`.
Kind derived_kind(const adjoint::Derivative& derivative, Kind kind) {
  if (!derivative.is_adjoint || kind == Kind::field) return kind;
  return kind == Kind::param ? Kind::sum : Kind::param;
}

LinkedProgram linked(const adjoint::Derivative& derivative) {
  LinkedProgram result{derivative.program, {}};
  for (const adjoint::Link& link : derivative.links) {
    result.links.push_back(
        {table_kind(link.kind), link.primal, table_kind(derived_kind(derivative, link.kind)), link.derived});
  }
  return result;
}

}  // namespace

std::vector<LinkedProgram> linked_programs(const Compiled& compiled) {
  std::vector<LinkedProgram> programs;
  for (const auto& [name, derived] : compiled.derived) {
    for (const auto* each :
         {&derived.tangent, &derived.adjoint, &derived.second, &derived.gauss_newton, &derived.gauss_newton_adjoint}) {
      if (*each && compiled.stencil.find_program((*each)->program) != nullptr) programs.push_back(linked(**each));
    }
  }
  for (const AdjointVariant& variant : compiled.variants) {
    programs.push_back(linked(*compiled.derived.at(compiled.step_name()).adjoint));
    programs.back().program = variant.adjoint;
  }
  return programs;
}

}  // namespace dpde::driver
