// SPDX-License-Identifier: Apache-2.0
// Compiled code on disk. One file for each entry: a header with a checksum, the whole key, the code.
//
// - Safe for any number of concurrent processes and for kills: files are renamed to their final name when complete.
//   Files that are damaged, have another key or are open to other users are not used, and deleted if possible.
// - Entries are executed. So only this user and root may be able to write to the folder, its parents, and the entries.
// - Keys include the identity of this executable and of the processor, so code of another dpde is never found.
// - When all entries together exceed the limit, the least recently used are deleted.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "codegen/code_cache.h"

namespace dpde::driver {

inline constexpr std::uint64_t default_cache_bytes = std::uint64_t{256} << 20;

/// Why others could put code into an existing folder; "" if they cannot.
std::string why_not_private(const std::filesystem::path& folder);

/// Opens a cache in `folder`, creating it and its parents. nullptr if that fails, if it is not private, or if this
/// executable has no identity.
std::shared_ptr<codegen::CodeCache> open_cache(const std::filesystem::path& folder,
                                               std::uint64_t most_bytes = default_cache_bytes);

/// $DPDE_CACHE, else $XDG_CACHE_HOME/dpde, else $HOME/.cache/dpde; "" if none of them is set.
std::filesystem::path default_cache_folder();

}  // namespace dpde::driver
