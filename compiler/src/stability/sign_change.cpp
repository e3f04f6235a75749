// SPDX-License-Identifier: Apache-2.0
#include "stability/sign_change.h"

#include <algorithm>
#include <cmath>

namespace dpde::stability {

SignChange sign_change(const std::function<double(double)>& f, double low, double f_low, double high, double f_high,
                       double precision) {
  struct Point {
    double x, f;
    bool is_above() const { return f > 0; }
  };
  Point last{high, f_high}, other{low, f_low};
  double part = 0.5;  // of the way from the last point to the other
  while (std::abs(other.x - last.x) > precision * std::max(other.x, last.x)) {
    const double x = last.x + part * (other.x - last.x);
    const Point now{x, f(x)};
    Point third = last;
    if (now.is_above() != last.is_above()) third = std::exchange(other, last);
    last = now;
    const double xi = (last.x - other.x) / (third.x - other.x), phi = (last.f - other.f) / (third.f - other.f);
    part = 0.5;
    if (phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi) {
      part = last.f / (other.f - last.f) * third.f / (other.f - third.f) +
             (third.x - last.x) / (other.x - last.x) * last.f / (third.f - last.f) * other.f / (third.f - other.f);
    }
    // The best of the points has to end up on either side.
    const double least = 0.5 * precision * std::max(other.x, last.x) / std::abs(other.x - last.x);
    part = std::clamp(part, std::min(0.5, least), std::max(0.5, 1 - least));
  }
  return last.is_above() ? SignChange{other.x, last.x} : SignChange{last.x, other.x};
}

}  // namespace dpde::stability
