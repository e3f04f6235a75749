// SPDX-License-Identifier: Apache-2.0
#include "exec/supplied_network.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

/// For finite differences with a relative step of 1/1000: networks in single precision have a relative error of about
/// 1e-3 in such differences; kinks of rectifiers within the step cause about as much.
constexpr double relative_step = 1e-3, largest_error = 0.02;

std::vector<double> displaced(const std::vector<double>& x, double by, const std::vector<double>& rates) {
  std::vector<double> at = x;
  for (std::size_t i = 0; i < x.size(); ++i) at[i] += by * rates[i];
  return at;
}

double product(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most > 0 ? most : 1;
}

}  // namespace

SuppliedNetwork::SuppliedNetwork(const dpde_network& network, std::size_t cells)
    : name_(network.name),
      inputs_(cells * static_cast<std::size_t>(network.inputs)),
      outputs_(cells * static_cast<std::size_t>(network.outputs)),
      weights_(static_cast<std::size_t>(network.weight_count)) {
  table_.context = this;
  table_.value = [](void* self, const double* inputs, const double* weights, double* outputs) {
    static_cast<SuppliedNetwork*>(self)->value(inputs, weights, outputs);
  };
  table_.vector_jacobian = [](void* self, const double* inputs, const double* weights, const double* seeds,
                              double* input_bars, double* weight_bars) {
    static_cast<SuppliedNetwork*>(self)->vector_jacobian(inputs, weights, seeds, input_bars, weight_bars);
  };
}

void SuppliedNetwork::supply(HostNetwork functions) {
  functions_ = std::move(functions);
  is_checked_ = is_tried_ = false;
}

void SuppliedNetwork::value(const double* inputs, const double* weights, double* outputs) {
  if (!functions_.value)
    throw Error(ErrorKind::input,
                fmt::format("network {} is the host's own: supply() its value before anything runs", name_));
  functions_.value({inputs, inputs_}, {weights, weights_}, {outputs, outputs_});
  if (std::exchange(is_tried_, true)) return;  // later failures may come from a line search that went too far
  const auto is_finite = [](double value) { return std::isfinite(value); };
  const double* const bad = std::find_if_not(outputs, outputs + outputs_, is_finite);
  if (bad == outputs + outputs_ || !std::all_of(inputs, inputs + inputs_, is_finite))
    return;  // the run blew up before, which is reported elsewhere
  throw Error(
      ErrorKind::run,
      fmt::format("network {}, which the host computes, gives {} for finite inputs, first in value {} of its outputs",
                  name_, *bad, bad - outputs));
}

void SuppliedNetwork::vector_jacobian(const double* inputs, const double* weights, const double* seeds,
                                      double* input_bars, double* weight_bars) {
  if (!functions_.vector_jacobian) {
    throw Error(
        ErrorKind::input,
        fmt::format("network {} has no vector-Jacobian product: a gradient through it needs one (supply)", name_));
  }
  if (!is_checked_) is_checked_ = check(inputs, weights);
  functions_.vector_jacobian({inputs, inputs_}, {weights, weights_}, {seeds, outputs_}, {input_bars, inputs_},
                             {weight_bars, weights_});
}

/// With w = J v by finite differences, <J' w, v> must be |w|^2: a sum without cancellation, so that a wrong factor or a
/// missing term shows. Returns false if w = 0: with zero weights many networks do not depend on their inputs.
bool SuppliedNetwork::check(const double* inputs, const double* weights) const {
  const Values x(inputs, inputs + inputs_), p(weights, weights + weights_);
  std::mt19937_64 random(20261122);
  const auto direction = [&](const Values& of) {
    std::normal_distribution<double> normal(0, largest(of));
    Values v(of.size());
    std::ranges::generate(v, [&] { return normal(random); });
    return v;
  };
  const bool by_inputs = check_along(x, p, direction(x), Values(p.size()), "inputs");
  return (p.empty() || check_along(x, p, Values(x.size()), direction(p), "weights")) && by_inputs;
}

bool SuppliedNetwork::check_along(const Values& inputs, const Values& weights, const Values& input_rates,
                                  const Values& weight_rates, const char* what) const {
  Values w(outputs_), behind(outputs_), input_bars(inputs_), weight_bars(weights_);
  const auto value_at = [&](double by, auto& result) {
    functions_.value(displaced(inputs, by, input_rates), displaced(weights, by, weight_rates), result);
  };
  value_at(relative_step, w);
  value_at(-relative_step, behind);
  for (std::size_t i = 0; i < outputs_; ++i) w[i] = (w[i] - behind[i]) / (2 * relative_step);
  functions_.vector_jacobian(inputs, weights, w, input_bars, weight_bars);
  const double expected = product(w, w), got = product(input_bars, input_rates) + product(weight_bars, weight_rates);
  if (!std::isfinite(expected) || expected == 0) return false;
  if (std::abs(got - expected) <= largest_error * expected) return true;
  throw Error(
      ErrorKind::input,
      fmt::format(
          "the vector-Jacobian product that the host gave for network {} is not the derivative of its value: along a "
          "direction of its {} it has {:.6g}, differences of the value have {:.6g}",
          name_, what, got, expected));
}

}  // namespace dpde
