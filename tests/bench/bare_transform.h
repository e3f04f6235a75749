// SPDX-License-Identifier: Apache-2.0
// Plans of FFTW for a whole grid, which Fourier solves are measured against.
#pragma once

#include <cstdint>
#include <memory>

namespace dpde {

class BareTransform {
 public:
  virtual ~BareTransform() = default;
  virtual void there_and_back() = 0;
};

/// Of n cells along each axis: half the waves of a periodic grid, or cosines. None where FFTW is not there.
std::unique_ptr<BareTransform> bare_transform(std::int64_t n, int rank, bool is_periodic);

}  // namespace dpde
