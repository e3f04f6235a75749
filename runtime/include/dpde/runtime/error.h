// SPDX-License-Identifier: Apache-2.0
// The one exception of the runtime, and of the compiler as seen by hosts. Its text is a complete sentence for the user:
// the fault and its location.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dpde {

/// What is at fault.
enum class ErrorKind {
  input,    // invalid user input: a file, a shape, a missing binding, a memory limit
  run,      // the computation cannot go on
  machine,  // memory, disk, operating system
};

/// One message of the compiler. line and column count from 1; 0: no location.
struct Message {
  std::string code, severity, text, file;
  int line = 0, column = 0;
  std::string hint;
};

/// The exception of all calls.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message, std::vector<Message> messages = {})
      : std::runtime_error(message), kind_(kind), text_(message), messages_(std::move(messages)) {}
  /// The whole text, with the source lines of the compiler's messages.
  const char* what() const noexcept override { return text_.c_str(); }
  ErrorKind kind() const { return kind_; }
  /// The compiler's messages, warnings included; what() has the same as text with source lines. For errors of a run:
  /// set if a solve of the .dpde file found no solution.
  const std::vector<Message>& messages() const { return messages_; }
  /// The first unknown of the solve that failed; "": the error is not of a solve.
  const std::string& solve_for() const { return solve_for_; }
  void set_solve_for(const std::string& unknown) { solve_for_ = unknown; }
  /// Replaces text and messages by more detailed ones.
  void explain(std::string text, std::vector<Message> messages) {
    text_ = std::move(text);
    messages_ = std::move(messages);
  }

 private:
  ErrorKind kind_;
  std::string text_, solve_for_;
  std::vector<Message> messages_;
};

/// A state of the run is not finite. A line search may treat it as a step that was too long.
class NotFinite : public Error {
 public:
  explicit NotFinite(const std::string& message) : Error(ErrorKind::run, message) {}
};

/// A solve has no solution for the present values. Checks with artificial values then try others.
class NoSolution : public Error {
 public:
  explicit NoSolution(const std::string& message) : Error(ErrorKind::run, message) {}
};

}  // namespace dpde
