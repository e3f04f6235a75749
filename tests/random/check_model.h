// SPDX-License-Identifier: Apache-2.0
// Properties of any .dpde text: it compiles, or is refused with a source position. If it compiles, the interpreter, the
// JIT and emitted C++ give the same results, with correct derivatives.
#pragma once

#include <cstdint>
#include <string>

namespace dpde::testing {

struct ModelVerdict {
  enum class Kind { passed, refused, unstable, failed };
  Kind kind = Kind::passed;
  std::string check;  // the failed check: "refusal", "interpreter", "dot product", "crash", ...; if refused, the code
  std::string detail;
};

struct ModelChecks {
  bool second = false;      // second derivatives too
  bool cpp = false;         // emitted C++ too
  bool symmetries = false;  // swapped axes, few checkpoints and two threads change nothing
  double seconds = 600;     // time limit; to exceed it is a failure
};

/// Checks task `t` of the text in a separate process: a crash or a hang is a failure.
ModelVerdict check_model(const std::string& text, const ModelChecks& checks);

}  // namespace dpde::testing
