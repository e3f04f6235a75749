// SPDX-License-Identifier: Apache-2.0
// What a value of a program became in its tangent or adjoint: see dpde_link. Nothing here looks at the letters of a
// name.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "dpde/kernel_abi.h"

namespace dpde {

inline std::span<const dpde_link> links_of(const dpde_program& derivative) {
  return {derivative.links, static_cast<std::size_t>(derivative.link_count)};
}

/// nullptr where the derivative says nothing of it.
inline const dpde_link* find_link(const dpde_program& derivative, int kind, std::string_view primal) {
  for (const dpde_link& link : links_of(derivative)) {
    if (link.kind == kind && primal == link.primal) return &link;
  }
  return nullptr;
}

/// Its index in the derivative; -1 where nothing acts through it.
inline int find_derived(const dpde_program& derivative, int kind, std::string_view primal) {
  const dpde_link* const link = find_link(derivative, kind, primal);
  return link == nullptr ? -1 : link->derived;
}

/// Whether an adjoint reads there what is to be known of a field of its primal.
inline bool is_seed_of_field(const dpde_program& adjoint, const dpde_link& link) {
  return link.kind == DPDE_LINK_FIELD && link.derived >= 0 && link.derived < adjoint.input_count;
}

/// What a tangent calls the rate of a field, parameter or sum; "" where it has none.
inline std::string_view rate_in(const dpde_program& tangent, int kind, std::string_view primal) {
  const int derived = find_derived(tangent, kind, primal);
  if (derived < 0) return "";
  return kind == DPDE_LINK_FIELD   ? tangent.fields[derived]
         : kind == DPDE_LINK_PARAM ? tangent.params[derived]
                                   : tangent.sums[derived];
}

}  // namespace dpde
