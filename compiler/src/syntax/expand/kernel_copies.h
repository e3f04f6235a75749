// SPDX-License-Identifier: Apache-2.0
// Copies of kernels for other fields, and unused names.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

using Fields = std::map<std::string, std::string>;  // replacement of each field

/// Makes unused names by adding a number: v_2, v_3, ...; u_2.x for a component.
class Numbered {
 public:
  void reserve(const std::string& name) { used_.insert(name); }
  std::string fresh(const std::string& name) { return used_.insert(name).second ? name : next(name); }
  std::string next(const std::string& name);

 private:
  std::set<std::string> used_;
  std::map<std::string, int> numbers_;
};

class KernelCopies {
 public:
  explicit KernelCopies(const File& file);

  /// Name of a copy of the kernel with the replacements `fields`.
  std::string name_of(const Kernel& kernel, const Fields& fields);
  /// Name of a new kernel, for `owner`, that copies one field to another.
  std::string copy(const std::string& owner, const std::string& from, const std::string& to, SourceRange range);
  /// The copies of a kernel or for an owner, in order of creation.
  std::vector<Kernel> of(const std::string& owner) const;

 private:
  Numbered names_;
  std::map<std::pair<std::string, Fields>, std::string> known_;
  std::map<std::string, std::vector<Kernel>> made_;
};

}  // namespace dpde::ast
