// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/network.h"

#include <new>

#include "dpde/runtime/error.h"
#include "network/runner.h"

namespace dpde {

class Network::Impl {
 public:
  explicit Impl(std::unique_ptr<nn::Runner> runner) : runner_(std::move(runner)) {}
  nn::Runner& runner() { return *runner_; }
  void clear_tapes() {
    for (Tapes* const tapes : {written_to_.get(), read_from_.get()}) {
      if (tapes != nullptr) tapes->clear();
    }
  }
  void connect(std::shared_ptr<Tapes> written_to, std::shared_ptr<Tapes> read_from) {
    written_to_ = std::move(written_to);
    read_from_ = std::move(read_from);
    set_tapes(written_to_.get(), read_from_.get());
  }
  void write_tapes(std::shared_ptr<Tapes> tapes) { connect(std::move(tapes), read_from_); }
  void read_tapes(std::shared_ptr<Tapes> tapes) { connect(written_to_, std::move(tapes)); }
  void value_beside_tapes(void* const* inputs, void* const* outputs) {
    set_tapes(nullptr, nullptr);
    runner_->value(inputs, outputs);
    set_tapes(written_to_.get(), read_from_.get());
  }

 private:
  void set_tapes(Tapes* written_to, Tapes* read_from) {
    runner_->write_tapes(written_to);
    runner_->read_tapes(read_from);
  }

  std::unique_ptr<nn::Runner> runner_;
  std::shared_ptr<Tapes> written_to_, read_from_;
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
  if (impl_->runner().set_weights(weights)) impl_->clear_tapes();
}
void Network::set_host(const dpde_host_network* host) { impl_->runner().set_host(host); }
void Network::value(void* const* inputs, void* const* outputs) { impl_->runner().value(inputs, outputs); }
void Network::value_beside_tapes(void* const* inputs, void* const* outputs) {
  impl_->value_beside_tapes(inputs, outputs);
}
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
void Network::write_tapes(std::shared_ptr<Tapes> tapes) { impl_->write_tapes(std::move(tapes)); }
void Network::read_tapes(std::shared_ptr<Tapes> tapes) { impl_->read_tapes(std::move(tapes)); }

}  // namespace dpde
