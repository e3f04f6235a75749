// SPDX-License-Identifier: Apache-2.0
// Fields whose waves are multiplied, resolved for one layout: derivatives by Fourier series, exponentials of linear
// operators (dpde_transform of kernel_abi.h).
//
// Each field is transformed once, real values along the first axis of waves to a half spectrum, then complex ones along
// the others; the sum over the terms is transformed back. All of it is done in f64, and in the same blocks of lines by
// any number of threads, so that results do not depend on it.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"

namespace dpde {

class FieldTransform {
 public:
  FieldTransform();
  FieldTransform(const dpde_transform& transform, const dpde_layout& layout, const Team& team);
  ~FieldTransform();
  FieldTransform(FieldTransform&&) noexcept;
  FieldTransform& operator=(FieldTransform&&) noexcept;

  /// `fields` point at their cells (0,0,0). Multipliers are computed again where their uniforms have changed; nothing
  /// is allocated.
  void run(void* const* fields, const double* uniforms);

 private:
  using Complex = std::complex<double>;
  struct Lines;       // FFTs and memory of one thread
  struct LineBegins;  // of the lines along an axis
  /// All terms of one field.
  struct Operand {
    int32_t field;
    std::vector<const dpde_transform_term*> terms;
    std::vector<Complex> multipliers;
  };

  /// A sum, and that of the sizes of its terms.
  struct Symbol {
    Complex sum = 0;
    double size = 0;
  };

  void note_uniforms(const dpde_symbol& symbol);
  bool has_changed(const double* uniforms);
  void make_multipliers(const double* uniforms);
  Complex multiplier_at(const Operand& operand, const std::array<int64_t, 3>& mode, const double* uniforms) const;
  Complex mean_at(const Operand& operand, std::array<double, 3> angles, std::size_t axis, bool is_short,
                  const double* uniforms) const;
  Symbol value(const dpde_symbol& symbol, const std::array<double, 3>& angles, const double* uniforms) const;
  template <class Real>
  void forward(const Real* from);
  template <class Real>
  void backward(Real* to);
  void along_others(std::vector<Complex>& waves, bool is_forward);
  void along(std::vector<Complex>& waves, std::size_t axis, bool is_forward);
  bool goes_along(std::size_t axis) const { return transform_.axes[axis] != 0 && cells_[axis] > 1; }
  int64_t modes() const { return modes_[0] * modes_[1] * modes_[2]; }

  dpde_transform transform_{};
  int32_t real_ = DPDE_F64;
  Team team_;
  std::size_t first_ = 0;  // axis of the half spectrum
  std::array<int64_t, 3> cells_{1, 1, 1}, stride_{}, modes_{1, 1, 1};
  std::vector<Operand> operands_;
  std::vector<int32_t> uniforms_;  // that multipliers depend on
  std::vector<double> values_;     // theirs, of the multipliers that are there
  bool is_made_ = false;
  std::vector<Complex> waves_, sum_;
  std::vector<Lines> lines_;  // one a thread
};

}  // namespace dpde
