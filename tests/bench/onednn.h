// SPDX-License-Identifier: Apache-2.0
// One convolution of oneDNN, single precision, zero padding, its own layout.
#pragma once

#include <cstdint>
#include <memory>

namespace dpde::bench {

class OneDnnConvolution {
 public:
  virtual ~OneDnnConvolution() = default;
  virtual void run() = 0;
};

/// For those made from now on.
void set_onednn_threads(int threads);

/// `pass`: 0 forward, 1 gradient of the input, 2 of the weights. Null: built without oneDNN.
std::unique_ptr<OneDnnConvolution> make_onednn(int pass, int64_t channels, int64_t cells, int64_t extent);

}  // namespace dpde::bench
