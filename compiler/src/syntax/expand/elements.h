// SPDX-License-Identifier: Apache-2.0
// Names of elements of arrays, as written: c[3], dt(A[i, 2]).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace dpde::ast {

/// dt(A[i, 2]) in parts.
struct Element {
  std::string before, array;
  std::vector<std::string> indices;  // none: no element
  std::string behind;
};

Element element_of(const std::string& name);

/// nullopt where the index is no number.
std::optional<int> number_in(const std::string& index);

/// A[2, 3]
std::string text_of(const std::string& array, const std::vector<int>& extents);

/// All values of indices from 1 on, the last one running first.
void for_each_value(const std::vector<int>& extents, const std::function<void(const std::vector<int>&)>& f);

}  // namespace dpde::ast
