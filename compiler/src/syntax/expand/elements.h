// SPDX-License-Identifier: Apache-2.0
// Names of array elements, as written: c[3], dt(A[i, 2]).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace dpde::ast {

/// The parts of dt(A[i, 2]).
struct Element {
  std::string before, array;
  std::vector<std::string> indices;  // empty: not an element
  std::string behind;
};

Element element_of(const std::string& name);

/// nullopt if the index is not a number.
std::optional<int> number_in(const std::string& index);

/// A[2, 3]
std::string text_of(const std::string& array, const std::vector<int>& extents);

/// Calls `f` with all index tuples from 1 on; the last index runs fastest.
void for_each_value(const std::vector<int>& extents, const std::function<void(const std::vector<int>&)>& f);

}  // namespace dpde::ast
