// SPDX-License-Identifier: Apache-2.0
// Programs without `repeat`: each pass spelled out, as a person would have written it. What reads programs knows
// straight lines only.
//
//  - What a kernel writes with = in a pass is a field of its own: v in the first pass, then v_2, v_3, ... It lives as
//  long as
//    the pass.
//  - `swap u, v` in a repeat: from the end of the pass on, u means what v means then, in later passes and behind the
//  repeat.
//    Swaps of one repeat happen at once. An input of the program that means another field at its end is swapped with
//    it.
//  - A kernel that runs on other fields than its own is copied, once for each choice of fields: jacobi_2.
#pragma once

#include <set>
#include <string>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::ast {

constexpr int max_repeated_statements = 1024;  // of a program with repeats

struct Unrolled {
  File file;
  std::set<std::string> copies;  // names of kernels that were copied from others
};

/// Repeats that make no sense are reported, and taken as one pass.
Unrolled unrolled(const File& file, DiagnosticSink& sink);

}  // namespace dpde::ast
