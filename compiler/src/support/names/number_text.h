// SPDX-License-Identifier: Apache-2.0
// Bytes, counts, seconds and units as people read and write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dpde {

/// Bytes with a suffix K, M or G (powers of 1024); nullopt when `text` is something else.
std::optional<std::uint64_t> parse_bytes(const std::string& text);

/// 1234567 -> "1.18 MiB"; 3.2e9 -> "3.2 G"; 0.00312 -> "3.12 ms".
std::string human_bytes(double bytes);
std::string human_count(double count);
std::string human_seconds(double seconds);

/// "x [m]"; the name alone of a pure number, and where no unit is known.
std::string label_of(const std::string& name, const std::string& unit);
/// " m" behind a number, or nothing.
std::string behind_number(const std::string& unit);

}  // namespace dpde
