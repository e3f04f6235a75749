// SPDX-License-Identifier: Apache-2.0
// Machine code kept between runs. The key of a piece of code is all that a back end makes it of; where and how code is
// kept is the driver's affair.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace dpde::codegen {

class CodeCache {
 public:
  virtual ~CodeCache() = default;
  /// The code stored for exactly this key.
  virtual std::optional<std::string> find(std::string_view key) = 0;
  /// May fail silently: a cache is no promise.
  virtual void store(std::string_view key, std::string_view code) = 0;
};

}  // namespace dpde::codegen
