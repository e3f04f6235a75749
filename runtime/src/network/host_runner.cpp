// SPDX-License-Identifier: Apache-2.0
#include "network/host_runner.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "dpde/runtime/error.h"
#include "grid/real.h"

namespace dpde::nn {
namespace {

template <class Real>
class HostRunner final : public Runner {
 public:
  HostRunner(const dpde_network& network, const dpde_layout& layout)
      : name_(network.name), layout_(layout), cells_(static_cast<std::size_t>(cell_count(layout))) {
    const auto inputs = cells_ * static_cast<std::size_t>(network.inputs),
               outputs = cells_ * static_cast<std::size_t>(network.outputs);
    weights_.resize(static_cast<std::size_t>(network.weight_count));
    weight_bars_.resize(weights_.size());
    inputs_.resize(inputs);
    input_bars_.resize(inputs);
    outputs_.resize(outputs);
  }

  bool set_weights(const double* weights) override {
    std::copy_n(weights, weights_.size(), weights_.begin());
    return true;
  }
  void set_host(const dpde_host_network* host) override { host_ = host; }

  void value(void* const* inputs, void* const* outputs) override {
    load(inputs, inputs_);
    host().value(host().context, inputs_.data(), weights_.data(), outputs_.data());
    store(outputs_, outputs);
  }

  void tangent(void* const*, void* const*, const double*, void* const*) override { has_no_rates(); }
  void prepare_second() override { has_no_rates(); }
  void second(const NetworkSecond&) override { has_no_rates(); }

  void adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars) override {
    load(inputs, inputs_);
    load(seeds, outputs_);
    host().vector_jacobian(host().context, inputs_.data(), weights_.data(), outputs_.data(), input_bars_.data(),
                           weight_bars_.data());
    if (input_bars != nullptr) store(input_bars_, input_bars);
    for (std::size_t i = 0; weight_bars != nullptr && i < weight_bars_.size(); ++i) weight_bars[i] += weight_bars_[i];
  }

  int64_t bytes() const override {
    return static_cast<int64_t>(sizeof(double) * (inputs_.size() + input_bars_.size() + outputs_.size() +
                                                  weights_.size() + weight_bars_.size()));
  }

 private:
  [[noreturn]] void has_no_rates() const {
    throw Error(
        ErrorKind::input,
        fmt::format("network {} is the host's own and has no rates: no second derivatives go through it", name_));
  }
  const dpde_host_network& host() const {
    if (host_ == nullptr)
      throw Error(
          ErrorKind::input,
          fmt::format("network {} is the host's own: a C++ program supplies it (dpde::Simulation::supply)", name_));
    return *host_;
  }

  /// Calls f(index of the row, its first element in a field).
  template <class F>
  void for_each_row(const F& f) const {
    std::size_t row = 0;
    for (int64_t z = 0; z < layout_.cells[2]; ++z) {
      for (int64_t y = 0; y < layout_.cells[1]; ++y) f(row++, y * layout_.stride[1] + z * layout_.stride[2]);
    }
  }

  /// Null fields are read as 0.
  void load(void* const* fields, std::vector<double>& to) const {
    const auto width = static_cast<std::size_t>(layout_.cells[0]);
    for (std::size_t channel = 0; channel < to.size() / cells_; ++channel) {
      const Real* field = static_cast<const Real*>(fields[channel]);
      double* plane = to.data() + channel * cells_;
      if (field == nullptr) {
        std::fill_n(plane, cells_, 0.0);
      } else {
        for_each_row([&](std::size_t row, int64_t first) { std::copy_n(field + first, width, plane + row * width); });
      }
    }
  }

  void store(const std::vector<double>& from, void* const* fields) const {
    const auto width = static_cast<std::size_t>(layout_.cells[0]);
    for (std::size_t channel = 0; channel < from.size() / cells_; ++channel) {
      Real* field = static_cast<Real*>(fields[channel]);
      if (field == nullptr) continue;
      const double* plane = from.data() + channel * cells_;
      for_each_row([&](std::size_t row, int64_t first) {
        std::transform(plane + row * width, plane + (row + 1) * width, field + first,
                       [](double value) { return static_cast<Real>(value); });
      });
    }
  }

  std::string name_;
  dpde_layout layout_;
  std::size_t cells_;
  const dpde_host_network* host_ = nullptr;
  std::vector<double> weights_, weight_bars_, inputs_, input_bars_, outputs_;
};

}  // namespace

std::unique_ptr<Runner> make_host_runner(const dpde_network& network, const dpde_layout& layout) {
  return with_real(layout.real, [&](auto real) -> std::unique_ptr<Runner> {
    return std::make_unique<HostRunner<decltype(real)>>(network, layout);
  });
}

}  // namespace dpde::nn
