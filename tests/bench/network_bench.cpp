// SPDX-License-Identifier: Apache-2.0
// Convolutions of 32 to 32 channels, single precision, with their margins: forward, gradient of the input, gradient of
// the weights. Beside them oneDNN in the layout that it likes best (where it was found when this was built) and Eigen's
// products of matrices. Items are floating-point operations. Compare medians of one run:
//   bench_network --benchmark_filter=conv --benchmark_repetitions=9 --benchmark_enable_random_interleaving=true
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <cstdlib>
#include <memory>
#include <vector>

#include "blas_product.h"
#include "dpde/runtime/field.h"
#include "network/kernels/convolve.h"
#include "network/padding.h"
#include "onednn.h"
#include "runtime/network_cases.h"

namespace dpde::bench {
namespace {

enum Pass { forward, data, weights };

double flops(const benchmark::State& state, int64_t channels) {
  const double n = static_cast<double>(state.range(0)), extent = static_cast<double>(state.range(1));
  return 2 * n * n * extent * extent * static_cast<double>(channels * channels);
}
void count(benchmark::State& state, int64_t channels) {
  state.SetItemsProcessed(static_cast<int64_t>(flops(state, channels)) * state.iterations());
}

/// Memory that begins on 64 bytes, filled with numbers of order 1.
class Values {
 public:
  explicit Values(int64_t size)
      : memory_(static_cast<float*>(std::aligned_alloc(64, static_cast<size_t>((size * 4 + 63) / 64 * 64)))) {
    for (int64_t i = 0; i < size; ++i) memory_.get()[i] = static_cast<float>(i % 17) / 17 - 0.4f;
  }
  float* get() const { return memory_.get(); }

 private:
  struct Free {
    void operator()(float* memory) const { std::free(memory); }
  };
  std::unique_ptr<float, Free> memory_;
};

void conv_planes(benchmark::State& state, Pass pass, int channels, int threads) {
  test::TestNetwork network(2, channels, {}, DPDE_F32);
  network.conv({.channels = channels, .extent = static_cast<int>(state.range(1)), .bias = false});
  const dpde_layout layout = make_layout(std::vector<int64_t>{state.range(0), state.range(0)}, {});
  const nn::Plan plan = nn::make_plan(network.table(), layout, nn::kernels<float>().widest_block);
  const nn::Convolution& convolution = plan.steps[0].convolution;
  const nn::Shape &in = plan.values[0].shape, &out = plan.values[1].shape, &seeds = plan.values[1].adjoint,
                  &bars = plan.values[0].adjoint;
  const Values a(in.size), b(out.size), c(seeds.size), d(bars.size),
      w(static_cast<int64_t>(convolution.forward.weights.size()));
  std::vector<double> weight_bars(convolution.forward.weights.size());
  const nn::View<float> input{a.get() + in.origin, &in}, output{b.get() + out.origin, &out},
      seed{c.get() + seeds.origin, &seeds}, bar{d.get() + bars.origin, &bars};
  const nn::Range range{{}, plan.values[0].cells};
  for (auto _ : state) {
    const nn::View<float>& padded = pass == forward ? input : seed;
    for (int64_t channel = 0; channel < channels; ++channel) {
      if (pass == weights)
        nn::clear_margin(*padded.shape, padded.plane(channel));
      else
        nn::fill_margin(*padded.shape, padded.plane(channel));
    }
    if (pass == forward) nn::convolve(threads, convolution.forward, w.get(), input, {output}, range, {});
    if (pass == data) nn::convolve(threads, convolution.reverse[0], w.get(), seed, {bar}, range, {});
    if (pass == weights) nn::add_weight_gradient(threads, convolution.forward, input, seed, weight_bars.data());
    benchmark::ClobberMemory();
  }
  count(state, channels);
}

void conv_onednn(benchmark::State& state, Pass pass, int channels, int threads) {
  set_onednn_threads(threads);
  const std::unique_ptr<OneDnnConvolution> convolution =
      make_onednn(static_cast<int>(pass), channels, state.range(0), state.range(1));
  if (!convolution) return state.SkipWithError("built without oneDNN");
  for (auto _ : state) convolution->run();
  count(state, channels);
}

/// Columns of cells, rows of terms; then a product of matrices.
void conv_eigen(benchmark::State& state, Pass pass, int channels, int) {
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const int64_t n = state.range(0), extent = state.range(1), half = extent / 2, terms = channels * extent * extent;
  const Matrix w = Matrix::Random(channels, terms), seeds = Matrix::Random(channels, n * n),
               in = Matrix::Random(channels, n * n);
  Matrix columns(terms, n * n), out(channels, n * n), bars = Matrix::Zero(channels, terms);
  Eigen::setNbThreads(1);
  const auto wrapped = [n](int64_t k) { return (k + n) % n; };
  for (auto _ : state) {
    for (int64_t term = 0; term < terms; ++term) {
      const float* const plane = in.data() + term / (extent * extent) * n * n;
      const int64_t dy = term / extent % extent - half, dx = term % extent - half;
      for (int64_t y = 0; y < n; ++y) {
        float* const row = columns.data() + (term * n + y) * n;
        const float* const from = plane + wrapped(y + dy) * n;
        for (int64_t x = 0; x < n; ++x) row[x] = from[x + dx < 0 ? x + dx + n : x + dx >= n ? x + dx - n : x + dx];
      }
    }
    if (pass == weights)
      bars.noalias() += seeds * columns.transpose();
    else
      out.noalias() = w * columns;
    benchmark::ClobberMemory();
  }
  count(state, channels);
}

/// The product of matrices that the convolution is, by BLAS: columns of cells are there already, and nothing is padded.
void conv_blas(benchmark::State& state, Pass pass, int channels, int) {
  const int cells = static_cast<int>(state.range(0) * state.range(0)),
            terms = static_cast<int>(channels * state.range(1) * state.range(1));
  const Values w(int64_t{channels} * terms), columns(int64_t{terms} * cells), out(int64_t{channels} * cells);
  for (auto _ : state) {
    const bool is_there = pass == weights
                              ? blas_product(channels, terms, cells, out.get(), columns.get(), true, w.get())
                              : blas_product(channels, cells, terms, w.get(), columns.get(), false, out.get());
    if (!is_there) return state.SkipWithError("built without OpenBLAS");
    benchmark::ClobberMemory();
  }
  count(state, channels);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int64_t extent : {3, 5}) {
    for (const int64_t n : {64, 128, 256}) benchmark->Args({n, extent});
  }
}
void two_threads(benchmark::internal::Benchmark* benchmark) {
  for (const int64_t extent : {3, 5}) benchmark->Args({128, extent})->Args({256, extent});
  benchmark->UseRealTime();
}
BENCHMARK_CAPTURE(conv_planes, forward, forward, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_onednn, forward, forward, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_eigen, forward, forward, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_planes, data, data, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_onednn, data, data, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_planes, weights, weights, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_onednn, weights, weights, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_eigen, weights, weights, 32, 1)->Apply(sizes);
BENCHMARK_CAPTURE(conv_planes, forward_2_threads, forward, 32, 2)->Apply(two_threads);
BENCHMARK_CAPTURE(conv_onednn, forward_2_threads, forward, 32, 2)->Apply(two_threads);
BENCHMARK_CAPTURE(conv_planes, weights_2_threads, weights, 32, 2)->Apply(two_threads);
BENCHMARK_CAPTURE(conv_onednn, weights_2_threads, weights, 32, 2)->Apply(two_threads);
BENCHMARK_CAPTURE(conv_planes, forward_8_channels, forward, 8, 1)->Args({128, 3})->Args({128, 5});
BENCHMARK_CAPTURE(conv_onednn, forward_8_channels, forward, 8, 1)->Args({128, 3})->Args({128, 5});
BENCHMARK_CAPTURE(conv_planes, weights_8_channels, weights, 8, 1)->Args({128, 3})->Args({128, 5});
BENCHMARK_CAPTURE(conv_onednn, weights_8_channels, weights, 8, 1)->Args({128, 3})->Args({128, 5});
/// Rows of any length; 128^2 cells would have 147 MiB of columns.
void rows(benchmark::internal::Benchmark* benchmark) {
  for (const int64_t n : {34, 48, 64}) benchmark->Args({n, 3});
}
BENCHMARK_CAPTURE(conv_planes, forward_24_channels, forward, 24, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, forward_24_channels, forward, 24, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, forward_32_channels, forward, 32, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, forward_32_channels, forward, 32, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, forward_64_channels, forward, 64, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, forward_64_channels, forward, 64, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, forward_128_channels, forward, 128, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, forward_128_channels, forward, 128, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, data_24_channels, data, 24, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, data_32_channels, data, 32, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, data_64_channels, data, 64, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, data_128_channels, data, 128, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, weights_24_channels, weights, 24, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, weights_24_channels, weights, 24, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, weights_32_channels, weights, 32, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, weights_32_channels, weights, 32, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, weights_64_channels, weights, 64, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, weights_64_channels, weights, 64, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_planes, weights_128_channels, weights, 128, 1)->Apply(rows);
BENCHMARK_CAPTURE(conv_blas, weights_128_channels, weights, 128, 1)->Apply(rows);

/// Whole networks: fields in, fields out. `adjoint` is forward and back, with gradients of inputs and weights.
void run_network(benchmark::State& state, test::TestNetwork network, std::vector<int64_t> cells, bool adjoint) {
  const dpde_network& table = network.table();
  const dpde_layout layout = make_layout(cells, {}, DPDE_F32);
  Network run(table, layout, 1);
  run.set_weights(std::vector<double>(static_cast<size_t>(table.weight_count), 0.01).data());
  std::vector<Field> fields;
  for (int k = 0; k < 2 * (table.inputs + table.outputs); ++k) fields.emplace_back(layout, k).fill(0.5);
  std::vector<void*> in, out, in_bars, out_bars;
  for (Field& field : fields) {
    std::vector<void*>& to = std::ssize(in) < table.inputs        ? in
                             : std::ssize(out) < table.outputs    ? out
                             : std::ssize(in_bars) < table.inputs ? in_bars
                                                                  : out_bars;
    to.push_back(field.base());
  }
  std::vector<double> weight_bars(static_cast<size_t>(table.weight_count));
  for (auto _ : state) {
    if (adjoint)
      run.adjoint(in.data(), out_bars.data(), in_bars.data(), weight_bars.data());
    else
      run.value(in.data(), out.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * cell_count(layout));
}

using Conv = test::TestNetwork::Conv;

/// Six layers of convolution and relu, two fields in and out.
test::TestNetwork corrector(int rank, int channels) {
  test::TestNetwork network(rank, 2, {}, DPDE_F32);
  for (int layer = 0; layer < 5; ++layer) {
    network.conv(Conv{channels});
    network.activate(DPDE_RELU);
  }
  network.conv(Conv{2});
  return network;
}
test::TestNetwork per_cell() {
  test::TestNetwork network(2, 3, {}, DPDE_F32);
  for (int layer = 0; layer < 3; ++layer) {
    network.conv(Conv{16, 1});
    network.activate(DPDE_TANH);
  }
  network.conv(Conv{1, 1});
  return network;
}

/// Two levels, once by a pool and once by a stride; bounded axes.
test::TestNetwork u_net(int32_t padding, int32_t real) {
  test::TestNetwork network(2, 2, {padding, padding, padding}, real);
  network.conv(Conv{16});
  const int fine = network.activate(DPDE_RELU);
  network.pool(DPDE_MEAN_POOL, 2);
  network.conv(Conv{16});
  const int coarse = network.activate(DPDE_RELU);
  network.conv({.channels = 32, .stride = 2});
  network.activate(DPDE_RELU);
  network.pool(DPDE_UPSAMPLE, 2);
  network.join(DPDE_CONCAT, coarse, network.last());
  network.conv(Conv{16});
  network.activate(DPDE_RELU);
  network.pool(DPDE_UPSAMPLE, 2);
  network.join(DPDE_CONCAT, fine, network.last());
  network.conv(Conv{2});
  network.unary(DPDE_FIX_SUM, 0);
  return network;
}
void u_net_2d(benchmark::State& state, int32_t padding, int32_t real, bool adjoint) {
  run_network(state, u_net(padding, real), {128, 128}, adjoint);
}
BENCHMARK_CAPTURE(u_net_2d, periodic, DPDE_PAD_PERIODIC, DPDE_F32, false);
BENCHMARK_CAPTURE(u_net_2d, periodic_adjoint, DPDE_PAD_PERIODIC, DPDE_F32, true);
BENCHMARK_CAPTURE(u_net_2d, replicate, DPDE_PAD_REPLICATE, DPDE_F32, false);
BENCHMARK_CAPTURE(u_net_2d, replicate_adjoint, DPDE_PAD_REPLICATE, DPDE_F32, true);
BENCHMARK_CAPTURE(u_net_2d, f64, DPDE_PAD_PERIODIC, DPDE_F64, false);
BENCHMARK_CAPTURE(u_net_2d, f64_adjoint, DPDE_PAD_PERIODIC, DPDE_F64, true);

void corrector_2d(benchmark::State& state, int channels, bool adjoint) {
  run_network(state, corrector(2, channels), {128, 128}, adjoint);
}
void corrector_1d(benchmark::State& state, int channels, bool adjoint) {
  run_network(state, corrector(1, channels), {state.range(0)}, adjoint);
}
void closure_per_cell(benchmark::State& state, bool adjoint) { run_network(state, per_cell(), {512, 512}, adjoint); }
BENCHMARK_CAPTURE(corrector_2d, channels_32, 32, false);
BENCHMARK_CAPTURE(corrector_2d, channels_32_adjoint, 32, true);
BENCHMARK_CAPTURE(corrector_2d, channels_8, 8, false);
BENCHMARK_CAPTURE(corrector_2d, channels_8_adjoint, 8, true);
BENCHMARK_CAPTURE(corrector_1d, channels_8, 8, false)->Arg(128)->Arg(4096);
BENCHMARK_CAPTURE(corrector_1d, channels_8_adjoint, 8, true)->Arg(128)->Arg(4096);
BENCHMARK_CAPTURE(closure_per_cell, value, false);
BENCHMARK_CAPTURE(closure_per_cell, adjoint, true);

}  // namespace
}  // namespace dpde::bench
