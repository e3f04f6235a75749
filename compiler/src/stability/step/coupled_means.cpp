// SPDX-License-Identifier: Apache-2.0
#include "stability/step/coupled_means.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>

#include "dpde/runtime/error.h"
#include "stability/eigenvalues/eigenvalues.h"
#include "stability/eigenvalues/ritz_pairs.h"
#include "stability/step/folded_products.h"
#include "stability/waves/amplification.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/contains.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr double ln_hundred = 4.605170185988092, much = 4 * ln_hundred;  // ln of growth in a run
constexpr double cells_of_run = 5e6, cells_with_solves = 1.5e6;          // cells times steps of a run
constexpr double most_cells_folded = 1.5e5;  // 2 runs of 60 steps and their references are some 10 s of 2026
constexpr double numbers_of_space = 2e7;
constexpr int largest_space = 40;
constexpr double settled = 1e-5, told_where_settled = 3e-5;  // of ln |g|
constexpr double rounding_of_space = 1e-11;
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

/// Blocks of solves contain no reductions, only kernels: see step_capabilities.h.
void take_out(Module& module, const Program& program, std::vector<Statement>& body,
              const std::function<bool(const Reduce&)>& is_out) {
  body = replace_kind<Reduce>(std::move(body), [&](const Reduce& reduce) -> std::vector<Statement> {
    if (!is_out(reduce)) return {reduce};
    Kernel nothing{"no_" + reduce.result, static_cast<int>(program.axes.size())};
    nothing.stores.push_back({reduce.result, false, 0.0, {}});
    return {Run{add_kernel(module, std::move(nothing))}};
  });
}

}  // namespace

Module without_coupled_means(Module module, const std::set<std::string>& rates) {
  const Program written = module.programs.front();
  take_out(module, written, module.programs.front().body,
           [&](const Reduce& reduce) { return is_weighted(module, written, reduce, rates); });
  return module;
}

Module without_means(Module module, const std::set<std::string>& rates) {
  const Program written = module.programs.front();
  take_out(module, written, module.programs.front().body,
           [&](const Reduce& reduce) { return rates.contains(reduce.result) || rates.contains(reduce.field); });
  return module;
}

namespace {

/// The contribution of means at a point: the difference of G between the constant wave and a very long one.
std::optional<Eigen::MatrixXcd> part_of_means(const LinearStep& linear, const FrozenPoint& point, int rank,
                                              double step) {
  constexpr double nearly_a_mean = 1e-5;  // radians a cell
  const std::optional<LinearisedStep> response = linear.response(point, step);
  if (!response) return std::nullopt;
  const Amplification amplification(*response, rank);
  Angles longest{};
  std::fill_n(longest.begin(), rank, nearly_a_mean);
  return amplification.at(Angles{}) - amplification.at(longest);
}

bool is_mean_no_wave(driver::Session& session, const LinearStep& linear, double step) {
  constexpr double alike = 1e-6;
  if (!linear.reduces()) return false;
  std::optional<Eigen::MatrixXcd> first;
  for (const ScenePoint& point : all_frozen_points(session, linear)) {
    const auto part = part_of_means(linear, point.point, static_cast<int>(session.axes().size()), step);
    if (!part || !part->allFinite()) continue;
    if (!first) first = part;
    if ((*part - *first).norm() > alike * std::max(part->norm(), first->norm())) return true;
  }
  return false;
}

double affordable_steps(driver::Session& session, const LinearStep& linear) {
  return (linear.solves() ? cells_with_solves : cells_of_run) / static_cast<double>(session.workspace().cell_count());
}

}  // namespace

LinearStep with_means_of_runs(driver::Session& session, const LinearStep& linear, double step) {
  if (!is_mean_no_wave(session, linear, step)) return linear;
  LinearStep coupled = linear.with_all_coupled();
  return CompiledTangent::of_coupled(coupled) != nullptr ? coupled : linear;
}

std::vector<FrozenPoint> moments_of(const FrozenPoint& worst, const std::vector<ScenePoint>& points) {
  constexpr std::size_t most_others = 4;
  const auto time_of = [](const FrozenPoint& point) {
    const auto found = point.params.find("t");
    return found == point.params.end() ? 0.0 : found->second;
  };
  std::set<double> times;
  for (const ScenePoint& point : points) times.insert(time_of(point.point));
  times.erase(time_of(worst));
  std::vector<FrozenPoint> result{worst};
  const std::size_t count = std::min(times.size(), most_others);
  for (std::size_t i = 0; i < count; ++i) {
    result.push_back(worst);
    result.back().params["t"] = *std::next(times.begin(), static_cast<std::ptrdiff_t>(i * times.size() / count));
  }
  return result;
}

std::unique_ptr<CoupledRuns> CoupledRuns::make(driver::Session& session, const LinearStep& linear,
                                               const FrozenPoint& point, bool has_events, double own_step,
                                               const LinearStep* euler) {
  const model::Problem& problem = session.problem();
  const bool folds = folds_products(problem, linear.group());
  std::unique_ptr<CompiledTangent> tangent = CompiledTangent::of_coupled(linear);
  if (tangent == nullptr) return nullptr;
  auto result = std::unique_ptr<CoupledRuns>(new CoupledRuns(
      TangentRuns(std::move(tangent), initial_inputs(session, linear)),
      [&session, &linear](double step) { return inputs_after(session, linear, step); }, point.params,
      static_cast<int>(std::clamp<double>(affordable_steps(session, linear), fewest_of_run, most_of_run)), own_step));
  for (const model::Axis& axis : session.axes()) result->are_rings_.push_back(axis.topology == Topology::periodic);
  if (folds) result->parts_ = parts_where_folded;
  result->tells_eigenvalues_ = !folds;
  if (has_events) result->by_events_ = std::max(0.0, result->growth(0));
  if (euler != nullptr && !folds) result->flow_ = CoupledFlow::make(session, *euler, point.params, numbers_of_space);
  if (result->flow_ == nullptr) return result;
  const Eigen::MatrixXd last = result->flow_->repeated(result->steps_).last;
  const int most = result->most_of_space(last);
  const auto found = result->growth_in(result->flow_->on_krylov_space(last, result->flow_->states(), most), most);
  if (found && found->is_told()) result->rate_ = found->growth / result->flow_->step();
  return result;
}

bool CoupledRuns::are_needed(driver::Session& session, const LinearStep& linear) {
  const model::Problem& problem = session.problem();
  return linear.couples_means() || problem.metric || folds_products(problem, linear.group());
}

bool CoupledRuns::are_long(driver::Session& session, const LinearStep& linear) {
  return affordable_steps(session, linear) >= most_of_run;
}

bool CoupledRuns::are_too_long(driver::Session& session, const LinearStep& linear) {
  const model::Problem& problem = session.problem();
  if (linear.couples_means() || problem.metric || !folds_products(problem, linear.group())) return false;
  return static_cast<double>(session.workspace().cell_count()) > most_cells_folded;
}

Params CoupledRuns::params_of(double step) const {
  Params params = params_;
  params["dt"] = step;
  return params;
}

TangentRuns::Repeated CoupledRuns::repeated(double step, int steps, double enough, int kept_steps) const {
  TangentRuns::Repeated result = runs_.repeated(params_of(step), steps, enough, kept_steps);
  constexpr double alike = 1e-9;
  if (!result.unsolved.empty() && std::abs(step - own_step_) <= alike * own_step_) throw NoSolution(result.unsolved);
  return result;
}

bool CoupledRuns::is_stable(double step) const {
  const auto known = are_stable_.find(step);
  return known != are_stable_.end() ? known->second : (are_stable_[step] = grows_nothing_in(step));
}

/// A short run comes first: most steps above a limit show growth soon, and the growth of the equations is then needed
/// for a short time only.
bool CoupledRuns::grows_nothing_in(double step) const {
  const auto is_allowed = [&](const std::vector<double>& growths) {
    const int steps = std::min(steps_, TangentRuns::steps_between_growths * static_cast<int>(growths.size()));
    const double grown = growths.back() - by_events_ * (steps - TangentRuns::steps_between_growths) - ln_hundred;
    return grown <= 0 || grown <= 2 * growth_by_equations(step, steps * step);
  };
  const bool grows_on = !flow_ && grown_.size() > 0 && eigenvalue_beyond_equations(step, grown_).is_told();
  if (grows_on) return false;
  const TangentRuns::Repeated first = repeated(step, steps_, much + by_events_ * steps_);
  const bool is_whole = std::ssize(first.growths) * TangentRuns::steps_between_growths >= steps_;
  const bool is_stable = is_allowed(first.growths) && (is_whole || is_allowed(growths_of_run(step, steps_))) &&
                         !eigenvalue_beyond_equations(step, first.last).is_told();
  if (!is_stable && first.last.allFinite()) grown_ = first.last;
  return is_stable;
}

int CoupledRuns::most_of_space(const Eigen::MatrixXd& start) const {
  const auto fit = static_cast<Eigen::Index>(numbers_of_space) / std::max<Eigen::Index>(1, start.size());
  return static_cast<int>(std::min<Eigen::Index>(largest_space, fit));
}

/// A Ritz value counts as an eigenvalue of the step if its residual is small, or if spaces smaller by 1, 2 and 5
/// dimensions have the same.
std::optional<CoupledRuns::OfSpace> CoupledRuns::growth_in(const KrylovSpace& space, Eigen::Index most) const {
  constexpr double surely = 3;
  const Eigen::Index size = space.matrix.rows();
  if (size == 0) return std::nullopt;
  const auto largest_of = [](const Eigen::MatrixXd& matrix) {
    const Eigen::VectorXcd values = eigenvalues_of_space(matrix);
    Eigen::Index largest = 0;
    values.cwiseAbs().maxCoeff(&largest);
    return values[largest];
  };
  const auto growth_of = [&](const Eigen::MatrixXd& matrix) { return std::log(std::abs(largest_of(matrix))); };
  const std::complex<double> value = largest_of(space.matrix);
  OfSpace result{std::log(std::abs(value))};
  result.told = surely * error_of_space(space.matrix, value, space.rest, rounding_of_space);
  bool is_settled = true;
  for (const Eigen::Index less : {1, 2, 5}) {
    if (size < most) break;  // the space is invariant
    is_settled = is_settled &&
                 std::abs(growth_of(space.matrix.topLeftCorner(size - less, size - less)) - result.growth) < settled;
  }
  if (is_settled) result.told = std::min(result.told, told_where_settled);
  result.told = std::max(result.told, least_told);
  return result;
}

KrylovSpace CoupledRuns::space_of(const TangentRuns& runs, double step, const Eigen::MatrixXd& start) const {
  const int most = most_of_space(start);
  if (!tells_eigenvalues_ || most < fewest_of_space || !start.allFinite()) return {};
  return runs.on_krylov_space(params_of(step), start, most);
}

/// The physical growth on the Krylov space of the perturbation that grew in a step. Without a flow short steps are
/// used, whose eigenvectors are nearly those of the step.
std::optional<double> CoupledRuns::growth_by_right(double step, const Eigen::MatrixXd& perturbation) const {
  const int most = most_of_space(perturbation);
  const std::optional<OfSpace> found =
      flow_ ? growth_in(flow_->on_krylov_space(perturbation, runs_.tangent().states(), most), most)
            : growth_in_space(runs_, step / parts_, perturbation);
  const double of_events = flow_ ? 0 : by_events_, parts = flow_ ? step / flow_->step() : parts_;
  if (!found || (!found->is_told() && found->growth - of_events > told_where_settled)) return std::nullopt;
  return std::max(rate_ * step, (found->growth - of_events) * parts);
}

/// About an unsteady state the tangent of a step is the exponential of the integral of L(t) over the step. That is
/// dt L(dt/2) + O(dt^3), not dt L(0).
std::optional<double> CoupledRuns::growth_midway(double step, const Eigen::MatrixXd& vector) const {
  std::optional<State> inputs = inputs_after_(0.5 * (step - step / parts_));
  if (!inputs) return std::nullopt;
  return growth_of_vector(runs_.about(std::move(*inputs)), step, vector);
}

CoupledRuns::OfSpace CoupledRuns::eigenvalue_beyond_equations(double step, const Eigen::MatrixXd& perturbation) const {
  const KrylovSpace space = space_of(runs_, step, perturbation);
  const std::optional<OfSpace> found = growth_in(space, most_of_space(perturbation));
  if (!found || !(found->growth - by_events_ > found->told)) return {};
  const auto beyond = [&](double right) {
    return OfSpace{found->growth - by_events_ - 2 * std::max(0.0, right), found->told};
  };
  std::optional<double> by_right = growth_by_right(step, perturbation);
  if (flow_ || (by_right && !beyond(*by_right).is_told())) return by_right ? beyond(*by_right) : OfSpace{};
  const std::optional<RitzPair> largest = largest_pair(space, perturbation);
  const Eigen::MatrixXd& vector = largest ? largest->vector : perturbation;
  if (!by_right) by_right = growth_of_vector(runs_, step, vector);
  if (!by_right) return {};
  by_right = std::max(*by_right, growth_midway(step, vector).value_or(*by_right));
  if (beyond(*by_right).is_told()) told_ = {step, std::max(0.0, *by_right), vector};
  return beyond(*by_right);
}

/// Beyond a limit growth is soon large. If it is still small, it rises from 0 as a power of the step.
double CoupledRuns::power_of_growth(double limit) const {
  constexpr double farther = 1.1, least_power = 1, most_power = 5;
  const double step = farther * limit;
  const TangentRuns::Repeated run = repeated(step, steps_, much + by_events_ * steps_);
  const int steps = std::min(steps_, TangentRuns::steps_between_growths * static_cast<int>(run.growths.size()));
  const double excess = run.growths.back() - by_events_ * steps - much;
  if (excess > 0 && excess > 2 * growth_by_equations(step, steps * step)) return 0;
  const OfSpace beyond = eigenvalue_beyond_equations(step, run.last);
  const double power = beyond.is_told() ? std::log(beyond.growth / beyond.told) / std::log(farther) : 0;
  return power > least_power && power < most_power ? power : 0;
}

double CoupledRuns::order_of_growth(double step) const {
  const auto beyond = [&](double of_step) {
    return eigenvalue_beyond_equations(of_step, repeated(of_step, steps_).last).growth;
  };
  const double of_half = beyond(0.5 * step), whole = of_half > 0 ? beyond(step) : 0;
  return whole > 0 ? std::log2(whole / of_half) : 0;
}

double CoupledRuns::Reference::at(double time) const {
  const auto index = static_cast<std::size_t>(std::max(0.0, std::ceil(time / step * (1 - 1e-9)) - 1));
  if (index < growths.size()) return growths[index];
  const std::size_t half = growths.size() / 2, last = growths.size() - 1;
  const double slope = last > half ? (growths[last] - growths[half]) / static_cast<double>(last - half) : 0;
  return growths[last] + (is_cut_off ? slope * static_cast<double>(index - last) : 0);
}

double CoupledRuns::Reference::up_to(double time) const {
  double largest = std::max(0.0, at(time));
  for (std::size_t i = 0; i < growths.size() && static_cast<double>(i) * step < time; ++i)
    largest = std::max(largest, growths[i]);
  return largest;
}

CoupledRuns::Reference CoupledRuns::reference(double step, double length) const {
  constexpr int between = TangentRuns::steps_between_growths;
  const int steps = static_cast<int>(std::ceil(length / step * (1 - 1e-12)));
  Reference result{between * step, growths_of_run(step, steps)};
  result.growths.resize(static_cast<std::size_t>((steps + between - 1) / between), result.growths.back());
  for (std::size_t i = 0; i < result.growths.size(); ++i)
    result.growths[i] -= by_events_ * between * static_cast<double>(i);
  return result;
}

CoupledRuns::Reference CoupledRuns::reference_by_flow(double length) const {
  constexpr int between = TangentRuns::steps_between_growths;
  const double parts = std::ceil(length / flow_->step() / between) * between, most = 8.0 * steps_;
  return {between * flow_->step(), flow_->repeated(static_cast<int>(std::min(parts, most))).growths, parts > most};
}

/// Short steps, halved until a half and a quarter of them give the same growth: else the scheme grows, not the
/// equations. Two comparisons, as one may agree by chance when all steps are far too long. If none agree, no physical
/// growth is known.
CoupledRuns::Reference CoupledRuns::reference_by_parts(double step, double length) const {
  constexpr int most_halvings = 4;
  constexpr double alike = 0.3, told = 2 * ln_hundred;
  double part = step / parts_;
  Reference result = reference(part, length);
  for (int i = 0; i <= most_halvings; ++i) {
    const auto passed = std::ranges::find_if(result.growths, [](double growth) { return !(growth < told); });
    if (passed == result.growths.end()) return result;
    const double time = result.step * static_cast<double>(passed - result.growths.begin() + 1);
    const auto grows_alike = [&](double shorter) {
      return std::abs(reference(shorter, time).growths.back() / *passed - 1) < alike;
    };
    if (grows_alike(part / 2) && grows_alike(part / 4)) return result;
    part /= 2;
    if (i < most_halvings) result = reference(part, length);
  }
  std::ranges::fill(result.growths, 0.0);
  return result;
}

double CoupledRuns::growth_by_equations(double step, double length) const {
  constexpr double more = 1.5;
  const bool has_all = reference_.is_cut_off || reference_.length() >= length * (1 - 1e-9);
  if (!has_all) {
    const double longer = std::max(length, more * reference_.length());  // the next query is often a little longer
    reference_ = flow_ ? reference_by_flow(longer) : reference_by_parts(step, longer);
  }
  return reference_.up_to(length);
}

double CoupledRuns::growth_rate(double step) const {
  const double by_right = growth_by_equations(step, steps_ * step);
  return by_right > ln_hundred ? by_right / (steps_ * step) : 0;
}

double CoupledRuns::late_growth_rate(double step) const {
  constexpr double told = 0.02;  // ln: a mixture of waves causes less
  const double length = steps_ * step;
  growth_by_equations(step, length);  // finds the reference
  const double later = reference_.at(length) - reference_.at(0.5 * length);
  return later > told ? later / (0.5 * length) : 0;
}

/// For a wave of L cells the sum of squared differences of neighbours is sin(pi/L)^2 of its maximum, 4 |u|^2.
double CoupledRuns::cells_of_waves(const TangentRuns::Repeated& run, double growth) const {
  const Eigen::MatrixXd& perturbation = run.last;
  double largest = 0;
  for (Eigen::Index state = 0; state < perturbation.cols(); ++state) {
    const double of_state = std::log(perturbation.col(state).norm() / run.kept.col(state).norm());
    if (!(growth + of_state > growth / 2)) continue;  // it is still the initial noise
    const double all = 4 * perturbation.col(state).squaredNorm();
    Eigen::Index stride = 1;
    for (std::size_t axis = 0; axis < are_rings_.size() && all > 0; ++axis) {
      const Eigen::Index n = runs_.inputs().grid().cells[axis];
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

/// By the second half of a run: by then the fastest growing wave dominates.
std::optional<ShortWaves> CoupledRuns::short_waves(double shortest, double longest, double time) const {
  constexpr double cells_of_long_run = 1.6e7, most_of_long_run = 800;  // times steps
  constexpr double few = 5, as_fast = 0.7, told = 2;                   // cells of a wave; in half the step; ln
  const double cells = static_cast<double>(runs_.inputs().grid().cells[0]) * runs_.inputs().grid().cells[1] *
                       runs_.inputs().grid().cells[2];
  const double affordable = std::clamp<double>(cells_of_long_run / cells, fewest_of_run, most_of_long_run);
  const double step = std::min(longest, std::max(shortest, time / affordable));
  constexpr int whole = TangentRuns::steps_between_growths;
  const int steps = static_cast<int>(std::min(affordable, time / step)) / whole * whole;
  const auto late_rate = [&](const std::vector<double>& growths, double of_step) {
    const std::size_t half = growths.size() / 2;
    const double length = static_cast<double>(growths.size() - 1 - half) * TangentRuns::steps_between_growths;
    return length > 0 ? (growths.back() - growths[half]) / (length * of_step) - by_events_ / of_step : 0;
  };
  const int half = steps / 2 / whole * whole;
  if (half == 0) return std::nullopt;
  const TangentRuns::Repeated run = repeated(step, steps, std::numeric_limits<double>::infinity(), half);
  if (!std::isfinite(run.growths.back())) return std::nullopt;
  const double of_half = run.growths[static_cast<std::size_t>(half / whole - 1)];
  const ShortWaves found{late_rate(run.growths, step), cells_of_waves(run, run.growths.back() - of_half)};
  if (!(found.rate * 0.5 * steps * step > told) || found.cells > few) return std::nullopt;
  const TangentRuns::Repeated finer = repeated(0.5 * step, 2 * steps);
  return late_rate(finer.growths, 0.5 * step) > as_fast * found.rate ? std::optional(found) : std::nullopt;
}

double CoupledRuns::growth(double step) const {
  const TangentRuns::Repeated run = repeated(step, steps_);
  const std::optional<OfSpace> of_space = growth_in_space(runs_, step, run.last);
  return of_space && of_space->told <= told_where_settled
             ? of_space->growth
             : run.growths.back() / (steps_ - TangentRuns::steps_between_growths);
}

}  // namespace dpde::stability
