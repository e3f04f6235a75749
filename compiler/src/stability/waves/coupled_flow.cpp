// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/coupled_flow.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stability/eigenvalues/eigenvalues.h"

namespace dpde::stability {

namespace {

constexpr int fewest_for_rates = 8, most_for_rates = 40;
constexpr double rounding_of_rates = 1e-10;  // of differences between steps

stencil::Params with_step(stencil::Params params, double step) {
  params["dt"] = step;
  return params;
}

/// The largest Ritz value of L, by modulus, on the Krylov space of noise.
double fastest_rate(const TangentRuns& euler, const stencil::Params& params, const Eigen::MatrixXd& noise, int most) {
  double step = params.at("dt"), fastest = 0;
  for (int turn = 0; turn < 2; ++turn) {  // the second with a step at which 1 + dt L costs L no digits
    const Eigen::MatrixXd matrix = euler.on_krylov_space(with_step(params, step), noise, most).matrix;
    if (matrix.rows() == 0) return 0;
    fastest = (eigenvalues_of_space(matrix).array() - 1).abs().maxCoeff() / step;
    if (!(fastest > 0) || !std::isfinite(fastest)) return 0;
    step = 1 / fastest;
  }
  return fastest;
}

/// Whether the change of noise in a step is proportional to the step's length.
bool is_linear_in_step(const TangentRuns& euler, const stencil::Params& params, const Eigen::MatrixXd& noise,
                       double step) {
  const auto change = [&](double length) -> Eigen::MatrixXd {
    return euler.applied(with_step(params, length), noise) - noise;
  };
  const Eigen::MatrixXd once = change(step), twice = change(2 * step), nothing = change(0);
  const double size = rounding_of_rates * noise.norm();
  return nothing.norm() <= size && (twice - 2 * once).norm() <= size;
}

}  // namespace

CoupledFlow::CoupledFlow(TangentRuns euler, const stencil::Params& params, double fastest)
    : flow_(std::move(euler)), params_(with_step(params, 1 / fastest)), fastest_(fastest) {
  flow_.follow_flow();
}

std::unique_ptr<CoupledFlow> CoupledFlow::make(driver::Session& session, const LinearStep& euler,
                                               const stencil::Params& params, double numbers) {
  std::unique_ptr<CompiledTangent> tangent = CompiledTangent::of_coupled(euler);
  if (tangent == nullptr) return nullptr;
  TangentRuns runs(std::move(tangent), initial_inputs(session, euler));
  const stencil::Params at_step = with_step(params, session.problem().step);
  const Eigen::MatrixXd noise = runs.repeated(with_step(params, 0), 1).last;
  const int most = static_cast<int>(
      std::min<double>(most_for_rates, numbers / std::max<double>(1, static_cast<double>(noise.size()))));
  if (!noise.allFinite() || most < fewest_for_rates) return nullptr;
  const double fastest = fastest_rate(runs, at_step, noise, most);
  if (!(fastest > 0) || !is_linear_in_step(runs, params, noise, 1 / fastest)) return nullptr;
  return std::unique_ptr<CoupledFlow>(new CoupledFlow(std::move(runs), params, fastest));
}

KrylovSpace CoupledFlow::on_krylov_space(const Eigen::MatrixXd& perturbation, const std::vector<std::string>& states,
                                         int most) const {
  const std::vector<std::string> own = this->states();
  Eigen::MatrixXd start = Eigen::MatrixXd::Zero(perturbation.rows(), std::ssize(own));
  for (std::size_t i = 0; i < own.size(); ++i) {
    const auto found = std::ranges::find(states, own[i]);
    if (found != states.end()) start.col(static_cast<Eigen::Index>(i)) = perturbation.col(found - states.begin());
  }
  return start.norm() > 0 ? flow_.on_krylov_space(params_, start, most) : KrylovSpace{};
}

}  // namespace dpde::stability
