// SPDX-License-Identifier: Apache-2.0
// Conversion of bytes, counts, seconds and units from and to readable text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dpde {

/// Bytes with a suffix K, M or G (powers of 1024); nullopt for other text.
std::optional<std::uint64_t> parse_bytes(const std::string& text);

/// 1234567 -> "1.18 MiB"; 3.2e9 -> "3.2 G"; 0.00312 -> "3.12 ms".
std::string human_bytes(double bytes);
std::string human_count(double count);
std::string human_seconds(double seconds);

/// "x [m]"; only the name for dimensionless or unknown units.
std::string label_of(const std::string& name, const std::string& unit);
/// " m" after a number, or "".
std::string behind_number(const std::string& unit);

}  // namespace dpde
