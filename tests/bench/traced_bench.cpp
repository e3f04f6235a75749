// SPDX-License-Identifier: Apache-2.0
// Value and gradient of 32 semi-Lagrangian steps of 1-D Burgers with 128 cells, beside a loop by hand. Both must find
// the same.
#include <cmath>

#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "generated.h"
#include "handwritten.h"

namespace dpde::bench {
namespace {

constexpr int64_t cells = 128;
constexpr int steps = 32;
constexpr double nu = 0.01 / M_PI, step = 1.0 / steps, width = 2.0 / cells;

const std::string text = R"(
model burgers { field u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
scheme traced { advect = semi_lagrangian; time = euler }
scene s : burgers with traced {
  grid x = -1 .. 1, cells 128, periodic
  nu = 0.01/pi
  initial u = -sin(pi*x)
  time 0 .. 1, step 1/32
}
task t : s { unknown initial u; minimise mean(u^2) at t = 1 }
)";

struct ByHand {
  std::vector<double> start, mids, rows[2];
  double* work[2];
  ByHand() : start(cells), mids(steps * (cells + 16)) {
    for (int64_t i = 0; i < cells; ++i)
      start[static_cast<size_t>(i)] = -std::sin(M_PI * ((static_cast<double>(i) + 0.5) * width - 1));
    for (int k = 0; k < 2; ++k) {
      rows[k].resize(cells + 16);
      work[k] = rows[k].data() + 8;
    }
  }
  double run() {
    return handwritten::traced_gradient(cells, start.data(), mids.data(), cells + 16, steps,
                                        {step / width, nu * step / (width * width)}, work);
  }
};

void traced_gradient(benchmark::State& state, Code code) {
  ByHand hand;
  if (code == Code::hand) {
    for (auto _ : state) benchmark::DoNotOptimize(hand.run());
    return;
  }
  const SourceFile source("bench.dpde", text);
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compile(text, code), {}, sink);
  if (!session) std::abort();
  const auto inverse = driver::Inverse::open(*session, source, sink);
  if (!inverse) std::abort();
  Eigen::VectorXd gradient(inverse->size());
  const double difference = inverse->value_and_gradient(inverse->start(), gradient) - hand.run();
  double most = std::abs(difference);
  for (int64_t i = 0; i < cells; ++i) most = std::max(most, std::abs(gradient[i] - hand.work[0][i]));
  if (!(most < 1e-12)) state.SkipWithError("not what the loop by hand finds");
  for (auto _ : state) benchmark::DoNotOptimize(inverse->value_and_gradient(inverse->start(), gradient));
}

BENCHMARK_CAPTURE(traced_gradient, hand, Code::hand)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(traced_gradient, jit, Code::jit)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(traced_gradient, cpp, Code::cpp)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace dpde::bench
