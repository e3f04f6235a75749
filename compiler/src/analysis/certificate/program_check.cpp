// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/program_check.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "adjoint/check/rounding_between.h"
#include "analysis/certificate/quick_certificate.h"

namespace dpde::analysis {

ProgramCheck::ProgramCheck(const driver::Compiled& compiled, const stencil::Program& program,
                           const adjoint::Derivative& tangent, const codegen::CompiledModule& tangents,
                           const model::Problem& problem, const std::vector<int>& cells, std::mt19937_64& random)
    : compiled_(compiled),
      tangent_(tangent),
      adjoint_(*compiled.derived.at(program.name).adjoint),
      program_(program),
      tangent_code_(*tangents.find(tangent.program)),
      interface_(stencil::interface_of(compiled.stencil, program)),
      random_(random),
      workspace_(driver::make_workspace(problem, *compiled.code, cells)),
      forward_(driver::make_workspace(problem, tangents, cells)) {}

std::vector<double> ProgramCheck::randoms(double low, double high) {
  Values values(workspace_.cell_count());
  for (double& value : values) value = uniform(low, high);
  return values;
}

std::vector<std::string> ProgramCheck::results() const {
  std::vector<std::string> names = program_.keeps;
  for (const stencil::Swap& swap : program_.swaps) names.push_back(swap.next);
  return names;
}

void ProgramCheck::choose_inputs() {
  const std::vector<BoundField> given = workspace_.bound_fields();  // coordinates, noise and control fields
  for (const std::string& field : interface_.inputs) {
    const bool is_given = std::ranges::find(given, field, &BoundField::name) != given.end();
    const bool is_active = compiled_.activity.fields.contains(field);
    inputs_[field] = is_given ? workspace_.dense(field) : randoms(0.5, 1.5);
    for (double& value : inputs_[field]) value = is_given && is_active ? uniform(0.5, 1.5) : value;
    if (is_active) rates_[field] = randoms(-1, 1);
  }
  for (const std::string& param : interface_.params) {
    const auto known = workspace_.params().find(param);
    params_[param] = known == workspace_.params().end() ? uniform(0.1, 0.9) : known->second;
    if (compiled_.activity.params.contains(param)) param_rates_[param] = uniform(-1, 1);
  }
  set_inputs();
  choose_weight_rates();
}

void ProgramCheck::set_inputs() {
  for (Workspace* workspace : {&workspace_, &forward_}) {
    for (const auto& [field, values] : inputs_) workspace->set_dense(field, values);
    for (const auto& [param, value] : params_) workspace->set_param(param, value);
  }
}

/// Keeps the initial weights.
void ProgramCheck::choose_weight_rates() {
  for (const std::string& network : interface_.networks) {
    if (!compiled_.activity.params.contains(network)) continue;
    Values& rates = weight_rates_[network];
    for (const double value : workspace_.weights().find(network)->second.values)
      rates.push_back(uniform(-1, 1) * (std::abs(value) + 0.1));
  }
}

void ProgramCheck::choose_seeds() {
  for (const std::string& result : results()) seeds_[result] = randoms(-1, 1);
  for (const std::string& sum : interface_.sums) sum_seeds_[sum] = uniform(-1, 1);
}

namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double total = 0;
  for (std::size_t i = 0; i < a.size(); ++i) total += a[i] * b[i];
  return total;
}

double add_magnitude(double sum, double value) { return sum + std::abs(value); }

std::span<double> values_of(std::vector<double>& values) { return values; }
std::span<double> values_of(double& value) { return {&value, 1}; }

}  // namespace

/// <x_bar, x_dot> with the adjoint program.
double ProgramCheck::backward(double& scale) {
  for (const auto& [result, seed] : seeds_) {
    if (const std::string* bar = adjoint_.field(result)) workspace_.field(*bar).copy_in(seed);
  }
  for (const auto& [sum, seed] : sum_seeds_) {
    if (const std::string* bar = adjoint_.sum(sum)) workspace_.set_param(*bar, seed);
  }
  const std::map<std::string, double> sums = workspace_.run(*compiled_.program(adjoint_.program), 0);
  double total = 0;
  const auto add = [&](double term) {
    total += term;
    scale += std::abs(term);
  };
  for (const auto& [field, rate] : rates_) {
    if (const std::string* bar = adjoint_.field(field)) add(dot(workspace_.dense(*bar), rate));
  }
  for (const auto& [param, rate] : param_rates_) {
    const std::string* const bar = adjoint_.param(param);
    const auto sum = bar != nullptr ? sums.find(*bar) : sums.end();
    if (sum != sums.end()) add(sum->second * rate);
  }
  for (const auto& [network, rates] : weight_rates_) {
    const Values& bars = workspace_.weights().find(network)->second.bars;
    for (std::size_t i = 0; i < rates.size(); ++i) add(bars[i] * rates[i]);
  }
  return total;
}

/// <y_bar, y_dot> with the tangent program.
double ProgramCheck::forward() {
  for (const auto& [field, rate] : rates_) {
    if (const std::string* dot = tangent_.field(field)) forward_.field(*dot).copy_in(rate);
  }
  for (const auto& [param, rate] : param_rates_) {
    if (const std::string* dot = tangent_.param(param)) forward_.set_param(*dot, rate);
  }
  for (const auto& [network, rates] : weight_rates_) {
    const auto weights = forward_.weights().find(network);
    if (weights != forward_.weights().end()) weights->second.rates = rates;
  }
  const std::map<std::string, double> sums = forward_.run(tangent_code_, 0);
  double total = 0;
  for (const auto& [result, seed] : seeds_) {
    if (const std::string* rate = tangent_.field(result)) total += dot(seed, forward_.dense(*rate));
  }
  for (const auto& [sum, seed] : sum_seeds_) {
    if (const std::string* rate = tangent_.sum(sum)) total += seed * sums.at(*rate);
  }
  return total;
}

/// Rounding error, measured by perturbing all inputs (also coordinates and spacings), rates and seeds by roundings;
/// they are restored afterwards.
double ProgramCheck::rounding(double epsilon) {
  const auto inputs = inputs_, rates = rates_, seeds = seeds_, weight_rates = weight_rates_;
  const auto params = params_, param_rates = param_rates_, sum_seeds = sum_seeds_;
  double sizes = 0, largest_seed = 0;
  for (const auto& [field, values] : rates) sizes += std::accumulate(values.begin(), values.end(), 0.0, add_magnitude);
  for (const auto& [field, values] : weight_rates)
    sizes += std::accumulate(values.begin(), values.end(), 0.0, add_magnitude);
  for (const auto& [param, value] : param_rates) sizes += std::abs(value);
  for (const auto& [field, values] : seeds) {
    for (const double value : values) largest_seed = std::max(largest_seed, std::abs(value));
  }
  for (const auto& [sum, value] : sum_seeds) largest_seed = std::max(largest_seed, std::abs(value));
  const auto nudged = [&](double by) {
    const auto move = [&](auto& moved, const auto& from) {
      moved = from;
      for (auto& [name, values] : moved) adjoint::nudge(values_of(values), by, random_);
    };
    move(inputs_, inputs);
    move(params_, params);
    move(rates_, rates);
    move(weight_rates_, weight_rates);
    move(param_rates_, param_rates);
    move(seeds_, seeds);
    move(sum_seeds_, sum_seeds);
    set_inputs();
    double scale = 0;
    const double reverse = backward(scale);
    return adjoint::TwoWays{forward(), reverse};
  };
  const double result =
      adjoint::rounding_between(nudged, epsilon, adjoint::most_roundings * epsilon * sizes * largest_seed);
  inputs_ = inputs, rates_ = rates, seeds_ = seeds, weight_rates_ = weight_rates;
  params_ = params, param_rates_ = param_rates, sum_seeds_ = sum_seeds;
  set_inputs();
  return result;
}

DotCase ProgramCheck::dot_product(bool single) {
  choose_inputs();
  choose_seeds();
  std::string grid;
  for (int a = 0; a < workspace_.layout().rank; ++a)
    grid += (grid.empty() ? "" : " x ") + std::to_string(workspace_.layout().cells[a]);
  double scale = 0;
  const double reverse = backward(scale), along = forward();
  DotCase result{grid, program_.name, relative_difference(along, reverse, (single ? 100 : 1) * scale),
                 std::abs(along - reverse)};
  result.scale = scale;
  result.is_zero = along == 0 && reverse == 0;
  if (result.relative_error > (single ? largest_single_error : largest_dot_error)) {
    double loss = 0;
    const std::map<std::string, double> sums = workspace_.run(*compiled_.program(program_.name), 0);
    for (const auto& [sum, seed] : sum_seeds_) loss += std::abs(seed * sums.at(sum));
    result.rounding =
        std::max(rounding(single ? 0x1p-23 : 0x1p-52), (single ? single_rounding_of_loss : rounding_of_loss) * loss);
    result.is_rounding = result.difference <= result.rounding;
  }
  return result;
}

/// seeds . results + (seeds . results^2)/2; the square gives linear programs a remainder too.
double ProgramCheck::functional() {
  const std::map<std::string, double> sums = workspace_.run(*compiled_.program(program_.name), 0);
  double total = 0;
  for (const auto& [result, seed] : seeds_) {
    const Values values = workspace_.dense(result);
    for (std::size_t i = 0; i < values.size(); ++i) total += seed[i] * values[i] * (1 + values[i] / 2);
  }
  for (const auto& [sum, seed] : sum_seeds_) total += seed * sums.at(sum) * (1 + sums.at(sum) / 2);
  return total;
}

void ProgramCheck::taylor(Certificate& certificate) {
  choose_inputs();
  choose_seeds();
  const std::map<std::string, Values> weights = seeds_;
  const std::map<std::string, double> sum_weights = sum_seeds_;
  const double base = functional();
  // The derivative of the functional is the seed of the adjoint.
  const std::map<std::string, double> sums = workspace_.run(*compiled_.program(program_.name), 0);
  for (auto& [result, seed] : seeds_) {
    const Values values = workspace_.dense(result);
    for (std::size_t i = 0; i < values.size(); ++i) seed[i] *= 1 + values[i];
  }
  for (auto& [sum, seed] : sum_seeds_) seed *= 1 + sums.at(sum);
  double scale = 0;
  const double slope = backward(scale);
  seeds_ = weights;
  sum_seeds_ = sum_weights;
  double size = std::abs(base);
  std::map<std::string, Values> initial;
  for (const auto& [network, weights] : workspace_.weights()) initial[network] = weights.values;
  for (int k = 0; k < 16; ++k) {
    const double step = 1e-2 * std::exp2(-k);
    for (const auto& [field, rate] : rates_) {
      Values moved = inputs_[field];
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += step * rate[i];
      workspace_.field(field).copy_in(moved);
    }
    for (const auto& [param, rate] : param_rates_) workspace_.set_param(param, params_[param] + step * rate);
    for (const auto& [network, rates] : weight_rates_) {
      Values& weights = workspace_.weights().find(network)->second.values;
      for (std::size_t i = 0; i < rates.size(); ++i) weights[i] = initial.at(network)[i] + step * rates[i];
    }
    const double value = functional();
    size = std::max(size, std::abs(value));
    certificate.remainders.push_back({step, std::abs(value - base - step * slope)});
  }
  certificate.slope = remainder_slope(certificate.remainders, 1e-12 * size);
  certificate.only_rounding = true;
  for (const Remainder& r : certificate.remainders) certificate.only_rounding &= r.value <= 1e-11 * size;
}

}  // namespace dpde::analysis
