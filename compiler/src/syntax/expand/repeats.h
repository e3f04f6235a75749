// SPDX-License-Identifier: Apache-2.0
// Rewrites programs with repeats so that each field is written once: every name is replaced by its current field.
//
// - A field that a kernel writes with = in a pass lives until the end of the pass.
// - `swap u, v` in a repeat: from the end of the pass on, u denotes the value that v has then, in later passes and
//   after the repeat. The swaps of one repeat are simultaneous. If an input of the program denotes another field at its
//   end, it is swapped with that field.
// - So after `repeat 3 { ... swap u, v }` u is another field, u_2. The repeat gets `to u_2`, and kernels that then read
//   u are copied, once for each combination of fields.
// - A sum (inout) begun outside the repeat is a state of it, which is copied first. So is a field from outside that a
//   swap takes.
#pragma once

#include <set>
#include <string>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

struct ResolvedRepeats {
  File file;
  bool has_repeats = false;
  std::set<std::string> copies;  // kernels copied from others, or generated to copy fields
};

/// Invalid repeats are reported and treated as one pass.
ResolvedRepeats resolve_repeats(const File& file, DiagnosticSink& sink);

}  // namespace dpde::ast
