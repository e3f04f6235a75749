// SPDX-License-Identifier: Apache-2.0
// Compiled code on disk. One file an entry: header with a checksum, the whole key, the code.
//
//  - Safe for any number of processes at once and for kills: files appear complete, under their final name, or not
//    at all; what is damaged, of another key, or open to other users' hands is not used, and thrown away where it can.
//  - What is found is run: nobody but this user and root may be able to write to the folder, to what lies above it, or
//    to an entry.
//  - Code of another dpde is never found: the identity of this executable and of the processor are part of every key.
//  - When all entries together exceed the limit, those go that were not used for the longest time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "codegen/code_cache.h"

namespace dpde::driver {

inline constexpr std::uint64_t default_cache_bytes = std::uint64_t{256} << 20;

/// Why others could put code of theirs into a folder that is there; "": they cannot.
std::string why_not_private(const std::filesystem::path& folder);

/// A cache in `folder`, which is made with its parents; nullptr when that is impossible, when it is not private or this
/// executable has no identity.
std::shared_ptr<codegen::CodeCache> open_cache(const std::filesystem::path& folder,
                                               std::uint64_t most_bytes = default_cache_bytes);

/// $DPDE_CACHE, else $XDG_CACHE_HOME/dpde, else $HOME/.cache/dpde; "" when none of them is set.
std::filesystem::path default_cache_folder();

}  // namespace dpde::driver
