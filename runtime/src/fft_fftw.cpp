// SPDX-License-Identifier: Apache-2.0
// The only source that sees FFTW.
#include <fftw3.h>

#include <mutex>
#include <utility>

#include "fft.h"

namespace dpde {
namespace {

// Measured plans (FFTW_MEASURE) take a fifth to a third less time and 0.3 s to make; but they differ from run to run,
// and with them the last digits of results.
constexpr unsigned rigour = FFTW_ESTIMATE;

std::mutex& planner() {  // FFTW has one for all threads
  static std::mutex mutex;
  return mutex;
}

/// Estimating does not look at arrays, only at how they are aligned and whether they are one.
alignas(64) double some_values[8];
alignas(64) fftw_complex some_waves[4], other_waves[4];

class Plan {
 public:
  template <class Make>
  explicit Plan(const Make& make) {
    const std::lock_guard lock(planner());
    plan_ = make();
  }
  ~Plan() {
    const std::lock_guard lock(planner());
    fftw_destroy_plan(plan_);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;
  fftw_plan get() const { return plan_; }

 private:
  fftw_plan plan_;
};

fftw_complex* fftw(std::complex<double>* values) { return reinterpret_cast<fftw_complex*>(values); }

fftw_plan complex_plan(const ComplexLines& lines, bool is_forward) {
  fftw_iodim64 along{lines.length, lines.step, lines.wave_step}, across{lines.lines, lines.apart, lines.wave_apart};
  if (!is_forward) {
    std::swap(along.is, along.os);
    std::swap(across.is, across.os);
  }
  const bool is_in_place = lines.step == lines.wave_step && lines.apart == lines.wave_apart;
  return fftw_plan_guru64_dft(1, &along, 1, &across, some_waves, is_in_place ? some_waves : other_waves,
                              is_forward ? FFTW_FORWARD : FFTW_BACKWARD, rigour);
}

}  // namespace

struct ComplexFft::Plans {
  Plan forward, backward;
};

ComplexFft::ComplexFft(const ComplexLines& lines)
    : plans_(new Plans{Plan([&] { return complex_plan(lines, true); }),
                       Plan([&] { return complex_plan(lines, false); })}) {}
ComplexFft::ComplexFft(ComplexFft&&) noexcept = default;
ComplexFft& ComplexFft::operator=(ComplexFft&&) noexcept = default;
ComplexFft::~ComplexFft() = default;

void ComplexFft::forward(std::complex<double>* values, std::complex<double>* waves) {
  fftw_execute_dft(plans_->forward.get(), fftw(values), fftw(waves));
}
void ComplexFft::backward(std::complex<double>* waves, std::complex<double>* values) {
  fftw_execute_dft(plans_->backward.get(), fftw(waves), fftw(values));
}

struct RealFft::Plans {
  Plan forward, backward;
};

RealFft::RealFft(const RealLines& lines) {
  const fftw_iodim64 along{lines.length, lines.step, lines.wave_step},
      across{lines.lines, lines.apart, lines.wave_apart};
  const fftw_iodim64 back_along{lines.length, lines.wave_step, lines.step};
  const fftw_iodim64 back_across{lines.lines, lines.wave_apart, lines.apart};
  plans_.reset(new Plans{
      Plan([&] { return fftw_plan_guru64_dft_r2c(1, &along, 1, &across, some_values, some_waves, rigour); }), Plan([&] {
        return fftw_plan_guru64_dft_c2r(1, &back_along, 1, &back_across, some_waves, some_values, rigour);
      })});
}
RealFft::RealFft(RealFft&&) noexcept = default;
RealFft& RealFft::operator=(RealFft&&) noexcept = default;
RealFft::~RealFft() = default;

void RealFft::forward(const double* values, std::complex<double>* waves) {
  fftw_execute_dft_r2c(plans_->forward.get(), const_cast<double*>(values), fftw(waves));
}
void RealFft::backward(std::complex<double>* waves, double* values) {
  fftw_execute_dft_c2r(plans_->backward.get(), fftw(waves), values);
}

}  // namespace dpde
