// SPDX-License-Identifier: Apache-2.0
// The one exception of the runtime, and of the compiler as hosts see it. Its text is a finished sentence for the user:
// what is wrong and where.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dpde {

enum class ErrorKind {
  input,    // what the user gave is wrong: a file, a shape, a missing binding, a budget
  run,      // the computation cannot go on
  machine,  // memory, disk, operating system
};

/// One message of the compiler. line and column count from 1; 0 where there is no place.
struct Message {
  std::string code, severity, text, file;
  int line = 0, column = 0;
  std::string hint;
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message, std::vector<Message> messages = {})
      : std::runtime_error(message), kind_(kind), text_(message), messages_(std::move(messages)) {}
  const char* what() const noexcept override { return text_.c_str(); }
  ErrorKind kind() const { return kind_; }
  /// What the compiler said, warnings too; what() is the same as text with source lines. Of errors of a
  /// run where a solve of the text finds nothing.
  const std::vector<Message>& messages() const { return messages_; }
  /// The first unknown of the solve that it comes from; "": of none.
  const std::string& solve_for() const { return solve_for_; }
  void set_solve_for(const std::string& unknown) { solve_for_ = unknown; }
  /// Says more of it.
  void explain(std::string text, std::vector<Message> messages) {
    text_ = std::move(text);
    messages_ = std::move(messages);
  }

 private:
  ErrorKind kind_;
  std::string text_, solve_for_;
  std::vector<Message> messages_;
};

/// A run has a value that is not finite. A search may take it for a step that was too long.
class NotFinite : public Error {
 public:
  explicit NotFinite(const std::string& message) : Error(ErrorKind::run, message) {}
};

/// A solve finds no solution for the values it has. Checks with values that are made up go on with others.
class NoSolution : public Error {
 public:
  explicit NoSolution(const std::string& message) : Error(ErrorKind::run, message) {}
};

}  // namespace dpde
