// SPDX-License-Identifier: Apache-2.0
// Kernels on other fields than their own, and names for what has none.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

using Fields = std::map<std::string, std::string>;  // what stands for a field

/// Names with a number that is not taken: v_2, v_3, ...; u_2.x of a component.
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

  /// The name of the kernel with `fields` in the place of its own.
  std::string name_of(const Kernel& kernel, const Fields& fields);
  /// The name of a kernel, for `owner`, that copies a field.
  std::string copy(const std::string& owner, const std::string& from, const std::string& to, SourceRange range);
  /// In the order in which they were made, of a kernel or for an owner.
  std::vector<Kernel> of(const std::string& owner) const;

 private:
  Numbered names_;
  std::map<std::pair<std::string, Fields>, std::string> known_;
  std::map<std::string, std::vector<Kernel>> made_;
};

}  // namespace dpde::ast
