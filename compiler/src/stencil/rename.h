// SPDX-License-Identifier: Apache-2.0
// A block of statements again, with other names for some of its fields.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

struct Renaming {
  std::map<std::string, std::string> fields;                  // those that are not in it keep their names
  std::function<std::string(const std::string&)> new_kernel;  // a name that is free, for a copy of the kernel

  const std::string& field(const std::string& name) const {
    const auto found = fields.find(name);
    return found == fields.end() ? name : found->second;
  }
};

/// The statements with the fields renamed, those of blocks too. The kernels that they run are copied to `kernels`, each
/// once; formulas that a person gave in place of an adjoint are left behind.
std::vector<Statement> renamed(const Module& module, const std::vector<Statement>& statements, const Renaming& renaming,
                               Module& kernels);

}  // namespace dpde::stencil
