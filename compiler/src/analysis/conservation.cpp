// SPDX-License-Identifier: Apache-2.0
#include "analysis/conservation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/placement.h"

namespace dpde::analysis {

/// Values at faces stand for what lies between the centres on both sides of them.
void Integrals::add(const std::vector<double>& frame, const std::vector<model::Axis>& axes,
                    const model::Placement& placement) {
  std::array<std::vector<double>, 3> widths{{{1}, {1}, {1}}};
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const model::Axis axis = model::axes_at(axes, placement)[a];
    widths[a].clear();
    for (int i = 0; i < axis.cells; ++i) widths[a].push_back(axis.width(i));
  }
  double sum = 0, magnitude_now = 0;
  std::size_t i = 0;
  for (const double z : widths[2]) {
    for (const double y : widths[1]) {
      for (const double x : widths[0]) {
        const double part = x * y * z * frame[i++];
        sum += part;
        magnitude_now += std::abs(part);
      }
    }
  }
  const auto count = static_cast<double>(values.size());
  magnitude = (magnitude * count + magnitude_now) / (count + 1);
  values.push_back(sum);
}

double Integrals::drift() const {
  double largest = 0;
  for (const double value : values) largest = std::max(largest, std::abs(value - values.front()));
  return largest;
}

double Integrals::relative_drift() const { return magnitude > 0 ? drift() / magnitude : 0; }

}  // namespace dpde::analysis
