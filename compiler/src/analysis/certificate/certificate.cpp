// SPDX-License-Identifier: Apache-2.0
#include "analysis/certificate/certificate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "adjoint/check/rounding_between.h"
#include "analysis/certificate/quick_certificate.h"
#include "analysis/certificate/rounding_of_run.h"
#include "analysis/generic_point.h"
#include "analysis/kinks.h"
#include "dpde/runtime/error.h"
#include "driver/compile/switches.h"
#include "driver/report/blow_up.h"
#include "driver/scene/inverse.h"

namespace dpde::analysis {

namespace {

constexpr double most_cells = 4e5;
constexpr double most_cells_and_steps = 1e5;  // for the reference interpreter, which takes some seconds for them
constexpr int steps_on_small_grids = 3;

using Random = std::mt19937_64;

std::string grid_text(const driver::Session& session) {
  std::string text;
  for (const model::Axis& axis : session.axes()) text += fmt::format("{}{}", text.empty() ? "" : " x ", axis.cells);
  return text;
}

std::string run_text(const driver::Session& session) {
  if (session.is_until_steady()) return "steady state";
  return fmt::format("{} steps", session.steps());
}

/// Allowed difference of tangent and adjoint in a precision.
struct Tolerance {
  double largest_error;
  double rounding;      // of a loss or of a derivative's terms; remains where the derivative is 0
  double scale_weight;  // of the terms' magnitudes in relative errors, in thousandths
  double epsilon;       // machine epsilon
  const char* in;       // subject of messages, "the run"
};

/// Tangent and adjoint on one grid; `scale`: sum of the terms' magnitudes, `rounding`: its measured rounding.
struct Comparison {
  std::string grid, what;
  double forward = 0, backward = 0, scale = 0, loss = 0, rounding = 0;
  std::string left_out;                          // why the comparison is not meaningful
  std::function<double()> rounding_of_run = {};  // absent if the derivative exceeds any rounding

  double size() const { return std::max(std::abs(forward), std::abs(backward)); }
  double error(double scale_weight) const { return relative_difference(forward, backward, scale_weight * scale); }
};

void nudge_all(Eigen::VectorXd& values, double epsilon, Random& random) {
  adjoint::nudge({values.data(), static_cast<std::size_t>(values.size())}, epsilon, random);
}

/// Bound of rounding for values up to `size`, which may be amplified by high-order differences.
double most_rounding(double epsilon, double size) { return adjoint::most_roundings * epsilon * size; }

/// Whether the run is not finite or a solve in it has no solution.
bool blows_up(driver::Session& session) {
  try {
    return session.rollout().run().blow_up.has_value();
  } catch (const NoSolution&) {
    return true;
  }
}

/// Why rounding is amplified by each step, so that no derivative can be compared; "" if it is not.
std::string why_rounding_grows(driver::Session& session, const char* in) {
  constexpr double suspicious = 1e3;
  if (blows_up(session)) return fmt::format("{} is not finite", in);
  const std::vector<dpde::Growth> growths = driver::instabilities_of(session, suspicious);
  return growths.empty() ? ""
                         : fmt::format("{} is not stable: {} grows from {:.3g} to {:.3g}", in, growths[0].state,
                                       growths[0].before, growths[0].after);
}

/// Rounding error of the derivative at a point.
using RoundingAt = std::function<double(const Point&)>;

RoundingAt rounding_in_run(const SourceFile& source, const driver::Compiled& compiled, driver::SessionOptions options,
                           const driver::Session& session) {
  options.judge = {};
  double size = session.steps();
  for (const model::Axis& axis : session.axes()) size *= axis.cells;
  if (size > most_cells_and_steps) return [](const Point&) { return 0.0; };
  return [&source, &compiled, options](const Point& point) {
    return rounding_of_run(source, compiled, options, point.x, point.direction).derivative;
  };
}

Comparison compare_at(driver::Session& session, driver::Inverse& inverse, const Point& point,
                      const Tolerance& tolerance, const RoundingAt& rounding_at, Random& random) {
  Eigen::VectorXd gradient(inverse.size());
  const double loss = inverse.value_and_gradient(point.x, gradient);
  Comparison result{grid_text(session), run_text(session)};
  result.forward = inverse.rate_along(point.x, point.direction);
  result.backward = gradient.dot(point.direction);
  result.scale = gradient.cwiseAbs().dot(point.direction.cwiseAbs());
  result.loss = loss;
  if (!std::isfinite(loss) || !std::isfinite(result.forward) || !std::isfinite(result.backward)) {
    result.left_out = fmt::format("{} or its loss is not finite, or a solve has no solution", tolerance.in);
  } else if (result.error(tolerance.scale_weight) > tolerance.largest_error) {
    result.left_out = why_rounding_grows(session, tolerance.in);
    const auto nudged = [&](double epsilon) {
      Point near = point;
      nudge_all(near.x, epsilon, random);
      nudge_all(near.direction, epsilon, random);
      inverse.value_and_gradient(near.x, gradient);
      const double forward = inverse.rate_along(near.x, near.direction);
      return adjoint::TwoWays{forward, gradient.dot(near.direction)};
    };
    const double size = point.direction.lpNorm<1>() * std::max(1.0, point.x.lpNorm<Eigen::Infinity>());
    result.rounding = adjoint::rounding_between(nudged, tolerance.epsilon, most_rounding(tolerance.epsilon, size));
    // Nearby points do not show the rounding of terms that cancel at all of them.
    if (std::abs(result.forward - result.backward) > result.rounding)
      result.rounding = std::max(result.rounding, rounding_at(point));
  }
  if (result.size() <= largest_rounding_of_run(tolerance.epsilon, point.x, point.direction))
    result.rounding_of_run = [rounding_at, point] { return rounding_at(point); };
  return result;
}

std::optional<Comparison> compare(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                                  const driver::SessionOptions& options, const Tolerance& tolerance, Random& random,
                                  DiagnosticSink& sink) {
  const auto session = driver::Session::open(source, compiled, options, sink);
  if (!session) return std::nullopt;
  const auto inverse = driver::Inverse::open(*session, source, sink);
  if (!inverse) return std::nullopt;
  return compare_at(*session, *inverse, generic_point(*session, *inverse, random), tolerance,
                    rounding_in_run(source, *compiled, options, *session), random);
}

/// Tangent and adjoint may agree on a rounding error if both add the same few terms, as on one cell. Checks this until
/// one case exceeds rounding, which proves a test. Starts with the small grids, the last and cheapest.
void find_agreeing_roundings(const std::vector<Comparison>& found, double largest_error, std::vector<DotCase>& cases) {
  std::size_t k = cases.size();
  for (auto one = found.rbegin(); one != found.rend(); ++one) {
    if (!one->left_out.empty()) continue;
    DotCase& result = cases[--k];
    if (result.is_zero || result.is_rounding) continue;
    if (result.relative_error > largest_error) return;
    const double rounding = one->rounding_of_run ? one->rounding_of_run() : 0;
    if (!(one->size() <= rounding)) return;
    result.is_rounding = true;
    result.rounding = std::max(result.rounding, rounding);
  }
}

void add_cases(const std::vector<Comparison>& found, const Tolerance& tolerance, std::vector<DotCase>& cases,
               std::vector<std::string>& skipped) {
  std::vector<double> scales;
  for (const Comparison& one : found) {
    if (one.left_out.empty()) scales.push_back(one.scale);
  }
  const double usual = usual_scale(scales);
  for (const Comparison& one : found) {
    if (!one.left_out.empty()) {
      skipped.push_back(one.grid + " cells: " + one.left_out);
      continue;
    }
    DotCase& result = cases.emplace_back(DotCase{one.grid, one.what});
    result.relative_error = one.error(tolerance.scale_weight);
    result.difference = std::abs(one.forward - one.backward);
    result.is_zero = one.forward == 0 && one.backward == 0;
    result.rounding = std::max(tolerance.rounding * std::max(std::abs(one.loss), usual), one.rounding);
    result.is_rounding = result.relative_error > tolerance.largest_error && result.difference <= result.rounding;
  }
  find_agreeing_roundings(found, tolerance.largest_error, cases);
}

constexpr Tolerance second_order_tolerance{largest_asymmetry, rounding_of_loss, 1, 0x1p-52, "the run"};

/// v.Hw against w.Hv on one grid, for the Hessian and, if there is one, the Gauss-Newton matrix.
bool add_symmetry_case(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                       const driver::SessionOptions& options, Random& random, std::vector<Comparison>& found,
                       DiagnosticSink& sink) {
  const auto session = driver::Session::open(source, compiled, options, sink);
  if (!session) return false;
  const auto inverse = driver::Inverse::open(*session, source, sink);
  if (!inverse) return false;
  const Point point = generic_point(*session, *inverse, random);
  const Eigen::VectorXd& v = point.direction;
  const Eigen::VectorXd w = generic_point(*session, *inverse, random).direction;
  Eigen::VectorXd gradient(v.size());
  const double loss = inverse->value_and_gradient(point.x, gradient);
  // A product that vanishes except for rounding of the gradient's terms is compared with these terms: 1e-10 of the
  // product is 1e-13 of them, some hundred roundings, as in a run of many steps on one cell.
  const double least_scale = 1e-3 * w.cwiseAbs().dot(gradient.cwiseAbs());
  for (const Curvature curvature : {Curvature::full, Curvature::gauss_newton}) {
    if (!inverse->has_products(curvature)) continue;
    session->engine().release_products();  // these store the states of a run
    Eigen::VectorXd hv(v.size()), hw(v.size());
    inverse->product(point.x, v, hv, curvature);
    inverse->product(point.x, w, hw, curvature);
    if (!hv.allFinite() || !hw.allFinite()) continue;  // the run is not finite: the dot products report that
    const std::string what = curvature == Curvature::full ? "Hessian" : "Gauss-Newton";
    Comparison& result =
        found.emplace_back(Comparison{grid_text(*session), fmt::format("{}, {}", what, run_text(*session)), w.dot(hv),
                                      v.dot(hw), std::max(least_scale, w.cwiseAbs().dot(hv.cwiseAbs())), loss});
    if (result.error(second_order_tolerance.scale_weight) <= largest_asymmetry) continue;
    result.left_out = why_rounding_grows(*session, second_order_tolerance.in);
    const auto nudged = [&](double epsilon) {
      Eigen::VectorXd x = point.x, near_v = v, near_w = w;
      for (Eigen::VectorXd* values : {&x, &near_v, &near_w}) nudge_all(*values, epsilon, random);
      inverse->product(x, near_v, hv, curvature);
      inverse->product(x, near_w, hw, curvature);
      return adjoint::TwoWays{near_w.dot(hv), near_v.dot(hw)};
    };
    const double size = w.lpNorm<1>() * v.lpNorm<Eigen::Infinity>();
    result.rounding = adjoint::rounding_between(nudged, second_order_tolerance.epsilon,
                                                most_rounding(second_order_tolerance.epsilon, size));
  }
  return true;
}

/// The scene's cells (empty), or a coarser grid of at most most_cells cells.
std::vector<int> affordable_grid(const model::Problem& problem) {
  std::vector<int> cells;
  for (const model::Axis& axis : problem.axes) cells.push_back(axis.cells);
  const auto total = [&] { return std::accumulate(cells.begin(), cells.end(), 1.0, std::multiplies<>()); };
  bool reduced = false;
  while (total() > most_cells) {
    for (int& n : cells) n = std::max(1, (n + 1) / 2);
    reduced = true;
  }
  return reduced ? cells : std::vector<int>{};
}

std::vector<double> halved_steps(int count) {
  std::vector<double> steps;
  for (int k = 0; k < count; ++k) steps.push_back(1e-2 * std::exp2(-k));
  return steps;
}

QuotientEvidence quotients_along(const Line& f, const DirectionalDerivative& derivative) {
  const std::vector<double> steps = halved_steps(22);
  return judge(quotients_of(f, steps, rounding_of(f, 1e-8, 0x1p-52)), derivative);
}

/// Rounding of a derivative that vanishes on this grid; else 0.
double rounding_where_zero(const std::vector<DotCase>& cases, const std::string& grid) {
  double result = 0;
  for (const DotCase& one : cases) {
    if (one.grid == grid && one.is_rounding) result = std::max(result, one.rounding);
  }
  return result;
}

/// Ignores the first four, largest steps: they may cross a kink of a loss that is linear around the point. A wrong
/// gradient would show in the others, as its remainder is of first order.
bool is_only_rounding(const std::vector<Remainder>& remainders, double rounding) {
  return std::all_of(remainders.begin() + 4, remainders.end(),
                     [&](const Remainder& r) { return r.value <= 100 * rounding; });
}

std::string note_on(const Certificate& certificate, const std::string& grid) {
  if (certificate.slope) return "on " + grid + " cells";
  if (certificate.is_all_zero()) return "the loss does not change";
  return certificate.only_rounding ? "the remainder is rounding: the loss is linear in the unknowns around this point"
                                   : "the remainder shows no slope";
}

/// Second derivative along the direction.
double bend_along(driver::Inverse& inverse, const Point& point) {
  Eigen::VectorXd product(inverse.size());
  inverse.product(point.x, point.direction, product, Curvature::full);
  return point.direction.dot(product);
}

/// Difference quotients of the slope along the line, with their own rounding. They converge to the second derivative
/// even if the third one is so large that no remainder of the loss above rounding falls as h^3.
QuotientEvidence quotients_of_gradient(driver::Inverse& inverse, const Point& point, double bend) {
  Eigen::VectorXd gradient(inverse.size());
  const Line slope = [&](double step) {
    inverse.value_and_gradient(point.x + step * point.direction, gradient);
    return gradient.dot(point.direction);
  };
  return judge(quotients_of(slope, halved_steps(22), rounding_of(slope, 0x1p-40, 0x1p-52)),
               {bend, largest_asymmetry * std::abs(bend)});
}

/// Unknowns whose terms are below the allowed difference of tangent and adjoint; all if nothing was tested.
std::vector<std::string> hidden_unknowns(const driver::Inverse& inverse, const Eigen::VectorXd& gradient,
                                         const Certificate& certificate) {
  const Eigen::VectorXd terms = gradient.cwiseProduct(certificate.point.direction).cwiseAbs();
  const double least = certificate.tests_nothing() ? INFINITY : largest_dot_error * terms.sum();
  std::vector<std::string> names;
  for (const driver::Inverse::Part& part : inverse.parts()) {
    if (terms.segment(part.offset, part.size).sum() <= least) names.push_back(part.name);
  }
  return names;
}

/// Tests each unknown hidden by others on its own; it stays untested if that test is not meaningful either.
bool test_alone(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                const driver::SessionOptions& options, const Tolerance& tolerance, Random& random,
                Certificate& certificate, DiagnosticSink& sink) {
  const std::vector<std::string> hidden = certificate.untested;
  if (hidden.empty() || certificate.tests_nothing()) return true;
  const auto session = driver::Session::open(source, compiled, options, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  if (!inverse) return false;
  for (const driver::Inverse::Part& part : inverse->parts()) {
    if (std::ranges::find(hidden, part.name) == hidden.end()) continue;
    Point alone{certificate.point.x, Eigen::VectorXd::Zero(inverse->size())};
    alone.direction.segment(part.offset, part.size) = certificate.point.direction.segment(part.offset, part.size);
    Comparison one =
        compare_at(*session, *inverse, alone, tolerance, rounding_in_run(source, *compiled, options, *session), random);
    one.what += fmt::format(", by {} alone", part.name);
    std::vector<DotCase> cases;
    add_cases({one}, tolerance, cases, certificate.skipped);
    for (const DotCase& found : cases) {
      if (!found.is_zero && !found.is_rounding) std::erase(certificate.untested, part.name);
      certificate.cases.push_back(found);
    }
  }
  return true;
}

/// Looks for a jump of the loss near the point. Remainders that fall as h^2 at small steps may hide a jump, or a steep
/// ramp, of a formula with jumps or kinks. If remainders are rounding, they may hide any jump.
void look_for_jump(const driver::Compiled& compiled, const Line& along, const DirectionalDerivative& derivative,
                   Certificate& certificate) {
  const bool may_jump = driver::may_jump(compiled);
  if (!may_jump && !has_kinks(compiled) && !certificate.only_rounding) return;
  certificate.jump = jump_beside(along, derivative.value, halved_steps(16), derivative.rounding);
  certificate.is_jump_of_scheme = certificate.jump && !may_jump && compiled.problem->scheme.has_clamp();
}

bool add_taylor(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                const driver::SessionOptions& options, Random& random, Certificate& certificate, DiagnosticSink& sink) {
  const auto session = driver::Session::open(source, compiled, options, sink);
  if (!session) return false;
  const auto inverse = driver::Inverse::open(*session, source, sink);
  if (!inverse) return false;
  const Point& point = certificate.point = generic_point(*session, *inverse, random);
  Eigen::VectorXd gradient(inverse->size());
  certificate.start_is_finite = is_finite_at_start(*inverse);
  certificate.jump_at_start = jump_at_start(*session, *inverse);
  if (has_kinks(*compiled)) certificate.kinks = kinks_at_start(*inverse, random);
  const double loss = inverse->value_and_gradient(point.x, gradient);
  certificate.steady = inverse->last().steady;
  certificate.untested = hidden_unknowns(*inverse, gradient, certificate);
  inverse->hold_steps(true);
  const double slope = gradient.dot(point.direction), scale = gradient.cwiseAbs().dot(point.direction.cwiseAbs());
  const bool has_hessian = inverse->has_products(Curvature::full);
  const double bend = has_hessian ? bend_along(*inverse, point) : 0;
  const Line along = [&](double step) { return inverse->value(point.x + step * point.direction); };
  std::vector<Remainder> with_hessian;
  for (int k = 0; k < 16; ++k) {
    const double step = 1e-2 * std::exp2(-k);
    const double rest = along(step) - loss - step * slope;
    certificate.remainders.push_back({step, std::abs(rest)});
    with_hessian.push_back({step, std::abs(rest - 0.5 * step * step * bend)});
  }
  // If terms of the loss cancel, its rounding exceeds that of its value. Kinks add little between such close points.
  const double measured = rounding_of(along, 0x1p-40, 0x1p-52);
  const double of_slope = 1e-2 * rounding_where_zero(certificate.cases, grid_text(*session));
  const double rounding = std::max(
      {measured, of_slope, 1e-13 * (std::abs(loss) + 1e-2 * std::abs(slope)) * std::sqrt(1.0 + session->steps())});
  certificate.slope = has_kinks(*compiled) ? slope_at_small_steps(certificate.remainders, 10 * rounding)
                                           : remainder_slope(certificate.remainders, 10 * rounding);
  const bool finite = std::isfinite(loss) && std::isfinite(slope);
  certificate.only_rounding = finite && is_only_rounding(certificate.remainders, rounding);
  // Other slopes come from steps that cross kinks.
  if (certificate.only_rounding && !has_slope_of_two(certificate.slope)) certificate.slope.reset();
  if (has_hessian && certificate.second) {
    certificate.second->slope = remainder_slope(with_hessian, 10 * rounding);
    certificate.second->only_rounding = finite && is_only_rounding(with_hessian, rounding);
  }
  if (finite && !certificate.only_rounding && !has_slope_of_two(certificate.slope)) {
    certificate.quotients = quotients_along(along, {slope, largest_dot_error * scale});
  }
  if (finite && !falls_as_squares(certificate.remainders, 10 * rounding))
    look_for_jump(*compiled, along, {slope, certificate.only_rounding ? 10 * rounding : measured}, certificate);
  if (finite && has_hessian && certificate.second && !certificate.second->is_settled())
    certificate.second->quotients = quotients_of_gradient(*inverse, point, bend);
  inverse->hold_steps(false);
  inverse->assign(point.x);
  if (blows_up(*session) || !driver::instabilities_of(*session).empty()) {
    certificate.only_rounding = false;
    certificate.quotients.reset();
    certificate.note =
        "the run is not stable at this point: rounding grows with it, and no derivative can be told from it";
    return true;
  }
  certificate.note = note_on(certificate, grid_text(*session));
  return true;
}

/// Tests symmetry on the scene's grid and on small ones; add_taylor adds the slope.
bool add_second_order(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                      const driver::SessionOptions& options, Random& random, Certificate& certificate,
                      DiagnosticSink& sink) {
  const auto step = compiled->derived.find(compiled->step_name());
  if (step == compiled->derived.end() || !step->second.second) return true;
  certificate.second.emplace().has_kinks = has_kinks(*compiled);
  std::vector<Comparison> found;
  if (!add_symmetry_case(source, compiled, options, random, found, sink)) return false;
  for (const std::vector<int>& cells : small_grids(compiled->problem->axes.size(), compiled->stencil.networks)) {
    driver::SessionOptions small = options;
    small.cells = cells;
    small.steps = std::min(steps_on_small_grids, compiled->problem->steps);
    if (!add_symmetry_case(source, compiled, small, random, found, sink)) return false;
  }
  std::vector<DotCase>& cases = certificate.second->cases;
  add_cases(found, second_order_tolerance, cases, certificate.skipped);
  // If the gradient is only rounding at points without choices, second derivatives that agree are rounding too.
  for (DotCase& one : cases) {
    one.is_rounding = one.is_rounding || (certificate.tests_nothing() && one.relative_error <= largest_asymmetry);
  }
  if (cases.empty()) certificate.second.reset();
  return true;
}

/// The scene's grid with all steps and with one step, then small grids.
std::vector<driver::SessionOptions> runs_to_compare(const driver::Compiled& compiled, const CertifyOptions& options) {
  const model::Problem& problem = *compiled.problem;
  driver::SessionOptions own;
  own.threads = options.threads;
  own.stop = options.stop;
  own.window = options.window;
  own.cells = affordable_grid(problem);
  own.trusts_signs = true;  // points are made up
  driver::SessionOptions one_step = own;
  one_step.steps = std::min(1, problem.steps);
  // Data belong to times of the whole run; on an explicit grid they are made up.
  if (one_step.cells.empty()) {
    for (const model::Axis& axis : problem.axes) one_step.cells.push_back(axis.cells);
  }
  std::vector<driver::SessionOptions> runs{own, one_step};
  for (const std::vector<int>& cells : small_grids(problem.axes.size(), compiled.stencil.networks)) {
    driver::SessionOptions& small = runs.emplace_back(own);
    small.cells = cells;
    small.steps = std::min(steps_on_small_grids, problem.steps);
  }
  runs.front().judge = options.judge;  // only this run uses data of other scenes
  return runs;
}

bool compare_all(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                 const CertifyOptions& options, Random& random, const Tolerance& tolerance, std::vector<DotCase>& cases,
                 std::vector<std::string>& skipped, DiagnosticSink& sink) {
  std::vector<Comparison> found;
  for (const driver::SessionOptions& run : runs_to_compare(*compiled, options)) {
    std::optional<Comparison> one = compare(source, compiled, run, tolerance, random, sink);
    if (!one) return false;
    found.push_back(std::move(*one));
  }
  add_cases(found, tolerance, cases, skipped);
  return true;
}

}  // namespace

std::optional<Certificate> certify(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                                   const CertifyOptions& given, DiagnosticSink& sink) {
  Random random(given.seed + 20240229);
  Certificate certificate;
  certificate.window = driver::first_window(*compiled, source);
  CertifyOptions options = given;
  options.window = certificate.window.start;
  const Tolerance tolerance{largest_dot_error, rounding_of_loss, 1, 0x1p-52, "the run"};
  if (!compare_all(source, compiled, options, random, tolerance, certificate.cases, certificate.skipped, sink))
    return std::nullopt;
  driver::SessionOptions own = runs_to_compare(*compiled, options).front();
  own.judge = {};  // was called above
  if (!add_second_order(source, compiled, own, random, certificate, sink)) return std::nullopt;
  if (!add_taylor(source, compiled, own, random, certificate, sink) ||
      !test_alone(source, compiled, own, tolerance, random, certificate, sink))
    return std::nullopt;
  return certificate;
}

bool certify_single_precision(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                              const CertifyOptions& given, Certificate& certificate, DiagnosticSink& sink) {
  Random random(given.seed + 20240229);
  CertifyOptions options = given;
  options.window = certificate.window.start;
  SinglePrecisionCheck& check = certificate.single.emplace();
  const Tolerance tolerance{largest_single_error, single_rounding_of_loss, 100, 0x1p-23, "the run in single precision"};
  return compare_all(source, compiled, options, random, tolerance, check.cases, certificate.skipped, sink);
}

}  // namespace dpde::analysis
