// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/network.h"

#include <new>

#include "dpde/runtime/error.h"
#include "runner.h"

namespace dpde {

class Network::Impl {
 public:
  explicit Impl(std::unique_ptr<nn::Runner> runner) : runner_(std::move(runner)) {}
  nn::Runner& runner() { return *runner_; }
  Tapes* tapes() { return tapes_.get(); }
  void keep(std::shared_ptr<Tapes> tapes) { tapes_ = std::move(tapes); }

 private:
  std::unique_ptr<nn::Runner> runner_;
  std::shared_ptr<Tapes> tapes_;
};

Network::Network(const dpde_network& network, const dpde_layout& layout, const Team& team, bool twice) {
  try {
    impl_ = std::make_unique<Impl>(nn::make_runner(network, layout, team));
    if (twice) impl_->runner().prepare_second();
  } catch (const std::bad_alloc&) {
    throw Error(ErrorKind::machine, "there is no memory for the network");
  }
}
Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

void Network::set_weights(const double* weights) {
  if (impl_->runner().set_weights(weights) && impl_->tapes() != nullptr) impl_->tapes()->clear();
}
void Network::set_host(const dpde_host_network* host) { impl_->runner().set_host(host); }
void Network::value(void* const* inputs, void* const* outputs) { impl_->runner().value(inputs, outputs); }
void Network::tangent(void* const* inputs, void* const* input_rates, const double* weight_rates,
                      void* const* output_rates) {
  impl_->runner().tangent(inputs, input_rates, weight_rates, output_rates);
}
void Network::adjoint(void* const* inputs, void* const* seeds, void* const* input_bars, double* weight_bars) {
  impl_->runner().adjoint(inputs, seeds, input_bars, weight_bars);
}
void Network::second(const NetworkSecond& call) { impl_->runner().second(call); }
std::int64_t Network::bytes() const { return impl_->runner().bytes(); }

std::int64_t Network::tape_bytes() const { return impl_->runner().tape_bytes(); }
std::int64_t Network::products() const { return impl_->runner().products(); }
void Network::write_tapes(std::shared_ptr<Tapes> tapes) {
  impl_->runner().write_tapes(tapes.get());
  impl_->keep(std::move(tapes));
}
void Network::read_tapes(std::shared_ptr<Tapes> tapes) {
  impl_->runner().read_tapes(tapes.get());
  impl_->keep(std::move(tapes));
}

}  // namespace dpde
