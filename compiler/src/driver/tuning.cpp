// SPDX-License-Identifier: Apache-2.0
#include "driver/tuning.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace dpde::driver {
namespace {

constexpr double least_field_bytes = 4 << 20;  // the runtime's, from which on sweeps have a choice

/// The code itself is in its key, the processor in the cache's.
std::string key_of(const Compiled& compiled, const RolloutSetup& setup) {
  return fmt::format("tuning\n{} cells, {} threads\n{}", fmt::join(setup.layout.cells, " "), setup.team.threads(),
                     compiled.code_key);
}

codegen::CodeCache* cache_of(const Compiled& compiled) {
  return compiled.code_key.empty() ? nullptr : compiled.options.cache.get();
}

}  // namespace

bool is_worth_tuning(const Compiled& compiled) {
  if (!compiled.problem) return false;
  double bytes = bytes_of(compiled.real());
  for (const model::Axis& axis : compiled.problem->axes) bytes *= axis.cells;
  return bytes >= least_field_bytes;
}

std::string find_tuning(const Compiled& compiled, const RolloutSetup& setup) {
  codegen::CodeCache* const cache = cache_of(compiled);
  return cache == nullptr ? "" : cache->find(key_of(compiled, setup)).value_or("");
}

void keep_tuning(const Compiled& compiled, const RolloutSetup& setup, const std::string& tuning) {
  codegen::CodeCache* const cache = cache_of(compiled);
  if (cache != nullptr && !tuning.empty()) cache->store(key_of(compiled, setup), tuning);
}

}  // namespace dpde::driver
