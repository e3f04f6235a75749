// SPDX-License-Identifier: Apache-2.0
#include <fftw3.h>

#include <array>
#include <cmath>

#include "bare_transform.h"

namespace dpde {
namespace {

/// Estimated plans, as the runtime has.
class Fftw : public BareTransform {
 public:
  Fftw(std::int64_t n, int rank, bool is_periodic) {
    std::array<int, 3> lengths{};
    lengths.fill(static_cast<int>(n));
    std::size_t lines = 1;
    for (int axis = 1; axis < rank; ++axis) lines *= static_cast<std::size_t>(n);
    const std::size_t size = lines * static_cast<std::size_t>(n);
    field_ = fftw_alloc_real(size);
    product_ = fftw_alloc_real(size);
    waves_ = fftw_alloc_real(size + 2 * lines);
    for (std::size_t i = 0; i < size; ++i) field_[i] = std::sin(static_cast<double>(i) * 1.7);
    if (is_periodic) {
      auto* waves = reinterpret_cast<fftw_complex*>(waves_);
      there_ = fftw_plan_dft_r2c(rank, lengths.data(), field_, waves, FFTW_ESTIMATE);
      back_ = fftw_plan_dft_c2r(rank, lengths.data(), waves, product_, FFTW_ESTIMATE);
    } else {
      std::array<fftw_r2r_kind, 3> there{}, back{};
      there.fill(FFTW_REDFT10);
      back.fill(FFTW_REDFT01);
      there_ = fftw_plan_r2r(rank, lengths.data(), field_, waves_, there.data(), FFTW_ESTIMATE);
      back_ = fftw_plan_r2r(rank, lengths.data(), waves_, product_, back.data(), FFTW_ESTIMATE);
    }
  }
  ~Fftw() override {
    fftw_destroy_plan(there_);
    fftw_destroy_plan(back_);
    for (double* memory : {field_, product_, waves_}) fftw_free(memory);
  }
  void there_and_back() override {
    fftw_execute(there_);
    fftw_execute(back_);
  }

 private:
  double *field_, *product_, *waves_;
  fftw_plan there_, back_;
};

}  // namespace

std::unique_ptr<BareTransform> bare_transform(std::int64_t n, int rank, bool is_periodic) {
  return std::make_unique<Fftw>(n, rank, is_periodic);
}

}  // namespace dpde
