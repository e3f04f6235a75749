// SPDX-License-Identifier: Apache-2.0
// Line by line, for builds without FFTW.
#include <unsupported/Eigen/FFT>
#include <vector>

#include "transform/fft.h"

namespace dpde {
namespace {

template <class Real>
struct Line {
  using Fft = Eigen::FFT<Real>;
  Fft fft{typename Fft::impl_type(), static_cast<typename Fft::Flag>(Fft::HalfSpectrum | Fft::Unscaled)};
  std::int64_t length;
  std::vector<std::complex<Real>> from, to;
  std::vector<Real> real;

  explicit Line(std::int64_t n)
      : length(n), from(static_cast<std::size_t>(n)), to(from.size()), real(from.size(), Real(0)) {}
  /// A single value is its own transform: Eigen crashes on length 1.
  void run_complex(bool is_forward) {
    if (length == 1) {
      to[0] = from[0];
    } else if (is_forward) {
      fft.fwd(to.data(), from.data(), length);
    } else {
      fft.inv(to.data(), from.data(), length);
    }
  }
  void run_real(bool is_forward) {
    if (is_forward) {
      fft.fwd(to.data(), real.data(), length);
    } else {
      fft.inv(real.data(), from.data(), length);
    }
  }
};

/// Copies between values with stride `step` and contiguous values.
template <class Value>
void gather(const Value* from, std::int64_t step, std::int64_t count, Value* to) {
  for (std::int64_t i = 0; i < count; ++i) to[i] = from[i * step];
}
template <class Value>
void scatter(const Value* from, std::int64_t count, Value* to, std::int64_t step) {
  for (std::int64_t i = 0; i < count; ++i) to[i * step] = from[i];
}

}  // namespace

template <class Real>
struct ComplexFftOf<Real>::Plans {
  Line<Real> line;
  ComplexLines lines;
};

template <class Real>
ComplexFftOf<Real>::ComplexFftOf(const ComplexLines& lines) : plans_(new Plans{Line<Real>(lines.length), lines}) {
  for (const bool is_forward : {true, false}) plans_->line.run_complex(is_forward);
}
template <class Real>
void ComplexFftOf<Real>::Release::operator()(Plans* plans) const {
  delete plans;
}

template <class Real>
void ComplexFftOf<Real>::forward(std::complex<Real>* values, std::complex<Real>* waves) {
  const ComplexLines& lines = plans_->lines;
  Line<Real>& line = plans_->line;
  for (std::int64_t i = 0; i < lines.lines; ++i, values += lines.apart, waves += lines.wave_apart) {
    gather(values, lines.step, lines.length, line.from.data());
    line.run_complex(true);
    scatter(line.to.data(), lines.length, waves, lines.wave_step);
  }
}

template <class Real>
void ComplexFftOf<Real>::backward(std::complex<Real>* waves, std::complex<Real>* values) {
  const ComplexLines& lines = plans_->lines;
  Line<Real>& line = plans_->line;
  for (std::int64_t i = 0; i < lines.lines; ++i, values += lines.apart, waves += lines.wave_apart) {
    gather(waves, lines.wave_step, lines.length, line.from.data());
    line.run_complex(false);
    scatter(line.to.data(), lines.length, values, lines.step);
  }
}

template <class Real>
struct RealFftOf<Real>::Plans {
  Line<Real> line;
  RealLines lines;
};

// Both constructors run both directions once, so that Eigen builds its tables.
template <class Real>
RealFftOf<Real>::RealFftOf(const RealLines& lines) : plans_(new Plans{Line<Real>(lines.length), lines}) {
  for (const bool is_forward : {true, false}) plans_->line.run_real(is_forward);
}
template <class Real>
void RealFftOf<Real>::Release::operator()(Plans* plans) const {
  delete plans;
}

template <class Real>
void RealFftOf<Real>::forward(const Real* values, std::complex<Real>* waves) {
  const RealLines& lines = plans_->lines;
  Line<Real>& line = plans_->line;
  for (std::int64_t i = 0; i < lines.lines; ++i, values += lines.apart, waves += lines.wave_apart) {
    gather(values, lines.step, lines.length, line.real.data());
    line.run_real(true);
    scatter(line.to.data(), lines.length / 2 + 1, waves, lines.wave_step);
  }
}

template <class Real>
void RealFftOf<Real>::backward(std::complex<Real>* waves, Real* values) {
  const RealLines& lines = plans_->lines;
  Line<Real>& line = plans_->line;
  for (std::int64_t i = 0; i < lines.lines; ++i, values += lines.apart, waves += lines.wave_apart) {
    gather(waves, lines.wave_step, lines.length / 2 + 1, line.from.data());
    line.run_real(false);
    scatter(line.real.data(), lines.length, values, lines.step);
  }
}

template class ComplexFftOf<double>;
template class ComplexFftOf<float>;
template class RealFftOf<double>;
template class RealFftOf<float>;

}  // namespace dpde
