// SPDX-License-Identifier: Apache-2.0
// Fourier transforms of many lines of one length, of doubles or floats: by FFTW (fft_fftw.cpp), or by Eigen's FFT if
// FFTW was not found when the build was configured (fft_eigen.cpp). Forward and backward together multiply by the
// length. Arrays need the alignment of `new` (is_aligned). Transforms allocate nothing; each object is for one thread
// at a time.
#pragma once

#include <complex>
#include <cstdint>
#include <memory>

namespace dpde {

inline bool is_aligned(const void* values) {
  return reinterpret_cast<std::uintptr_t>(values) % __STDCPP_DEFAULT_NEW_ALIGNMENT__ == 0;
}

struct ComplexLines {
  std::int64_t length, lines;
  std::int64_t step, apart;            // stride between values, between lines
  std::int64_t wave_step, wave_apart;  // the same for the modes; equal to these for transforms in place
};

inline ComplexLines lines_in_place(std::int64_t length, std::int64_t lines, std::int64_t step, std::int64_t apart) {
  return {length, lines, step, apart, step, apart};
}

/// Complex lines, in place (`waves` == `values`) or from one array to another, which does not change the input.
template <class Real>
class ComplexFftOf {
 public:
  explicit ComplexFftOf(const ComplexLines& lines);

  void forward(std::complex<Real>* values, std::complex<Real>* waves);
  void backward(std::complex<Real>* waves, std::complex<Real>* values);
  void forward(std::complex<Real>* values) { forward(values, values); }
  void backward(std::complex<Real>* values) { backward(values, values); }

 private:
  struct Plans;
  struct Release {
    void operator()(Plans* plans) const;
  };
  std::unique_ptr<Plans, Release> plans_;
};
using ComplexFft = ComplexFftOf<double>;

struct RealLines {
  std::int64_t length, lines;          // length: 2 or more
  std::int64_t step, apart;            // of real values
  std::int64_t wave_step, wave_apart;  // of the length/2 + 1 waves
};

/// Real lines to the non-redundant half of their spectrum.
template <class Real>
class RealFftOf {
 public:
  explicit RealFftOf(const RealLines& lines);

  void forward(const Real* values, std::complex<Real>* waves);
  /// Overwrites the waves.
  void backward(std::complex<Real>* waves, Real* values);

 private:
  struct Plans;
  struct Release {
    void operator()(Plans* plans) const;
  };
  std::unique_ptr<Plans, Release> plans_;
};
using RealFft = RealFftOf<double>;

}  // namespace dpde
