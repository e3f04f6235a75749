// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace dpde::report {

void Report::add_if_drawn(std::string name, const plot::LinePanel& panel) {
  const auto is_drawn = [](const plot::Curve& curve) {
    return std::ranges::any_of(curve.y, [](double value) { return std::isfinite(value); });
  };
  if (std::ranges::any_of(panel.curves, is_drawn)) parts.emplace_back(Picture{std::move(name), {panel}});
}

void Report::append(Report other) {
  std::ranges::move(other.parts, std::back_inserter(parts));
  json.update(other.json);
}

std::string Report::text() const {
  std::string text;
  for (const auto& part : parts) {
    if (const std::string* words = std::get_if<std::string>(&part)) text += *words;
    if (const Detail* detail = std::get_if<Detail>(&part)) text += detail->text;
  }
  return text;
}

}  // namespace dpde::report
