// SPDX-License-Identifier: Apache-2.0
#include "report/gradient_growth.h"

#include <fmt/format.h>

#include "analysis/run/instability.h"

namespace dpde::report {

namespace {

using analysis::GradientGrowth;

std::string cause_text(const GradientGrowth& growth) {
  const std::optional<bool> is_of_equations = growth.is_of_equations();
  if (!is_of_equations) return "";
  const double half = growth.at_half_step->growth.rate;
  return *is_of_equations
             ? fmt::format("with half the step it grows at {:.4g}: chaos of the equations, no fault of the scheme; ",
                           half)
             : fmt::format("with half the step it grows at {:.4g}: the step is too large for the scheme; ", half);
}

/// Relative change of the gradient if each unknown is increased by one rounding.
double change_by_rounding(const driver::Session& session, driver::Inverse& inverse, const Eigen::VectorXd& x,
                          const Eigen::VectorXd& gradient) {
  const bool is_single = session.problem().scheme.real == Precision::f32;
  const double largest = x.cwiseAbs().maxCoeff();
  const Eigen::VectorXd sizes = x.cwiseAbs().cwiseMax(largest > 0 ? 0.01 * largest : 1);  // positive also for 0
  Eigen::VectorXd other(gradient.size());
  inverse.value_and_gradient(x + (is_single ? 0x1p-23 : 0x1p-52) * sizes, other);
  const double size = gradient.norm();
  return size > 0 ? (other - gradient).norm() / size : 0;
}

}  // namespace

std::optional<GradientGrowth> gradient_growth(driver::Session& session, driver::Inverse& inverse,
                                              const std::vector<analysis::AdjointWatch::Look>& looks,
                                              const Eigen::VectorXd& x, const Eigen::VectorXd& gradient) {
  return analysis::gradient_growth(session, looks, [&] { return change_by_rounding(session, inverse, x, gradient); });
}

Json json_of(const std::optional<GradientGrowth>& growth) {
  if (!growth) return nullptr;
  Json json = {{"adjoint_rate", json_number(growth->adjoint.rate)},
               {"adjoint_growth_ln", json_number(growth->adjoint.logarithm)},
               {"perturbation_rate", nullptr},
               {"perturbation_rate_at_half_step", nullptr},
               {"rounding", growth->rounding},
               {"lost", growth->is_lost()},
               {"window", growth->window},
               {"safe_window", growth->is_lost() ? Json(growth->safe_window) : Json(nullptr)}};
  if (growth->perturbation) json["perturbation_rate"] = json_number(growth->perturbation->growth.rate);
  if (growth->at_half_step) json["perturbation_rate_at_half_step"] = json_number(growth->at_half_step->growth.rate);
  return json;
}

void warn_of_growth(const model::Problem& problem, const std::optional<GradientGrowth>& growth, DiagnosticSink& sink) {
  if (!growth || !growth->is_lost()) return;
  const double end = problem.t_begin + growth->safe_window;
  sink.report("gradient-lost-digits", problem.task->losses.front().origin.range,
              {fmt::format("{:.4g}", growth->perturbation->growth.rate), fmt::format("{:.4g}", growth->adjoint.rate),
               fmt::format("{:.2g}", growth->rounding), growth->is_of_gradient ? "gradient" : "state"},
              cause_text(*growth) + fmt::format("a window of {:.4g}, to t = {:.4g}, would leave about three digits",
                                                growth->safe_window, end));
}

std::string help_for_growth(driver::Session& session, const std::vector<analysis::AdjointWatch::Look>& looks) {
  constexpr double far = 100;  // ln; non-differentiable formulas cannot cause this within the steps of a run
  const std::optional<analysis::Growth> growth = analysis::growth_of_adjoint(looks);
  if (!growth || growth->logarithm < far || !analysis::instability(session).empty()) return "";
  return fmt::format(
      "on its way back the adjoint has grown by a factor of e^{:.0f}, at a rate of {:.4g} (1/time), and then beyond "
      "all "
      "numbers: a shorter run (--set end=...) or a smaller step may help",
      growth->logarithm, growth->rate);
}

}  // namespace dpde::report
