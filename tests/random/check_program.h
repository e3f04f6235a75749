// SPDX-License-Identifier: Apache-2.0
// What has to hold for any well-typed program: its text reads back, its derivatives are right, passes and back ends
// leave its results as the interpreter has them.
#pragma once

#include <string>
#include <vector>

#include "random/random_program.h"

namespace dpde::testing {

struct Verdict {
  enum class Kind { passed, refused, kink, failed };
  Kind kind = Kind::passed;
  std::string check;  // what failed: "text", "adjoint", "pass cse", "jit", ...
  std::string detail;
  double dot_product = 0, finite_difference = 0, back_end = 0;  // measured errors
  int divided = 0;                                              // grids that ranks shared, compared with the whole one
};

struct Checks {
  bool jit = true;             // after all passes
  bool without_passes = true;  // machine code of the program as it is, beside that after all passes
  bool threads = true;         // one thread against two, on a grid large enough for two
  bool ranks = true;           // a grid that is divided among ranks against the whole one
};

Verdict check_program(const RandomProgram& program, const Checks& checks);
/// In a process of its own, which is stopped after so many seconds: what crashes or hangs has failed.
Verdict check_apart(const RandomProgram& program, const Checks& checks, double seconds);

/// All programs in one file of emitted C++, which compiles in a fraction of the time of a file each.
std::vector<Verdict> check_in_cpp(const std::vector<RandomProgram>& programs);
std::vector<Verdict> check_in_cpp_apart(const std::vector<RandomProgram>& programs, double seconds);

}  // namespace dpde::testing
