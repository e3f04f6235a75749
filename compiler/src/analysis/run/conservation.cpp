// SPDX-License-Identifier: Apache-2.0
#include "analysis/run/conservation.h"

#include <algorithm>
#include <cmath>

namespace dpde::analysis {

void Integrals::add(const std::vector<double>& frame, const std::vector<double>& volumes) {
  double sum = 0, magnitude_now = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double part = volumes[i] * frame[i];
    sum += part;
    magnitude_now += std::abs(part);
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
