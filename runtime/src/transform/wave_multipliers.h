// SPDX-License-Identifier: Apache-2.0
// Multipliers of the Fourier modes of one field: the sum of the terms of that field (dpde_transform_term of
// kernel_abi.h), divided by the number of cells, by which forward and backward transforms multiply.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"
#include "grid/aligned_values.h"

namespace dpde {

/// Modes of a grid in lines along one axis, line after line.
struct WaveLines {
  std::array<std::int64_t, 3> cells{1, 1, 1}, modes{1, 1, 1};
  std::array<bool, 3> axes{};  // the transformed ones
  std::size_t along = 0;

  std::int64_t length() const { return modes[along]; }
  std::int64_t count() const { return modes[0] * modes[1] * modes[2] / length(); }
  /// How many lines are adjacent in memory; the others follow after these.
  std::int64_t side_by_side() const { return modes[along == 0 ? 1 : 0]; }
  std::array<std::int64_t, 3> mode(std::int64_t line, std::int64_t place) const;
};

class WaveMultipliers {
 public:
  using Complex = std::complex<double>;

  WaveMultipliers(const WaveLines& lines, std::vector<const dpde_transform_term*> terms);

  /// Recomputes the multipliers if their uniforms have changed; nothing is allocated.
  void update(const double* uniforms, const Team& team);
  /// Number of doubles.
  std::int64_t count() const { return multipliers_.count(); }
  /// Multiplies the modes of `lines` lines from `line` on; `is_added`: adds to `product`.
  void multiply(std::int64_t line, std::int64_t lines, const Complex* waves, Complex* product, bool is_added) const;

 private:
  /// A sum, and the sum of the magnitudes of its terms.
  struct Symbol {
    Complex sum = 0;
    double size = 0;
  };

  void note(const dpde_symbol& symbol);
  bool have_changed(const double* uniforms);
  Complex at(const std::array<std::int64_t, 3>& mode, const double* uniforms) const;
  Complex mean_at(std::array<double, 3> angles, std::size_t axis, bool is_short, const double* uniforms) const;
  static Symbol value(const dpde_symbol& symbol, const std::array<double, 3>& angles, const double* uniforms);

  WaveLines lines_;
  std::vector<const dpde_transform_term*> terms_;
  std::vector<std::int32_t> uniforms_;  // on which the multipliers depend
  std::vector<double> values_;          // their values for the present multipliers
  bool are_made_ = false;
  bool are_real_ = true;       // sums of even powers: half of the memory
  AlignedValues multipliers_;  // pairs of doubles if they are complex
};

}  // namespace dpde
