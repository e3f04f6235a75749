// SPDX-License-Identifier: Apache-2.0
#include "support/names/number_text.h"

#include <fmt/format.h>

#include <exception>

namespace dpde {

std::optional<std::uint64_t> parse_bytes(const std::string& text) {
  std::size_t used = 0;
  double value = 0;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  const std::string suffix = text.substr(used);
  const double unit = suffix.empty() || suffix == "B"  ? 1
                      : suffix == "K" || suffix == "k" ? 1024.0
                      : suffix == "M" || suffix == "m" ? 1048576.0
                      : suffix == "G" || suffix == "g" ? 1073741824.0
                                                       : 0;
  const double bytes = value * unit;
  if (!(bytes >= 1) || bytes > 9e18) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

std::string human_bytes(double bytes) {
  const char* units[] = {"B", "KiB", "MiB", "GiB", "TiB"};
  int unit = 0;
  for (; bytes >= 1024 && unit < 4; ++unit) bytes /= 1024;
  return fmt::format("{:.3g} {}", bytes, units[unit]);
}

std::string human_count(double count) {
  const char* units[] = {"", " k", " M", " G", " T"};
  int unit = 0;
  for (; count >= 1000 && unit < 4; ++unit) count /= 1000;
  return fmt::format("{:.3g}{}", count, units[unit]);
}

std::string human_seconds(double seconds) {
  if (seconds >= 100) return fmt::format("{:.0f} s", seconds);
  if (seconds >= 1) return fmt::format("{:.3g} s", seconds);
  if (seconds >= 1e-3) return fmt::format("{:.3g} ms", seconds * 1e3);
  return fmt::format("{:.3g} us", seconds * 1e6);
}

std::string label_of(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : fmt::format("{} [{}]", name, unit);
}

std::string behind_number(const std::string& unit) { return unit.empty() || unit == "1" ? "" : " " + unit; }

}  // namespace dpde
