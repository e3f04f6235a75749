// SPDX-License-Identifier: Apache-2.0
// Messages of the language server protocol on two files: "Content-Length: N", a blank line, N bytes of JSON.
#pragma once

#include <optional>
#include <string>

#include "support/json.h"

namespace dpde::lsp {

class Wire {
 public:
  Wire(int in, int out) : in_(in), out_(out) {}

  /// The next message; skips lines that do not belong to a header. nullopt at the end of the input.
  std::optional<std::string> read();
  /// Whether read() would wait.
  bool is_idle() const;
  /// Returns false if the other side has closed.
  bool write(const Json& message) const;

 private:
  bool read_more();
  std::optional<std::string> read_line();
  std::optional<std::string> read_bytes(std::size_t count);

  int in_, out_;
  std::string buffer_;
};

}  // namespace dpde::lsp
