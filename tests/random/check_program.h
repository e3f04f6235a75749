// SPDX-License-Identifier: Apache-2.0
// Properties of any well-typed program: its text reads back, its derivatives are correct, and passes and back ends give
// the results of the interpreter.
#pragma once

#include <string>
#include <vector>

#include "random/random_program.h"

namespace dpde::testing {

struct Verdict {
  enum class Kind { passed, refused, kink, failed };
  Kind kind = Kind::passed;
  std::string check;  // the failed check: "text", "adjoint", "pass cse", "jit", ...
  std::string detail;
  double dot_product = 0, finite_difference = 0, back_end = 0;  // measured errors
  int divided = 0;                                              // grids divided among ranks and compared with the whole
};

struct Checks {
  bool jit = true;             // after all passes
  bool without_passes = true;  // machine code without passes, in addition to that after all passes
  bool threads = true;         // one thread against two, on a grid large enough for two
  bool ranks = true;           // a grid that is divided among ranks against the whole one
};

Verdict check_program(const RandomProgram& program, const Checks& checks);
/// Runs the checks in a separate process with a time limit in seconds: a crash or a hang is a failure.
Verdict check_apart(const RandomProgram& program, const Checks& checks, double seconds);

/// Checks all programs in one file of emitted C++: it compiles in a fraction of the time of one file per program.
std::vector<Verdict> check_in_cpp(const std::vector<RandomProgram>& programs);
std::vector<Verdict> check_in_cpp_apart(const std::vector<RandomProgram>& programs, double seconds);

}  // namespace dpde::testing
