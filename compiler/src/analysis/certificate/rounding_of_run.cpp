// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/rounding_of_run.h"

#include <algorithm>
#include <string>
#include <vector>

#include "adjoint/check/rounding_between.h"
#include "driver/compile/interpreter_backend.h"
#include "driver/compile/links.h"
#include "driver/scene/inverse.h"
#include "loop/from_stencil.h"
#include "stencil/interpret/with_rounding.h"

namespace dpde::analysis {

namespace {

constexpr double allowance = 8;  // safety factor for so few samples

std::shared_ptr<const driver::Compiled> moved_by_roundings(const driver::Compiled& compiled, double phase) {
  auto moved = std::make_shared<driver::Compiled>(compiled);
  moved->stencil = stencil::with_rounding(compiled.stencil, phase, compiled.is_single() ? 5e-7 : 1e-15);
  std::vector<std::string> names;
  for (const stencil::Program& program : moved->stencil.programs) names.push_back(program.name);
  driver::replace_loop(*moved, loop::from_stencil(moved->stencil, names, compiled.real()));
  moved->code = driver::interpreted(moved->stencil, moved->loop);
  for (const driver::LinkedProgram& linked : driver::linked_programs(*moved))
    moved->code->set_links(linked.program, linked.links);
  return moved;
}

}  // namespace

RunRounding rounding_of_run(const SourceFile& source, const driver::Compiled& compiled,
                            const driver::SessionOptions& options, const Eigen::VectorXd& x,
                            const Eigen::VectorXd& direction) {
  constexpr double phases[] = {1.7, 2.9, 4.3, 5.9};
  std::vector<double> losses, derivatives;
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(x.size());
  for (const double phase : phases) {
    DiagnosticSink silent;
    const auto session = driver::Session::open(source, moved_by_roundings(compiled, phase), options, silent);
    const auto inverse = session ? driver::Inverse::open(*session, source, silent) : nullptr;
    if (!inverse) return {};
    try {
      losses.push_back(inverse->value_and_gradient(x, gradient));
    } catch (const NoSolution&) {
      return {};
    }
    derivatives.push_back(gradient.dot(direction));
  }
  const double epsilon = compiled.is_single() ? 0x1p-23 : 0x1p-52;
  const double largest = largest_rounding_of_run(epsilon, x, direction);
  const auto spread = [&](const std::vector<double>& values) {
    const auto [low, high] = std::ranges::minmax(values);
    return allowance * (high - low) <= largest ? allowance * (high - low) : 0;
  };
  return {spread(losses), spread(derivatives)};
}

double largest_rounding_of_run(double epsilon, const Eigen::VectorXd& x, const Eigen::VectorXd& direction) {
  const double size = direction.lpNorm<1>() * std::max(1.0, x.lpNorm<Eigen::Infinity>());
  return allowance * adjoint::most_roundings * epsilon * size;
}

}  // namespace dpde::analysis
