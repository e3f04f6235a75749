// SPDX-License-Identifier: Apache-2.0
// The one exception of the runtime. Its text is a finished sentence for the user: what is wrong and where.
#pragma once

#include <stdexcept>
#include <string>

namespace dpde {

enum class ErrorKind {
  input,    // what the user gave is wrong: a file, a shape, a missing binding, a budget
  run,      // the computation cannot go on
  machine,  // memory, disk, operating system
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }

 private:
  ErrorKind kind_;
};

}  // namespace dpde
