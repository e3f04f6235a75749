// SPDX-License-Identifier: Apache-2.0
#include "network/runner.h"

#include <algorithm>
#include <vector>

#include "grid/real.h"
#include "network/engine.h"
#include "network/host_runner.h"

namespace dpde::nn {
namespace {

template <class Real>
class WholeGrid final : public Runner {
 public:
  WholeGrid(const Plan& plan, const Team& team)
      : ports_{nullptr, 0, cell_count(plan.layout)}, layout_(plan.layout), engine_(plan, team) {
    ports_.layout = &layout_;
  }
  bool set_weights(const double* weights) override { return engine_.set_weights(weights); }
  void value(void* const* inputs, void* const* outputs) override { engine_.value(ports_, inputs, outputs); }
  void tangent(void* const* inputs, void* const* input_rates, const double* weight_rates,
               void* const* output_rates) override {
    engine_.tangent(ports_, inputs, input_rates, weight_rates, output_rates);
  }
  void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars) override {
    engine_.adjoint(ports_, inputs, seeds, input_bars, weight_bars);
  }
  void prepare_second() override { engine_.prepare_second(); }
  void second(const NetworkSecond& call) override { engine_.second(ports_, call); }
  int64_t bytes() const override { return engine_.bytes(); }
  int64_t tape_bytes() const override { return engine_.tape_bytes(); }
  int64_t products() const override { return engine_.products(); }
  void write_tapes(Tapes* tapes) override { engine_.write_tapes(tapes); }
  void read_tapes(Tapes* tapes) override { engine_.read_tapes(tapes); }

 private:
  Ports ports_;
  dpde_layout layout_;
  Engine<Real> engine_;
};

constexpr int64_t least_products_for_threads =
    500'000;                          // a few microseconds of convolutions: as long as waking threads
constexpr int64_t block_cells = 480;  // three whole vectors at a time; 100 channels fit the second-level cache

/// A network without neighbours: runs all layers on one block of cells after the other. Blocks belong to shares, whose
/// number depends only on the grid: adjoints of weights are summed in each share and then over the shares, in a fixed
/// order.
template <class Real>
class Blocks final : public Runner {
 public:
  Blocks(const Plan& block, const dpde_layout& layout, const Team& team) : layout_(layout) {
    constexpr int64_t most_shares = 16;
    blocks_ = (cell_count(layout) + block_cells - 1) / block_cells;
    shares_ = std::min(blocks_, most_shares);
    const bool is_worth = cell_count(layout) * block.network.weight_count >= least_products_for_threads;
    if (is_worth) team_ = team;
    const auto most = static_cast<int>(std::min<int64_t>(team_.threads(), shares_));
    for (int thread = 0; thread < most; ++thread) engines_.push_back(std::make_unique<Engine<Real>>(block, 1));
    bars_.resize(static_cast<size_t>(shares_ * block.network.weight_count));
    weight_count_ = block.network.weight_count;
  }
  bool set_weights(const double* weights) override {
    bool are_new = false;
    for (const auto& engine : engines_) are_new = engine->set_weights(weights) || are_new;
    return are_new;
  }
  void value(void* const* inputs, void* const* outputs) override {
    for_each_block([&](Engine<Real>& engine, const Ports& ports, int64_t) { engine.value(ports, inputs, outputs); });
  }
  void tangent(void* const* inputs, void* const* input_rates, const double* weight_rates,
               void* const* output_rates) override {
    for_each_block([&](Engine<Real>& engine, const Ports& ports, int64_t) {
      engine.tangent(ports, inputs, input_rates, weight_rates, output_rates);
    });
  }
  void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars) override {
    std::fill(bars_.begin(), bars_.end(), 0.0);
    for_each_block([&](Engine<Real>& engine, const Ports& ports, int64_t share) {
      engine.adjoint(ports, inputs, seeds, input_bars, weight_bars ? bars_.data() + share * weight_count_ : nullptr);
    });
    add_shares(bars_, weight_bars);
  }
  void prepare_second() override {
    for (const auto& engine : engines_) engine->prepare_second();
    rate_bars_.resize(bars_.size());
  }
  void second(const NetworkSecond& call) override {
    std::fill(bars_.begin(), bars_.end(), 0.0);
    std::fill(rate_bars_.begin(), rate_bars_.end(), 0.0);
    for_each_block([&](Engine<Real>& engine, const Ports& ports, int64_t share) {
      NetworkSecond part = call;
      if (call.weight_bars != nullptr) part.weight_bars = bars_.data() + share * weight_count_;
      if (call.weight_rate_bars != nullptr) part.weight_rate_bars = rate_bars_.data() + share * weight_count_;
      engine.second(ports, part);
    });
    add_shares(bars_, call.weight_bars);
    add_shares(rate_bars_, call.weight_rate_bars);
  }
  int64_t bytes() const override {
    return static_cast<int64_t>((bars_.size() + rate_bars_.size()) * sizeof(double)) +
           static_cast<int64_t>(engines_.size()) * engines_.front()->bytes();
  }

 private:
  void add_shares(const std::vector<double>& bars, double* to) const {
    if (to == nullptr) return;
    for (int64_t share = 0; share < shares_; ++share) {
      for (int64_t i = 0; i < weight_count_; ++i) to[i] += bars[static_cast<size_t>(share * weight_count_ + i)];
    }
  }

  template <class F>
  void for_each_block(const F& f) {
    team_.run(shares_, [&](int64_t share, int thread) {
      Engine<Real>& engine = *engines_[static_cast<size_t>(thread)];
      const int64_t begin = blocks_ * share / shares_, end = blocks_ * (share + 1) / shares_;
      for (int64_t block = begin; block < end; ++block) {
        const int64_t first = block * block_cells;
        f(engine, {&layout_, first, std::min(block_cells, cell_count(layout_) - first)}, share);
      }
    });
  }

  dpde_layout layout_;
  std::vector<std::unique_ptr<Engine<Real>>> engines_;
  std::vector<double> bars_, rate_bars_;
  int64_t blocks_ = 0, shares_ = 0, weight_count_ = 0;
  Team team_;
};

bool has_neighbours(const dpde_network& network) {
  return std::any_of(network.layers, network.layers + network.layer_count, [](const dpde_layer& layer) {
    if (layer.kind == DPDE_CONV) return layer.extent != 1 || layer.stride != 1;
    if (layer.kind == DPDE_REORIENT) return layer.axes[0] != 1 || layer.axes[1] != 2 || layer.axes[2] != 3;
    return layer.kind == DPDE_MEAN_POOL || layer.kind == DPDE_MAX_POOL || layer.kind == DPDE_UPSAMPLE;
  });
}

template <class Real>
std::unique_ptr<Runner> make(const dpde_network& network, const dpde_layout& layout, const Team& team) {
  const int64_t widest = kernels<Real>().widest_block;
  const Plan plan = make_plan(network, layout, widest);
  if (has_neighbours(network) || cell_count(layout) <= block_cells)
    return std::make_unique<WholeGrid<Real>>(plan, team);
  dpde_network block_network = network;
  block_network.rank = 1;
  const int64_t cells[] = {block_cells};
  return std::make_unique<Blocks<Real>>(make_plan(block_network, make_layout(cells, {}, network.real), widest), layout,
                                        team);
}

}  // namespace

std::unique_ptr<Runner> make_runner(const dpde_network& network, const dpde_layout& layout, const Team& team) {
  if (network.is_host != 0) return make_host_runner(network, layout);
  return with_real(network.real, [&](auto real) { return make<decltype(real)>(network, layout, team); });
}

}  // namespace dpde::nn
