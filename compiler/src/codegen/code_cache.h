// SPDX-License-Identifier: Apache-2.0
// Cache of machine code between runs. The key holds all inputs from which a back end makes the code. The driver decides
// how and where the code is stored.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace dpde::codegen {

class CodeCache {
 public:
  virtual ~CodeCache() = default;
  /// Returns the code stored under exactly this key; nullopt if there is none.
  virtual std::optional<std::string> find(std::string_view key) = 0;
  /// May fail silently: callers must not rely on a later hit.
  virtual void store(std::string_view key, std::string_view code) = 0;
};

}  // namespace dpde::codegen
