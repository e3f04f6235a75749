// SPDX-License-Identifier: Apache-2.0
// Programs with repeats whose fields are written once: each name of a person becomes the field that it means there.
//
//  - What a kernel writes with = in a pass lives as long as the pass.
//  - `swap u, v` in a repeat: from the end of the pass on, u means what v means then, in later passes and behind the
//    repeat. Swaps of one repeat happen at once. An input of the program that means another field at its end is swapped
//    with it.
//  - So behind `repeat 3 { ... swap u, v }` u is another field, u_2: the repeat has `to u_2`, and kernels that read u
//    there are copied, once for each choice of fields.
//  - What is added to (inout) from outside the repeat is a state of it that is copied first, and so is what a swap
//    takes from outside of it.
#pragma once

#include <set>
#include <string>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

struct ResolvedRepeats {
  File file;
  bool has_repeats = false;
  std::set<std::string> copies;  // names of kernels that were copied from others, or made to copy fields
};

/// Repeats that make no sense are reported, and taken as one pass.
ResolvedRepeats resolve_repeats(const File& file, DiagnosticSink& sink);

}  // namespace dpde::ast
