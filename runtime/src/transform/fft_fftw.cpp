// SPDX-License-Identifier: Apache-2.0
// The only source that includes FFTW.
#include <fftw3.h>

#include <mutex>
#include <utility>

#include "transform/fft.h"

namespace dpde {
namespace {

// Measured plans (FFTW_MEASURE) are a fifth to a third faster and take 0.3 s to make; but they differ from run to run,
// and so do the last digits of results.
constexpr unsigned rigour = FFTW_ESTIMATE;

std::mutex& planner() {  // FFTW's planner is not thread-safe
  static std::mutex mutex;
  return mutex;
}

/// FFTW's functions: fftw_ for doubles and fftwf_ for floats.
template <class Real>
struct Fftw;
#define DPDE_FFTW_OF(REAL, PREFIX)                                  \
  template <>                                                       \
  struct Fftw<REAL> {                                               \
    using Plan = PREFIX##_plan;                                     \
    using Complex = PREFIX##_complex;                               \
    static constexpr auto destroy = PREFIX##_destroy_plan;          \
    static constexpr auto plan_complex = PREFIX##_plan_guru64_dft;  \
    static constexpr auto plan_real = PREFIX##_plan_guru64_dft_r2c; \
    static constexpr auto plan_back = PREFIX##_plan_guru64_dft_c2r; \
    static constexpr auto execute = PREFIX##_execute_dft;           \
    static constexpr auto execute_real = PREFIX##_execute_dft_r2c;  \
    static constexpr auto execute_back = PREFIX##_execute_dft_c2r;  \
  };
DPDE_FFTW_OF(double, fftw)
DPDE_FFTW_OF(float, fftwf)
#undef DPDE_FFTW_OF

/// Arrays for planning: FFTW_ESTIMATE only uses their alignment and whether input and output are the same.
template <class Real>
struct Some {
  alignas(64) static inline Real values[8];
  alignas(64) static inline typename Fftw<Real>::Complex waves[4], others[4];
};

template <class Real>
class Plan {
 public:
  template <class Make>
  explicit Plan(const Make& make) {
    const std::lock_guard lock(planner());
    plan_ = make();
  }
  ~Plan() {
    const std::lock_guard lock(planner());
    Fftw<Real>::destroy(plan_);
  }
  Plan(const Plan&) = delete;
  Plan& operator=(const Plan&) = delete;
  typename Fftw<Real>::Plan get() const { return plan_; }

 private:
  typename Fftw<Real>::Plan plan_;
};

template <class Real>
auto* fftw(std::complex<Real>* values) {
  return reinterpret_cast<typename Fftw<Real>::Complex*>(values);
}

template <class Real>
auto complex_plan(const ComplexLines& lines, bool is_forward) {
  fftw_iodim64 along{lines.length, lines.step, lines.wave_step}, across{lines.lines, lines.apart, lines.wave_apart};
  if (!is_forward) {
    std::swap(along.is, along.os);
    std::swap(across.is, across.os);
  }
  const bool is_in_place = lines.step == lines.wave_step && lines.apart == lines.wave_apart;
  using Any = Some<Real>;
  return Fftw<Real>::plan_complex(1, &along, 1, &across, Any::waves, is_in_place ? Any::waves : Any::others,
                                  is_forward ? FFTW_FORWARD : FFTW_BACKWARD, rigour);
}

}  // namespace

template <class Real>
struct ComplexFftOf<Real>::Plans {
  Plan<Real> forward, backward;
};

template <class Real>
ComplexFftOf<Real>::ComplexFftOf(const ComplexLines& lines)
    : plans_(new Plans{Plan<Real>([&] { return complex_plan<Real>(lines, true); }),
                       Plan<Real>([&] { return complex_plan<Real>(lines, false); })}) {}
template <class Real>
void ComplexFftOf<Real>::Release::operator()(Plans* plans) const {
  delete plans;
}

template <class Real>
void ComplexFftOf<Real>::forward(std::complex<Real>* values, std::complex<Real>* waves) {
  Fftw<Real>::execute(plans_->forward.get(), fftw(values), fftw(waves));
}
template <class Real>
void ComplexFftOf<Real>::backward(std::complex<Real>* waves, std::complex<Real>* values) {
  Fftw<Real>::execute(plans_->backward.get(), fftw(waves), fftw(values));
}

template <class Real>
struct RealFftOf<Real>::Plans {
  Plan<Real> forward, backward;
};

template <class Real>
RealFftOf<Real>::RealFftOf(const RealLines& lines) {
  const fftw_iodim64 along{lines.length, lines.step, lines.wave_step},
      across{lines.lines, lines.apart, lines.wave_apart};
  const fftw_iodim64 back_along{lines.length, lines.wave_step, lines.step};
  const fftw_iodim64 back_across{lines.lines, lines.wave_apart, lines.apart};
  using Any = Some<Real>;
  plans_.reset(new Plans{
      Plan<Real>([&] { return Fftw<Real>::plan_real(1, &along, 1, &across, Any::values, Any::waves, rigour); }),
      Plan<Real>(
          [&] { return Fftw<Real>::plan_back(1, &back_along, 1, &back_across, Any::waves, Any::values, rigour); })});
}
template <class Real>
void RealFftOf<Real>::Release::operator()(Plans* plans) const {
  delete plans;
}

template <class Real>
void RealFftOf<Real>::forward(const Real* values, std::complex<Real>* waves) {
  Fftw<Real>::execute_real(plans_->forward.get(), const_cast<Real*>(values), fftw(waves));
}
template <class Real>
void RealFftOf<Real>::backward(std::complex<Real>* waves, Real* values) {
  Fftw<Real>::execute_back(plans_->backward.get(), fftw(waves), values);
}

template class ComplexFftOf<double>;
template class ComplexFftOf<float>;
template class RealFftOf<double>;
template class RealFftOf<float>;

}  // namespace dpde
