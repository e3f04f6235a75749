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

  /// The next message; lines that are no head of one are passed over. nullopt at the end of the input.
  std::optional<std::string> read();
  /// Whether read() would wait.
  bool is_idle() const;
  /// False when nobody listens any more.
  bool write(const Json& message) const;

 private:
  bool read_more();
  std::optional<std::string> read_line();
  std::optional<std::string> read_bytes(std::size_t count);

  int in_, out_;
  std::string buffer_;
};

}  // namespace dpde::lsp
