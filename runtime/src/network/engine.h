// SPDX-License-Identifier: Apache-2.0
// A plan with its working memory.
#pragma once

#include <memory>
#include <vector>

#include "dpde/runtime/buffer.h"
#include "dpde/runtime/network.h"
#include "dpde/runtime/tapes.h"
#include "network/kernels/convolve.h"
#include "network/plan.h"
#include "network/view.h"

namespace dpde::nn {

/// Fields of a host and the range of their cells (numbered as in dense arrays) that the network computes. If it has
/// more cells, the others are 0.
struct Ports {
  const dpde_layout* layout;
  int64_t first, count;
};

template <class Real>
class Engine {
 public:
  Engine(const Plan& plan, const Team& team);

  /// Returns false if they have not changed.
  bool set_weights(const double* weights);
  /// Bytes of all values of a run; `write_tapes`, `read_tapes`: see Network.
  int64_t tape_bytes() const { return value_bytes_; }
  int64_t products() const;
  void write_tapes(Tapes* tapes) { written_to_ = tapes; }
  void read_tapes(Tapes* tapes) { read_from_ = tapes; }
  void value(const Ports& ports, void* const* inputs, void* const* outputs);
  void tangent(const Ports& ports, void* const* inputs, void* const* input_rates, const double* weight_rates,
               void* const* output_rates);
  void adjoint(const Ports& ports, void* const* inputs, void* const* seeds, void* const* input_bars,
               double* weight_bars);
  /// Allocates the memory of second().
  void prepare_second();
  void second(const Ports& ports, const NetworkSecond& call);
  int64_t bytes() const { return bytes_ + second_bytes_; }

 private:
  /// Weights of one convolution, packed for the kernels.
  struct Packed {
    Real *forward = nullptr, *rates = nullptr, *bias = nullptr, *bias_rates = nullptr;
    std::vector<Real*> reverse;
  };

  // Memory: engine.cpp
  void lay_out(bool place);
  Real* take(char* memory, int64_t count);
  View<Real> value_view(size_t value) const {
    return {reinterpret_cast<Real*>(now_) + places_[value], &plan_.values[value].shape};
  }
  View<Real> rate_view(size_t value) const;
  View<Real> adjoint_view(size_t value) const;
  bool joins(const Step& step) const { return step.layer.kind == DPDE_ADD || step.layer.kind == DPDE_CONCAT; }

  // Forward: engine.cpp
  bool find_tape();
  bool has_input(const char* tape) const;
  void load(const Ports& ports, void* const* fields, const View<Real>& view);
  void store(const Ports& ports, const View<Real>& view, void* const* fields);
  void run(bool keep);
  void run_step(size_t k, bool keep);
  void run_convolution(size_t k, bool keep);
  void run_layer(const Step& step, const View<Real>& input, const View<Real>& other, const View<Real>& result);
  void finish(size_t value, const View<Real>& view);
  View<Real> read_by(const Step& step, const View<Real>& input);
  Range whole(const Value& value) const { return {{}, value.cells}; }
  template <class F>
  void for_each_row(const Shape& shape, int64_t cost, const F& f);

  // Rates: engine_tangent.cpp
  void rate_step(size_t k, const double* weight_rates);
  void rate_convolution(size_t k, const double* weight_rates);

  // Reverse: engine_adjoint.cpp
  void find_needs(void* const* input_bars, bool weights);
  void adjoint_step(size_t k, double* weight_bars);
  void adjoint_convolution(size_t k, double* weight_bars);
  void begin_reverse();
  void clear_margins(const View<Real>& seeds);
  /// Adds the adjoint of the input of step k from the adjoint of its result, with these reversed weights.
  void adjoint_of_input(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights);
  void adjoint_of_read(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights);
  void adjoint_of_phases(size_t k, const View<Real>& seeds, const std::vector<Real*>& weights);
  void add_bias_gradient(const Step& step, const View<Real>& seeds, double* weight_bars);
  void adjoint_activation(size_t k);
  void adjoint_sum(size_t k);
  void adjoint_pool(size_t k);
  bool begin_adjoint(size_t value);
  View<Real> added_to(size_t value);

  // Reverse of rates: engine_second.cpp
  void lay_out_second(bool place);
  void find_rates(const Ports& ports, const NetworkSecond& call);
  void exchange_banks();
  void second_step(size_t k, const NetworkSecond& call);
  void second_convolution(size_t k, const NetworkSecond& call);
  void second_activation(size_t k);

  Plan plan_;
  Team team_;
  const Kernels<Real>& kernels_;
  std::vector<int64_t> places_;         // offset of cell (0, 0, 0) of each value
  std::vector<Real*> roots_;            // memory shared by rates and adjoints
  std::vector<Packed> packed_;          // for each step
  std::vector<char> margin_read_;       // for each value: its margin is read
  std::vector<char> needed_, written_;  // for each value in a reverse run: its adjoint is needed; contains something
  // For second(): separate rates of each value, if wanted; rates of adjoints, which exchange_banks() swaps with
  // adjoints; reversed weights of the rates of weights.
  bool has_own_rates_ = false;
  std::vector<Real*> own_rates_, other_roots_;
  std::vector<char> other_written_;
  std::vector<std::vector<Real*>> reverse_rates_;
  std::vector<double> weights_;
  bool reverse_packed_ = false;
  Real *phases_ = nullptr, *phases_bar_ = nullptr;
  Buffer memory_, second_memory_;
  int64_t bytes_ = 0, second_bytes_ = 0, used_ = 0, value_bytes_ = 0;
  char* now_ = nullptr;  // values of the present run: at the start of memory_, or on a tape
  Tapes *written_to_ = nullptr, *read_from_ = nullptr;
};

}  // namespace dpde::nn
