// SPDX-License-Identifier: Apache-2.0
#include "loop/loop.h"

#include <algorithm>

template class dpde::ExprOf<dpde::loop::Node>;

namespace dpde::loop {

Operation::Operation() = default;
Operation::Operation(const Operation& other) = default;
Operation::Operation(Operation&& other) noexcept = default;
Operation& Operation::operator=(const Operation& other) = default;
Operation& Operation::operator=(Operation&& other) noexcept = default;
Operation::~Operation() = default;

const Row* Module::find_row(const std::string& name) const {
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.name == name; });
  return found == rows.end() ? nullptr : &*found;
}

}  // namespace dpde::loop
