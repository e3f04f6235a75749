// SPDX-License-Identifier: Apache-2.0
// Fields whose Fourier modes are multiplied, resolved for one layout: spectral derivatives, exponentials of linear
// operators (dpde_transform of kernel_abi.h).
//
// Each field is first transformed along its first axis, real to half-complex, then along the others, complex. Along the
// last axis, blocks of lines are transformed, multiplied and transformed back while they are in the cache. Everything
// is in double precision, and in the same blocks for any number of threads, so that results do not depend on it.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <memory>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/team.h"
#include "grid/aligned_values.h"
#include "transform/wave_multipliers.h"

namespace dpde {

class FieldTransform {
 public:
  FieldTransform();
  /// `before`: the transform that runs just before, or null: if both transform the same single field, it is transformed
  /// once.
  FieldTransform(const dpde_transform& transform, const dpde_layout& layout, const Team& team,
                 FieldTransform* before = nullptr);
  ~FieldTransform();
  FieldTransform(FieldTransform&&) noexcept;
  FieldTransform& operator=(FieldTransform&&) noexcept;

  /// `fields` point at their cells (0,0,0). Multipliers are recomputed if their uniforms have changed; nothing is
  /// allocated.
  void run(void* const* fields, const double* uniforms);
  /// Memory use.
  std::int64_t bytes() const;

 private:
  using Complex = std::complex<double>;
  struct Lines;       // FFTs and memory of one thread
  struct LineBegins;  // offsets of the lines along an axis
  struct Block;       // neighbouring lines along the last axis
  /// All terms of one field.
  struct Operand {
    int32_t field;
    WaveMultipliers multipliers;
  };

  void choose_axes(const dpde_layout& layout);
  void make_operands();
  bool shares_waves_of(const FieldTransform& before) const;
  bool goes_along(std::size_t axis) const { return transform_.axes[axis] != 0 && waves_.cells[axis] > 1; }
  bool is_along_one_axis() const { return first_ == waves_.along; }
  template <class Real>
  void multiply_waves(std::size_t number, const Real* from, Real* to);
  template <class Real>
  void read_line(const Real* from, Lines& own, Complex* waves) const;
  template <class Real>
  void write_line(Complex* waves, Lines& own, Real* to) const;
  template <class Real>
  void first_forward(const Real* from);
  template <class Real>
  void first_backward(Real* to);
  template <class Real>
  void last_forward(const Block& block, const Real* from, Lines& own, Complex* waves);
  template <class Real>
  void last_backward(const Block& block, Complex* waves, Lines& own, Real* to);
  void between(std::size_t axis, bool is_forward);

  dpde_transform transform_{};
  int32_t real_ = DPDE_F64;
  Team team_;
  std::size_t first_ = 0;  // axis of the half spectrum
  WaveLines waves_;
  std::array<int64_t, 3> stride_{};
  std::vector<Operand> operands_;
  AlignedValues half_way_;               // modes along all axes but the last one
  std::shared_ptr<AlignedValues> kept_;  // all modes, if the next transform shares them
  bool are_made_before_ = false;
  AlignedValues sum_;         // if there are several operands
  std::vector<Lines> lines_;  // one a thread
};

}  // namespace dpde
