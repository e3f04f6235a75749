// SPDX-License-Identifier: Apache-2.0
#include "solve/fourier/line_waves.h"

#include <algorithm>
#include <cstdlib>
#include <numbers>
#include <type_traits>

#include "base/aligned_memory.h"

namespace dpde {
namespace {

template <class Real>
using Complex = std::complex<Real>;

template <class Real>
Complex<Real>* complex(Real* values) {
  return reinterpret_cast<Complex<Real>*>(values);
}

/// exp(i*pi*numerator/denominator)
template <class Real>
Complex<Real> turned(std::int64_t numerator, std::int64_t denominator) {
  return Complex<Real>(
      std::polar(1.0, std::numbers::pi * static_cast<double>(numerator) / static_cast<double>(denominator)));
}

/// For complex rows p = w*a and q = conj(w)*b: a = p + q, b = sign*i*(p - q).
template <class Real>
void join(Real* a, Real* b, Complex<Real> w, int sign) {
  const Real c = w.real(), s = w.imag();
  for (std::int64_t i = 0; i < LineWavesOf<Real>::width; i += 2) {
    const Real p_real = c * a[i] - s * a[i + 1], p_imag = c * a[i + 1] + s * a[i];
    const Real q_real = c * b[i] + s * b[i + 1], q_imag = c * b[i + 1] - s * b[i];
    a[i] = p_real + q_real;
    a[i + 1] = p_imag + q_imag;
    b[i] = static_cast<Real>(sign) * (q_imag - p_imag);
    b[i + 1] = static_cast<Real>(sign) * (p_real - q_real);
  }
}

/// a = conj(w)*(a - i*b), b = w*(a + i*b): the inverse of join, up to a factor of 2.
template <class Real>
void split(Real* a, Real* b, Complex<Real> w) {
  const Real c = w.real(), s = w.imag();
  for (std::int64_t i = 0; i < LineWavesOf<Real>::width; i += 2) {
    const Real p_real = a[i] + b[i + 1], p_imag = a[i + 1] - b[i];
    const Real q_real = a[i] - b[i + 1], q_imag = a[i + 1] + b[i];
    a[i] = c * p_real + s * p_imag;
    a[i + 1] = c * p_imag - s * p_real;
    b[i] = c * q_real - s * q_imag;
    b[i + 1] = c * q_imag + s * q_real;
  }
}

template <class Real>
void multiply_row(Real* row, double factor) {
  for (std::int64_t i = 0; i < LineWavesOf<Real>::width; ++i) row[i] *= static_cast<Real>(factor);
}

template <class Real>
void multiply_complex(Real* row, const Real* factors, std::int64_t numbers) {
  for (std::int64_t i = 0; i < numbers; i += 2) {
    const Real real = row[i] * factors[i] - row[i + 1] * factors[i + 1];
    row[i + 1] = row[i] * factors[i + 1] + row[i + 1] * factors[i];
    row[i] = real;
  }
}

template <class Real>
void copy_in(const Real* from, std::int64_t apart, std::int64_t count, std::type_identity_t<Real> sign, Real* row) {
  if (apart == 1 && count == LineWavesOf<Real>::width) {
    for (std::int64_t i = 0; i < LineWavesOf<Real>::width; ++i) row[i] = sign * from[i];
    return;
  }
  for (std::int64_t i = 0; i < count; ++i) row[i] = sign * from[i * apart];
  std::fill(row + count, row + LineWavesOf<Real>::width, Real(0));
}

template <class Real>
void copy_out(const Real* row, std::type_identity_t<Real> sign, Real* to, std::int64_t apart, std::int64_t count) {
  if (apart == 1 && count == LineWavesOf<Real>::width) {
    for (std::int64_t i = 0; i < LineWavesOf<Real>::width; ++i) to[i] = sign * row[i];
    return;
  }
  for (std::int64_t i = 0; i < count; ++i) to[i * apart] = sign * row[i];
}

}  // namespace

template <class Real>
LineWavesOf<Real>::LineWavesOf(std::int64_t cells, Sides sides, bool are_complex, std::int64_t step, std::int64_t block)
    : cells_(cells), modes_(cells), sides_(sides), have_complex_waves_(are_complex || sides == Sides::periodic) {
  if (sides == Sides::periodic && are_complex) {
    step_ = step;
    block_ = block;
    complex_.emplace(lines_in_place(cells, block / 2, step / 2, 1));
    return;
  }
  values_ = AlignedValuesOf<Real>(cells * width);
  begin_ = values_.get();
  make_sources();
  make_turns();
  if (sides == Sides::periodic) {
    modes_ = cells / 2 + 1;
    other_ = AlignedValuesOf<Real>(2 * modes_ * width);
    real_.emplace(RealLines{cells, width, width, 1, width, 1});
    return;
  }
  const bool has_halves = is_mixed() && cells % 2 == 0;
  if (is_mixed() && !has_halves) other_ = AlignedValuesOf<Real>(2 * cells * width);
  complex_.emplace(lines_in_place(has_halves ? cells / 2 : cells, width / 2, width / 2, 1));
}

template <class Real>
void LineWavesOf<Real>::make_sources() {
  for (std::int64_t row = 0; row < cells_; ++row) {
    const std::int64_t ascending = (cells_ + 1) / 2;
    Source source{row, 1};
    if (sides_ == Sides::even_even || sides_ == Sides::odd_odd) {
      source.cell = row < ascending ? 2 * row : 2 * (cells_ - row) - 1;
      if (sides_ == Sides::odd_odd && row >= ascending) source.sign = -1;
    } else if (is_mixed() && cells_ % 2 == 0) {
      source.cell = row < cells_ / 2 ? 2 * row : 2 * (cells_ - row) - 1;
    }
    if (sides_ == Sides::odd_even) source.cell = cells_ - 1 - source.cell;
    sources_.push_back(source);
  }
}

template <class Real>
void LineWavesOf<Real>::make_turns() {
  const std::int64_t n = cells_;
  if (!is_mixed()) {
    for (std::int64_t k = 0; k < (n + 1) / 2; ++k) after_.push_back(turned<Real>(-k, 2 * n));
    return;
  }
  const std::int64_t each = n % 2 == 0 ? 2 : 1;
  for (std::int64_t k = 0; k < n / each; ++k) {
    before_.push_back(turned<Real>(-(2 * each * k + 1), 4 * n));
    after_.push_back(turned<Real>(-k, n));
  }
}

template <class Real>
std::int64_t LineWavesOf<Real>::period() const {
  return sides_ == Sides::periodic ? cells_ : is_mixed() ? 4 * cells_ : 2 * cells_;
}

template <class Real>
std::int64_t LineWavesOf<Real>::turns(std::int64_t mode) const {
  switch (sides_) {
    case Sides::periodic:
    case Sides::even_even: return mode;
    case Sides::odd_odd: return cells_ - mode;
    case Sides::even_odd:
    case Sides::odd_even: break;
  }
  const bool is_natural = cells_ % 2 != 0;
  return 2 * (is_natural ? mode : mode < cells_ / 2 ? 2 * mode : 2 * (cells_ - mode) - 1) + 1;
}

template <class Real>
void LineWavesOf<Real>::read(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count) {
  Real* row = values_.get();
  for (const Source& source : sources_) {
    copy_in(from + source.cell * step, apart, count, source.sign, row);
    row += width;
  }
}

template <class Real>
void LineWavesOf<Real>::write(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const {
  const Real* row = values_.get();
  for (const Source& source : sources_) {
    copy_out(row, source.sign, to + source.cell * step, apart, count);
    row += width;
  }
}

template <class Real>
void LineWavesOf<Real>::read_waves(const Real* from, std::int64_t step, std::int64_t apart, std::int64_t count) {
  if (real_) {
    for (std::int64_t k = 0; k < modes_; ++k) std::copy_n(from + k * step, 2 * width, other_.get() + 2 * width * k);
    return;
  }
  for (std::int64_t k = 0; k < modes_; ++k) copy_in(from + k * step, apart, count, 1, values_.get() + width * k);
}

template <class Real>
void LineWavesOf<Real>::write_waves(Real* to, std::int64_t step, std::int64_t apart, std::int64_t count) const {
  if (real_) {
    for (std::int64_t k = 0; k < modes_; ++k) std::copy_n(other_.get() + 2 * width * k, 2 * width, to + k * step);
    return;
  }
  for (std::int64_t k = 0; k < modes_; ++k) copy_out(values_.get() + width * k, 1, to + k * step, apart, count);
}

template <class Real>
void LineWavesOf<Real>::multiply(const Real* factors, bool have_phases) {
  const std::int64_t size = growth() * block_, step = real_ ? size : step_;
  Real* row = real_ ? other_.get() : begin_;
  for (std::int64_t k = 0; k < modes_; ++k, row += step) {
    if (have_phases) {
      multiply_complex(row, factors, size);
      factors += size;
    } else if (have_complex_waves_) {
      for (std::int64_t i = 0; i < size / 2; ++i) row[2 * i] *= factors[i], row[2 * i + 1] *= factors[i];
      factors += size / 2;
    } else {
      for (std::int64_t i = 0; i < size; ++i) row[i] *= factors[i];
      factors += size;
    }
  }
}

/// Modes k and n - k of the complex lines combine to the cosines and sines of both real lines.
template <class Real>
void LineWavesOf<Real>::join_all() {
  Real* const rows = values_.get();
  multiply_row(rows, 2);
  for (std::int64_t k = 1; 2 * k < cells_; ++k)
    join(rows + width * k, rows + width * (cells_ - k), after_[static_cast<std::size_t>(k)], 1);
  if (cells_ % 2 == 0) multiply_row(rows + width * (cells_ / 2), std::numbers::sqrt2);
}

template <class Real>
void LineWavesOf<Real>::split_halves() {
  const std::int64_t half = cells_ / 2;
  Real* const rows = values_.get();
  for (std::int64_t k = 0; k < half; ++k)
    split(rows + width * k, rows + width * (half + k), before_[static_cast<std::size_t>(k)]);
}

template <class Real>
void LineWavesOf<Real>::join_halves() {
  const std::int64_t half = cells_ / 2;
  Real* const rows = values_.get();
  for (std::int64_t k = 0; k < half; ++k)
    join(rows + width * k, rows + width * (half + k), std::conj(after_[static_cast<std::size_t>(k)]), -1);
}

/// Type IV: a forward and a backward transform of all cells, each of which gives one half of the modes.
template <class Real>
void LineWavesOf<Real>::cosines_of_any_length() {
  Real *const values = values_.get(), *const first = other_.get(), *const second = first + width * cells_;
  std::copy_n(values, width * cells_, first);
  std::copy_n(values, width * cells_, second);
  for (std::int64_t j = 0; j < cells_; ++j) {
    const Complex<Real> w = before_[static_cast<std::size_t>(j)];
    for (std::int64_t i = 0; i < width / 2; ++i) {
      complex(first + width * j)[i] *= w;
      complex(second + width * j)[i] *= std::conj(w);
    }
  }
  complex_->forward(complex(first));
  complex_->backward(complex(second));
  for (std::int64_t k = 0; k < cells_; ++k) {
    const Complex<Real> w = after_[static_cast<std::size_t>(k)];
    const bool is_image = 2 * k >= cells_;
    Complex<Real>* const to = complex(values + width * (is_image ? 2 * (cells_ - k) - 1 : 2 * k));
    for (std::int64_t i = 0; i < width / 2; ++i) {
      const Complex<Real> sum = w * complex(first + width * k)[i] + std::conj(w) * complex(second + width * k)[i];
      to[i] = is_image ? -sum : sum;
    }
  }
}

template <class Real>
void LineWavesOf<Real>::forward() {
  if (real_) return real_->forward(values_.get(), complex(other_.get()));
  if (!is_mixed()) {
    complex_->forward(complex(begin_));
    if (sides_ != Sides::periodic) join_all();
    return;
  }
  if (cells_ % 2 != 0) return cosines_of_any_length();
  split_halves();
  complex_->backward(complex(values_.get()));
  complex_->forward(complex(values_.get() + width * (cells_ / 2)));
  join_halves();
}

template <class Real>
void LineWavesOf<Real>::backward() {
  if (real_) return real_->backward(complex(other_.get()), values_.get());
  if (is_mixed()) return forward();  // type IV is its own inverse
  if (sides_ != Sides::periodic) {
    Real* const rows = values_.get();
    for (std::int64_t k = 1; 2 * k < cells_; ++k)
      split(rows + width * k, rows + width * (cells_ - k), after_[static_cast<std::size_t>(k)]);
    if (cells_ % 2 == 0) multiply_row(rows + width * (cells_ / 2), std::numbers::sqrt2);
  }
  complex_->backward(complex(begin_));
}

template class LineWavesOf<double>;
template class LineWavesOf<float>;

}  // namespace dpde
