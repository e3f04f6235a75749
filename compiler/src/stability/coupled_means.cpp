// SPDX-License-Identifier: Apache-2.0
#include "stability/coupled_means.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "stability/eigenvalues.h"
#include "stability/folded_products.h"
#include "stencil/build.h"
#include "stencil/effects.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr double ln_hundred = 4.605170185988092;
constexpr double cells_of_run = 5e6, cells_with_solves = 1.5e6;  // times steps
constexpr double numbers_of_space = 2e7;
constexpr int fewest_of_space = 8, most_of_space = 40;
constexpr double settled = 1e-5, told_eigenvalue = 3e-5;  // of ln |g|: a limit moves by as little
constexpr int fewest_of_run = 60, most_of_run = 400, parts_where_folded = 2;

/// Whether a kernel that makes the field reads perturbations and anything else, as where a maximum has its place: the
/// sums of these have no name among perturbations.
bool is_weighted(const Module& module, const Program& program, const Reduce& reduce,
                 const std::set<std::string>& rates) {
  return std::ranges::any_of(kernels_run(module, program), [&](const Kernel* kernel) {
    if (std::ranges::find(kernel->stores, reduce.field, &Store::field) == kernel->stores.end()) return false;
    const std::vector<Signature::Read> reads = signature(*kernel).reads;
    const auto is_rate = [&](const Signature::Read& read) { return rates.contains(read.field); };
    return (rates.contains(reduce.result) || std::ranges::any_of(reads, is_rate)) &&
           !std::ranges::all_of(reads, is_rate);
  });
}

void take_out(Module& module, const Program& program, std::vector<Statement>& body,
              const std::set<std::string>& rates) {
  for (Statement& statement : body) {
    const Reduce* weighted = nullptr;
    match(
        statement, [](Fill&) {}, [](Fold&) {},
        [&](const Reduce& reduce) {
          if (is_weighted(module, program, reduce, rates)) weighted = &reduce;
        },
        [](NetworkCall&) {}, [](Transform&) {}, [](Run&) {}, [](Solve&) {},  // of kernels alone: see survey.h
        [&](Repeat& repeat) { take_out(module, program, repeat.body, rates); });
    if (weighted == nullptr) continue;
    Kernel nothing{"no_" + weighted->result, static_cast<int>(program.axes.size())};
    nothing.stores.push_back({weighted->result, false, 0.0, {}});
    statement = Run{add_kernel(module, std::move(nothing))};
  }
}

}  // namespace

Module without_coupled_means(Module module, const std::set<std::string>& rates) {
  const Program written = module.programs.front();
  take_out(module, written, module.programs.front().body, rates);
  return module;
}

std::unique_ptr<CoupledRuns> CoupledRuns::make(driver::Session& session, const LinearStep& linear,
                                               const FrozenPoint& point, bool has_events) {
  const model::Problem& problem = session.problem();
  const bool folds = folds_products(problem, linear.group());
  if (!linear.couples_means() && !problem.metric && !folds) return nullptr;
  std::unique_ptr<CompiledTangent> tangent = CompiledTangent::of_coupled(linear);
  if (tangent == nullptr) return nullptr;
  const double steps =
      (linear.solves() ? cells_with_solves : cells_of_run) / static_cast<double>(session.workspace().cell_count());
  State inputs = initial_inputs(session, linear);
  auto result = std::unique_ptr<CoupledRuns>(
      new CoupledRuns(std::move(tangent), std::move(inputs), point.params,
                      static_cast<int>(std::clamp<double>(steps, fewest_of_run, most_of_run))));
  for (const model::Axis& axis : session.axes()) result->are_rings_.push_back(axis.topology == Topology::periodic);
  if (folds) result->parts_ = parts_where_folded;
  result->tells_eigenvalues_ = !folds;
  if (has_events) result->by_events_ = std::max(0.0, result->growth(0));
  return result;
}

CompiledTangent::Repeated CoupledRuns::repeated(double step, int steps, double enough) const {
  Params params = params_;
  params["dt"] = step;
  return tangent_->repeated(inputs_, params, steps, enough);
}

/// Most steps beyond a limit show it soon, and the equations need not be followed for long.
bool CoupledRuns::is_stable(double step) const {
  constexpr double much = 4 * ln_hundred;
  const auto is_allowed = [&](const std::vector<double>& growths) {
    const int steps = std::min(steps_, CompiledTangent::steps_between_growths * static_cast<int>(growths.size()));
    const double grown = growths.back() - by_events_ * (steps - CompiledTangent::steps_between_growths) - ln_hundred;
    return grown <= 0 || grown <= 2 * growth_by_equations(step, steps * step);
  };
  const CompiledTangent::Repeated first = repeated(step, steps_, much + by_events_ * steps_);
  const bool is_whole = std::ssize(first.growths) * CompiledTangent::steps_between_growths >= steps_;
  if (!is_allowed(first.growths) || !(is_whole || is_allowed(growths_of_run(step, steps_)))) return false;
  return !(eigenvalue_beyond_equations(step, first.last) > told_eigenvalue);
}

/// A space that is larger by some dimensions has the same where it shows an eigenvalue.
std::optional<CoupledRuns::OfSpace> CoupledRuns::growth_in_space(double step, const Eigen::MatrixXd& start) const {
  const auto fit = static_cast<Eigen::Index>(numbers_of_space) / std::max<Eigen::Index>(1, start.size());
  const auto most = std::min<Eigen::Index>(most_of_space, fit);
  if (!tells_eigenvalues_ || most < fewest_of_space || !start.allFinite()) return std::nullopt;
  Params params = params_;
  params["dt"] = step;
  const Eigen::MatrixXd of_space = tangent_->on_krylov_space(inputs_, params, start, static_cast<int>(most));
  const Eigen::Index size = of_space.rows();
  if (size == 0) return std::nullopt;
  const auto growth_in = [&](Eigen::Index part) {
    return std::log(eigenvalues(Eigen::MatrixXd(of_space.topLeftCorner(part, part))).cwiseAbs().maxCoeff());
  };
  OfSpace result{growth_in(size)};
  const double found = result.growth;
  for (const Eigen::Index less : {1, 2, 5}) {
    if (size < most) break;  // it holds all that steps make
    const double smaller = growth_in(size - less);
    result.growth = std::max(result.growth, smaller);
    result.is_settled = result.is_settled && std::abs(smaller - found) < settled;
  }
  return result;
}

/// Short steps have the vectors of the step, nearly: in the space of what has grown in the step they show what it does
/// by right, or that nothing of it grows.
double CoupledRuns::eigenvalue_beyond_equations(double step, const Eigen::MatrixXd& perturbation) const {
  const std::optional<OfSpace> found = growth_in_space(step, perturbation);
  if (!found || !found->is_settled || !(found->growth - by_events_ > told_eigenvalue)) return 0;
  const std::optional<OfSpace> by_parts = growth_in_space(step / parts_, perturbation);
  const double of_parts = by_parts ? by_parts->growth - by_events_ : 0;
  if (!by_parts || (!by_parts->is_settled && of_parts > told_eigenvalue)) return 0;
  return found->growth - by_events_ - 2 * std::max(0.0, of_parts) * parts_;
}

/// Beyond a limit growth is soon large. What still is as small has grown from nothing as a power of the step.
double CoupledRuns::power_of_growth(double limit) const {
  constexpr double farther = 1.1, least_power = 1, most_power = 5;
  const double step = farther * limit;
  const double beyond = eigenvalue_beyond_equations(step, repeated(step, steps_).last);
  const double power = beyond > 0 ? std::log(beyond / told_eigenvalue) / std::log(farther) : 0;
  return power > least_power && power < most_power ? power : 0;
}

double CoupledRuns::Reference::up_to(double time) const {
  double largest = 0;
  for (std::size_t i = 0; i < growths.size() && static_cast<double>(i) * step < time; ++i)
    largest = std::max(largest, growths[i]);
  return largest;
}

CoupledRuns::Reference CoupledRuns::reference(double step, double length) const {
  constexpr int between = CompiledTangent::steps_between_growths;
  const int steps = static_cast<int>(std::ceil(length / step * (1 - 1e-12)));
  Reference result{between * step, growths_of_run(step, steps)};
  result.growths.resize(static_cast<std::size_t>((steps + between - 1) / between), result.growths.back());
  for (std::size_t i = 0; i < result.growths.size(); ++i)
    result.growths[i] -= by_events_ * between * static_cast<double>(i);
  return result;
}

/// Steps of a part, and still shorter ones where a half and a quarter of these grow otherwise: then it is not the
/// equations that grow. One alone may agree by chance where all are far too long.
double CoupledRuns::growth_by_equations(double step, double length) const {
  constexpr int most_halvings = 4;
  constexpr double alike = 0.3, told = 2 * ln_hundred, more = 1.5;
  if (reference_.length() >= length * (1 - 1e-9)) return reference_.up_to(length);
  const double longer = std::max(length, more * reference_.length());  // the next to be asked is a little longer
  double part = step / parts_;
  reference_ = reference(part, longer);
  for (int i = 0; i < most_halvings; ++i) {
    const auto passed = std::ranges::find_if(reference_.growths, [](double growth) { return !(growth < told); });
    if (passed == reference_.growths.end()) break;
    const double time = reference_.step * static_cast<double>(passed - reference_.growths.begin() + 1);
    const auto grows_alike = [&](double shorter) {
      return std::abs(reference(shorter, time).growths.back() / *passed - 1) < alike;
    };
    if (grows_alike(part / 2) && grows_alike(part / 4)) break;
    part /= 2;
    reference_ = reference(part, longer);
  }
  return reference_.up_to(length);
}

double CoupledRuns::growth_rate(double step) const {
  const double by_right = growth_by_equations(step, steps_ * step);
  return by_right > ln_hundred ? by_right / (steps_ * step) : 0;
}

double CoupledRuns::late_growth_rate(double step) const {
  constexpr double told = 0.02;  // ln: less is what a mixture of waves makes
  const double length = steps_ * step;
  growth_by_equations(step, length);  // finds the reference
  const auto at = [&](double time) {
    const double index = std::ceil(time / reference_.step * (1 - 1e-9)) - 1;
    return reference_.growths[static_cast<std::size_t>(std::max(0.0, index))];
  };
  const double later = at(length) - at(0.5 * length);
  return later > told ? later / (0.5 * length) : 0;
}

/// A wave of L cells differs from one cell to the next by sin(pi/L)^2 of the most that it could.
double CoupledRuns::cells_of_waves(const CompiledTangent::Repeated& run, const CompiledTangent::Repeated& half) const {
  const Eigen::MatrixXd& perturbation = run.last;
  const double growth = run.growths.back() - half.growths.back();
  double largest = 0;
  for (Eigen::Index state = 0; state < perturbation.cols(); ++state) {
    const double of_state = std::log(perturbation.col(state).norm() / half.last.col(state).norm());
    if (!(growth + of_state > growth / 2)) continue;  // it keeps what it began with, noise
    const double all = 4 * perturbation.col(state).squaredNorm();
    Eigen::Index stride = 1;
    for (std::size_t axis = 0; axis < are_rings_.size() && all > 0; ++axis) {
      const Eigen::Index n = inputs_.grid().cells[axis];
      double sum = 0;
      for (Eigen::Index i = 0; i < perturbation.rows(); ++i) {
        const bool is_last = i / stride % n == n - 1;
        if (is_last && !are_rings_[axis]) continue;
        const Eigen::Index next = is_last ? i - (n - 1) * stride : i + stride;
        sum += std::pow(perturbation(next, state) - perturbation(i, state), 2);
      }
      largest = std::max(largest, sum / all);
      stride *= n;
    }
  }
  return largest > 0 ? std::numbers::pi / std::asin(std::sqrt(std::min(1.0, largest)))
                     : std::numeric_limits<double>::infinity();
}

/// The second half of a run tells: what is mixed at first has sorted itself by then.
std::optional<ShortWaves> CoupledRuns::short_waves(double shortest, double longest, double time) const {
  constexpr double cells_of_long_run = 1.6e7, most_of_long_run = 800;  // times steps
  constexpr double few = 5, as_fast = 0.7, told = 2;                   // cells of a wave; in half the step; ln
  const double cells = static_cast<double>(inputs_.grid().cells[0]) * inputs_.grid().cells[1] * inputs_.grid().cells[2];
  const double affordable = std::clamp<double>(cells_of_long_run / cells, fewest_of_run, most_of_long_run);
  const double step = std::min(longest, std::max(shortest, time / affordable));
  constexpr int whole = CompiledTangent::steps_between_growths;
  const int steps = static_cast<int>(std::min(affordable, time / step)) / whole * whole;
  const auto late_rate = [&](const std::vector<double>& growths, double of_step) {
    const std::size_t half = growths.size() / 2;
    const double length = static_cast<double>(growths.size() - 1 - half) * CompiledTangent::steps_between_growths;
    return length > 0 ? (growths.back() - growths[half]) / (length * of_step) - by_events_ / of_step : 0;
  };
  const CompiledTangent::Repeated run = repeated(step, steps);
  if (run.growths.empty() || !std::isfinite(run.growths.back())) return std::nullopt;
  const CompiledTangent::Repeated half = repeated(step, steps / 2 / whole * whole);
  if (half.growths.empty()) return std::nullopt;
  const ShortWaves found{late_rate(run.growths, step), cells_of_waves(run, half)};
  if (!(found.rate * 0.5 * steps * step > told) || found.cells > few) return std::nullopt;
  const CompiledTangent::Repeated finer = repeated(0.5 * step, 2 * steps);
  return late_rate(finer.growths, 0.5 * step) > as_fast * found.rate ? std::optional(found) : std::nullopt;
}

double CoupledRuns::growth(double step) const {
  const CompiledTangent::Repeated run = repeated(step, steps_);
  const std::optional<OfSpace> of_space = growth_in_space(step, run.last);
  return of_space && of_space->is_settled ? of_space->growth
                                          : run.growths.back() / (steps_ - CompiledTangent::steps_between_growths);
}

}  // namespace dpde::stability
