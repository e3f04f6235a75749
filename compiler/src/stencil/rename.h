// SPDX-License-Identifier: Apache-2.0
// Copies of a block of statements with some fields renamed.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

struct Renaming {
  std::map<std::string, std::string> fields;                  // other fields keep their names
  std::function<std::string(const std::string&)> new_kernel;  // returns a free name for a copy of the kernel

  const std::string& field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? name : found->second;
  }
};

/// The statements with the fields renamed, in nested blocks too. Each kernel that they run is copied to `kernels` once,
/// without its custom adjoints.
std::vector<Statement> renamed(const Module& module, const std::vector<Statement>& statements, const Renaming& renaming,
                               Module& kernels);

}  // namespace dpde::stencil
