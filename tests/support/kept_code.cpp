// SPDX-License-Identifier: Apache-2.0
#include "support/kept_code.h"

#include <map>
#include <mutex>
#include <string>

namespace dpde::testing {

namespace {

class KeptCode : public codegen::CodeCache {
 public:
  std::optional<std::string> find(std::string_view key) override {
    const std::lock_guard lock(mutex_);
    const auto found = code_.find(key);
    return found == code_.end() ? std::nullopt : std::optional(found->second);
  }
  /// Other stored items (certificates, choices by timing) are recomputed for each test.
  void store(std::string_view key, std::string_view code) override {
    if (!key.starts_with("object")) return;
    const std::lock_guard lock(mutex_);
    code_.insert_or_assign(std::string(key), std::string(code));
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::string, std::less<>> code_;
};

}  // namespace

std::shared_ptr<codegen::CodeCache> kept_code() {
  static const auto kept = std::make_shared<KeptCode>();
  return kept;
}

}  // namespace dpde::testing
