// SPDX-License-Identifier: Apache-2.0
// What has to hold for any .dpde text: it is compiled or refused at a place, and what is compiled gives the same in the
// interpreter, the JIT and emitted C++, with derivatives that are right.
#pragma once

#include <cstdint>
#include <string>

namespace dpde::testing {

struct ModelVerdict {
  enum class Kind { passed, refused, unstable, failed };
  Kind kind = Kind::passed;
  std::string check;  // what failed: "refusal", "interpreter", "dot product", "crash", ...; of what is refused the code
  std::string detail;
};

struct ModelChecks {
  bool second = false;      // second derivatives too
  bool cpp = false;         // emitted C++ too
  bool symmetries = false;  // swapped axes, few checkpoints and two threads change nothing
  double seconds = 600;     // then it is stopped, and has failed
};

/// Of task `t` of the text, in a process of its own: what crashes or hangs has failed.
ModelVerdict check_model(const std::string& text, const ModelChecks& checks);

}  // namespace dpde::testing
