// SPDX-License-Identifier: Apache-2.0
// Lookup of the derivative of a value in a tangent or adjoint program: see dpde_link. Never depends on the spelling of
// names.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "dpde/kernel_abi.h"

namespace dpde {

inline std::span<const dpde_link> links_of(const dpde_program& derivative) {
  return {derivative.links, static_cast<std::size_t>(derivative.link_count)};
}

/// nullptr if the derivative has no link for it.
inline const dpde_link* find_link(const dpde_program& derivative, int kind, std::string_view primal) {
  for (const dpde_link& link : links_of(derivative)) {
    if (link.kind == kind && primal == link.primal) return &link;
  }
  return nullptr;
}

/// Index of its derivative; -1 if that is 0.
inline int find_derived(const dpde_program& derivative, int kind, std::string_view primal) {
  const dpde_link* const link = find_link(derivative, kind, primal);
  return link == nullptr ? -1 : link->derived;
}

/// Whether the link's field is an input of the adjoint: a seed, the adjoint of a field of the primal program.
inline bool is_seed_of_field(const dpde_program& adjoint, const dpde_link& link) {
  return link.kind == DPDE_LINK_FIELD && link.derived >= 0 && link.derived < adjoint.input_count;
}

/// Name of the rate of a field, parameter or sum in a tangent; "" if it has none.
inline std::string_view rate_in(const dpde_program& tangent, int kind, std::string_view primal) {
  const int derived = find_derived(tangent, kind, primal);
  if (derived < 0) return "";
  return kind == DPDE_LINK_FIELD   ? tangent.fields[derived]
         : kind == DPDE_LINK_PARAM ? tangent.params[derived]
                                   : tangent.sums[derived];
}

}  // namespace dpde
