// SPDX-License-Identifier: Apache-2.0
// Certification of hand-written programs that no scene uses: one run on random inputs.
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "driver/certificate.h"
#include "stencil/build.h"

namespace dpde::driver {

namespace {

using Random = std::mt19937_64;
using Values = std::vector<double>;

/// One program with its derivatives on one grid.
class ProgramCheck {
 public:
  ProgramCheck(const Compiled& compiled, const stencil::Program& program, const std::vector<int>& cells, Random& random)
      : compiled_(compiled), derived_(compiled.derived.at(program.name)), program_(program),
        interface_(stencil::interface_of(compiled.stencil, program)), random_(random),
        workspace_(problem_for(program, cells), *compiled.code, {}, 1) {}

  DotCase dot_product(const std::string& grid);
  void taylor(Certificate& certificate);

 private:
  static model::Problem problem_for(const stencil::Program& program, const std::vector<int>& cells);
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Values randoms(double low, double high);
  std::vector<std::string> results() const;
  void choose_inputs();
  void choose_seeds();
  double functional();
  double backward(double& scale);

  const Compiled& compiled_;
  const Derived& derived_;
  const stencil::Program& program_;
  stencil::Interface interface_;
  Random& random_;
  Workspace workspace_;
  std::map<std::string, Values> inputs_, rates_, seeds_;            // fields by primal name
  std::map<std::string, double> params_, param_rates_, sum_seeds_;  // scalars by primal name
};

model::Problem ProgramCheck::problem_for(const stencil::Program& program, const std::vector<int>& cells) {
  model::Problem problem;
  constexpr const char* names[] = {"x", "y", "z"};
  for (std::size_t a = 0; a < program.axes.size(); ++a) {
    problem.axes.push_back({names[a], 0.0, static_cast<double>(cells[a]), cells[a], program.axes[a]});
  }
  problem.step = 0.1;
  return problem;
}

Values ProgramCheck::randoms(double low, double high) {
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
  for (const std::string& field : interface_.inputs) {
    if (!compiled_.activity.fields.contains(field)) continue;
    inputs_[field] = randoms(0.5, 1.5);
    rates_[field] = randoms(-1, 1);
    workspace_.field(field).copy_in(inputs_[field]);
  }
  for (const std::string& param : interface_.params) {
    if (workspace_.params().contains(param)) continue;  // spacing, step
    params_[param] = uniform(0.1, 0.9);
    workspace_.set_param(param, params_[param]);
    if (compiled_.activity.params.contains(param)) param_rates_[param] = uniform(-1, 1);
  }
}

void ProgramCheck::choose_seeds() {
  for (const std::string& result : results()) seeds_[result] = randoms(-1, 1);
  for (const std::string& sum : interface_.sums) sum_seeds_[sum] = uniform(-1, 1);
}

double dot(const Values& a, const Values& b) {
  double total = 0;
  for (std::size_t i = 0; i < a.size(); ++i) total += a[i] * b[i];
  return total;
}

/// <x_bar, x_dot> with the adjoint program.
double ProgramCheck::backward(double& scale) {
  const std::map<std::string, std::string>& names = derived_.adjoint->names;
  for (const auto& [result, seed] : seeds_) {
    if (names.contains(result)) workspace_.field(names.at(result)).copy_in(seed);
  }
  for (const auto& [sum, seed] : sum_seeds_) {
    if (names.contains(sum)) workspace_.set_param(names.at(sum), seed);
  }
  const std::map<std::string, double> sums = workspace_.run(*compiled_.program(derived_.adjoint->program), 0);
  double total = 0;
  const auto add = [&](double term) {
    total += term;
    scale += std::abs(term);
  };
  for (const auto& [field, rate] : rates_) {
    if (names.contains(field)) add(dot(workspace_.dense(names.at(field)), rate));
  }
  for (const auto& [param, rate] : param_rates_) {
    const auto sum = names.contains(param) ? sums.find(names.at(param)) : sums.end();
    if (sum != sums.end()) add(sum->second * rate);
  }
  return total;
}

DotCase ProgramCheck::dot_product(const std::string& grid) {
  choose_inputs();
  choose_seeds();
  const std::map<std::string, std::string>& names = derived_.tangent->names;
  for (const auto& [field, rate] : rates_) {
    if (names.contains(field)) workspace_.field(names.at(field)).copy_in(rate);
  }
  for (const auto& [param, rate] : param_rates_) {
    if (names.contains(param)) workspace_.set_param(names.at(param), rate);
  }
  const std::map<std::string, double> sums = workspace_.run(*compiled_.program(derived_.tangent->program), 0);
  double forward = 0, scale = 0;
  for (const auto& [result, seed] : seeds_) {
    if (names.contains(result)) forward += dot(seed, workspace_.dense(names.at(result)));
  }
  for (const auto& [sum, seed] : sum_seeds_) {
    if (names.contains(sum)) forward += seed * sums.at(names.at(sum));
  }
  const double reverse = backward(scale);
  return {grid, program_.name, relative_difference(forward, reverse, scale)};
}

/// seeds . results + (seeds . results^2)/2, so that a linear program too has a remainder.
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
  // The functional's own derivative is the seed of the adjoint.
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
  for (int k = 0; k < 16; ++k) {
    const double step = 1e-2 * std::exp2(-k);
    for (const auto& [field, rate] : rates_) {
      Values moved = inputs_[field];
      for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += step * rate[i];
      workspace_.field(field).copy_in(moved);
    }
    for (const auto& [param, rate] : param_rates_) workspace_.set_param(param, params_[param] + step * rate);
    const double value = functional();
    size = std::max(size, std::abs(value));
    certificate.remainders.push_back({step, std::abs(value - base - step * slope)});
  }
  certificate.slope = remainder_slope(certificate.remainders, 1e-12 * size);
  certificate.only_rounding = true;
  for (const Remainder& r : certificate.remainders) certificate.only_rounding &= r.value <= 1e-11 * size;
}

}  // namespace

Certificate certify_programs(const Compiled& compiled, const CertifyOptions& options) {
  Random random(options.seed + 20240229);
  Certificate certificate;
  for (const auto& [name, derived] : compiled.derived) {
    if (!derived.tangent || !derived.adjoint) continue;
    const stencil::Program& program = *compiled.stencil.find_program(name);
    std::vector<int> last;
    for (const std::vector<int>& cells : small_grids(program.axes.size())) {
      std::string grid;
      for (const int n : cells) grid += (grid.empty() ? "" : " x ") + std::to_string(n);
      ProgramCheck check(compiled, program, cells, random);
      const DotCase result = check.dot_product(grid);
      if (std::isfinite(result.relative_error)) {
        certificate.cases.push_back(result);
      } else {
        certificate.skipped.push_back(grid + " cells, " + name + ": values are not finite");
      }
      last = cells;
    }
    Certificate taylor;
    ProgramCheck(compiled, program, std::vector<int>(last.size(), 7), random).taylor(taylor);
    // Of several programs the one furthest from slope 2 speaks for all.
    const auto distance = [](const Certificate& c) { return c.slope ? std::abs(*c.slope - 2) : c.only_rounding ? -1.0 : INFINITY; };
    if (certificate.remainders.empty() || distance(taylor) > distance(certificate)) {
      certificate.slope = taylor.slope;
      certificate.only_rounding = taylor.only_rounding;
      certificate.remainders = taylor.remainders;
      certificate.note = name;
    }
  }
  return certificate;
}

}  // namespace dpde::driver
