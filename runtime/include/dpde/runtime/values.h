// SPDX-License-Identifier: Apache-2.0
// Array arguments of a host: spans, vectors, arrays, Eigen vectors, matrices and maps, or a pointer and a count. Always
// the interior values of a field, contiguous, x fastest: value (x, y, z) has index x + nx*(y + ny*z). An Eigen matrix
// is taken in memory order: an ArrayXXd of nx rows and ny columns fits, and so does a row-major (ny, nx).
#pragma once

#include <concepts>
#include <cstddef>
#include <span>

#include "dpde/runtime/error.h"

namespace dpde {

template <class Array, class Element>
concept ArrayOf = requires(Array& a) {
  { a.data() } -> std::convertible_to<Element*>;
  { a.size() } -> std::convertible_to<std::size_t>;
};

/// @throws Error(input) for an Eigen expression whose values are not contiguous.
template <class Array>
void require_contiguous(const Array& array) {
  if constexpr (requires {
                  array.innerStride();
                  array.outerStride();
                  array.innerSize();
                  array.outerSize();
                }) {
    const bool rows = array.innerSize() > 1 && array.innerStride() != 1;
    if (rows || (array.outerSize() > 1 && array.outerStride() != array.innerSize())) {
      throw Error(ErrorKind::input, "the values of this Eigen expression are not contiguous; copy it to a vector");
    }
  }
}

/// Values to read.
class Values : public std::span<const double> {
 public:
  Values(const double* first, std::size_t count) : span(first, count) {}
  template <class Array>
  requires ArrayOf<const Array, const double> Values(const Array& array)
      : span(array.data(), static_cast<std::size_t>(array.size())) {  // NOLINT: implicit
    require_contiguous(array);
  }
};

/// Values to write; a temporary is allowed if it is a view (a map, a span).
class Target : public std::span<double> {
 public:
  Target(double* first, std::size_t count) : span(first, count) {}
  template <class Array>
  requires ArrayOf < std::remove_reference_t<Array>,
  double > Target(Array&& array) : span(array.data(), static_cast<std::size_t>(array.size())) {  // NOLINT: implicit
    require_contiguous(array);
  }
};

}  // namespace dpde
