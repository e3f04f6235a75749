// SPDX-License-Identifier: Apache-2.0
// Written for oneDNN 2.
#include "onednn.h"

#include <omp.h>

#include <dnnl.hpp>
#include <unordered_map>

namespace dpde::bench {
namespace {

using dnnl::memory;

class Convolution final : public OneDnnConvolution {
 public:
  Convolution(int pass, int64_t channels, int64_t cells, int64_t extent) {
    const auto any = memory::format_tag::any;
    const memory::desc data({1, channels, cells, cells}, memory::data_type::f32, any);
    const memory::desc weights({channels, channels, extent, extent}, memory::data_type::f32, any);
    const memory::dims strides{1, 1}, pad{extent / 2, extent / 2};
    const auto direct = dnnl::algorithm::convolution_direct;
    const dnnl::convolution_forward::primitive_desc hint(
        {dnnl::prop_kind::forward_training, direct, data, weights, data, strides, pad, pad}, engine_);
    if (pass == 0) {
      add(DNNL_ARG_SRC, hint.src_desc());
      add(DNNL_ARG_WEIGHTS, hint.weights_desc());
      add(DNNL_ARG_DST, hint.dst_desc());
      primitive_ = dnnl::convolution_forward(hint);
    } else if (pass == 1) {
      const dnnl::convolution_backward_data::primitive_desc back({direct, data, weights, data, strides, pad, pad},
                                                                 engine_, hint);
      add(DNNL_ARG_DIFF_SRC, back.diff_src_desc());
      add(DNNL_ARG_WEIGHTS, back.weights_desc());
      add(DNNL_ARG_DIFF_DST, back.diff_dst_desc());
      primitive_ = dnnl::convolution_backward_data(back);
    } else {
      const dnnl::convolution_backward_weights::primitive_desc back({direct, data, weights, data, strides, pad, pad},
                                                                    engine_, hint);
      add(DNNL_ARG_SRC, back.src_desc());
      add(DNNL_ARG_DIFF_WEIGHTS, back.diff_weights_desc());
      add(DNNL_ARG_DIFF_DST, back.diff_dst_desc());
      primitive_ = dnnl::convolution_backward_weights(back);
    }
  }
  void run() override {
    primitive_.execute(stream_, arguments_);
    stream_.wait();
  }

 private:
  void add(int name, const memory::desc& desc) {
    memory values(desc, engine_);
    float* const begin = static_cast<float*>(values.get_data_handle());
    for (size_t i = 0; i < desc.get_size() / sizeof(float); ++i) begin[i] = static_cast<float>(i % 17) / 17 - 0.4f;
    arguments_.emplace(name, values);
  }

  dnnl::engine engine_{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream_{engine_};
  std::unordered_map<int, memory> arguments_;
  dnnl::primitive primitive_;
};

}  // namespace

void set_onednn_threads(int threads) { omp_set_num_threads(threads); }

std::unique_ptr<OneDnnConvolution> make_onednn(int pass, int64_t channels, int64_t cells, int64_t extent) {
  return std::make_unique<Convolution>(pass, channels, cells, extent);
}

}  // namespace dpde::bench
