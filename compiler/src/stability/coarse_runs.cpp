// SPDX-License-Identifier: Apache-2.0
#include "stability/coarse_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "stability/coupled_means.h"
#include "stability/equations.h"
#include "stability/folded_products.h"
#include "stability/verdict.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stability {

namespace {

constexpr double infinite_step = std::numeric_limits<double>::infinity();
constexpr double values_of_transform = 8, values_of_solve = 100;      // that take the time of one of these in a cell
constexpr double own_cells = 83'000, own_cells_with_solves = 33'000;  // 60 steps of so many are some 5e6 cells
constexpr int fewest_cells_along = 8;
constexpr double farthest_from_guess = 4096, shortest_of_guess = 1e-3;  // of the first step that is tried
constexpr double precision_on_coarse = 2e-2, unknown_power = 2, largest_power = 4;
constexpr double surely_lower = 0.8;  // of a limit of waves: what the power of two coarse grids may miss
constexpr double hundredfold_growth = 4.605170185988092;  // ln 100

double values_of(const stencil::Module& module, const std::vector<stencil::Statement>& body) {
  double sum = 0;
  for (const stencil::Statement& statement : body) {
    sum += match(
        statement, [](const stencil::Fill&) { return 0.0; }, [](const stencil::Fold&) { return 0.0; },
        [](const stencil::Reduce&) { return 1.0; }, [](const stencil::NetworkCall&) { return 0.0; },
        [](const stencil::Transform& transform) {
          return values_of_transform * static_cast<double>(1 + transform.terms.size());
        },
        [&](const stencil::Run& run) { return static_cast<double>(module.find_kernel(run.kernel)->stores.size()); },
        [](const stencil::Solve&) { return values_of_solve; },
        [&](const stencil::Repeat& repeat) { return values_of(module, repeat.body); });
  }
  return sum;
}

double product_of_cells(const std::vector<model::Axis>& axes) {
  double cells = 1;
  for (const model::Axis& axis : axes) cells *= axis.cells;
  return cells;
}

std::vector<model::Axis> with_half_the_cells(std::vector<model::Axis> axes) {
  for (model::Axis& axis : axes) axis.cells = axis.cells > fewest_cells_along ? (axis.cells + 1) / 2 : axis.cells;
  return axes;
}

/// Of the cells that lie in each of the coarse ones.
std::vector<double> means_on(const std::vector<double>& values, const stencil::Cell& fine,
                             const stencil::Cell& coarse) {
  const auto count =
      static_cast<std::size_t>(coarse[0]) * static_cast<std::size_t>(coarse[1]) * static_cast<std::size_t>(coarse[2]);
  std::vector<double> sums(count), numbers(count);
  std::size_t from = 0;
  stencil::for_each_cell({0, 0, 0}, fine, [&](const stencil::Cell& cell) {
    std::size_t to = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      const std::int64_t at = std::int64_t{cell[axis]} * coarse[axis] / fine[axis];
      to = to * static_cast<std::size_t>(coarse[axis]) + static_cast<std::size_t>(at);
    }
    sums[to] += values[from++];
    ++numbers[to];
  });
  for (std::size_t i = 0; i < count; ++i) sums[i] /= numbers[i];
  return sums;
}

stencil::State inputs_on(const stencil::State& scene, const LinearStep& linear, const std::vector<model::Axis>& axes) {
  stencil::State memory = memory_for(linear, grid_of(axes));
  memory.inverses = stencil::new_inverses();
  for (const std::string& input : linear.inputs()) {
    if (stencil::is_coordinate(input)) {
      const auto axis = static_cast<std::size_t>(input[0] - 'x');
      memory.set_coordinate(static_cast<int>(axis), axes[axis].topology, axes[axis].low, axes[axis].spacing());
    } else {
      memory.set(input, means_on(scene.get(input), scene.grid().cells, memory.grid().cells));
    }
  }
  return memory;
}

stencil::Params params_on(stencil::Params params, const std::vector<model::Axis>& axes) {
  for (const model::Axis& axis : axes) params["h" + axis.name] = axis.spacing();
  params["cells"] = product_of_cells(axes);
  return params;
}

}  // namespace

double values_a_cell(const LinearStep& linear) {
  const stencil::Module& module = linear.coupled_module();
  return std::max(1.0, values_of(module, module.programs.front().body));
}

std::unique_ptr<CoarseRuns> CoarseRuns::make(driver::Session& session, const LinearStep& linear,
                                             const FrozenPoint& point) {
  const model::Problem& problem = session.problem();
  const bool folds = folds_products(problem, linear.group());
  if (!linear.couples_means() && !problem.metric && !folds) return nullptr;
  std::vector<model::Axis> axes = session.axes();
  const double most_cells = most_values / (steps_of_search * values_a_cell(linear));
  const double most_own = folds ? most_cells : linear.solves() ? own_cells_with_solves : own_cells;
  const auto is_stretched = [](const model::Axis& axis) { return axis.stretch.has_value(); };
  if (product_of_cells(axes) <= most_own || std::ranges::any_of(axes, is_stretched) || has_events_in_each_step(problem))
    return nullptr;
  std::unique_ptr<CompiledTangent> tangent = CompiledTangent::of_coupled(linear);
  if (tangent == nullptr) return nullptr;
  std::unique_ptr<CoarseRuns> result(new CoarseRuns(std::move(tangent)));
  while (product_of_cells(axes) > most_cells && product_of_cells(with_half_the_cells(axes)) < product_of_cells(axes)) {
    axes = with_half_the_cells(std::move(axes));
    ++result->halvings_;
  }
  result->cells_ = product_of_cells(axes);
  const stencil::State scene = initial_inputs(session, linear);
  for (const auto& on : {axes, with_half_the_cells(axes)})
    result->grids_.push_back({inputs_on(scene, linear, on), params_on(point.params, on)});
  return result;
}

double CoarseRuns::grown(const OnCells& on, double step, int steps) const {
  stencil::Params params = on.params;
  params["dt"] = step;
  return tangent_->repeated(on.inputs, params, steps).growths.back();
}

double CoarseRuns::growth(double step) const {
  return grown(grids_.front(), step, steps_of_run) / (steps_of_run - CompiledTangent::steps_between_growths);
}

/// What short steps make of it is the equations' where steps of half their length make the same.
bool CoarseRuns::is_stable(const OnCells& on, double step) const {
  constexpr int parts = 4;
  constexpr double alike = 0.3;
  const double beyond = grown(on, step, steps_of_run) - hundredfold_growth;
  if (beyond <= 0) return true;
  if (!std::isfinite(beyond)) return false;
  const double by_right = grown(on, step / parts, parts * steps_of_run);
  if (!(beyond <= 2 * by_right)) return false;
  return std::abs(grown(on, step / (2 * parts), 2 * parts * steps_of_run) / by_right - 1) < alike;
}

/// Near `guess`; infinite where all are that are tried, 0 where none is.
double CoarseRuns::largest_stable(const OnCells& on, double guess) const {
  double low = guess, high = guess;
  if (is_stable(on, guess)) {
    for (high = 2 * guess; high < farthest_from_guess * guess && is_stable(on, high); high *= 2) low = high;
    if (!(high < farthest_from_guess * guess)) return infinite_step;
  } else {
    for (low = 0.5 * guess; low > shortest_of_guess * guess && !is_stable(on, low); low *= 0.5) high = low;
    if (!(low > shortest_of_guess * guess)) return 0;
  }
  while (high - low > precision_on_coarse * high) {
    const double middle = 0.5 * (low + high);
    (is_stable(on, middle) ? low : high) = middle;
  }
  return low;
}

CoarseRuns::Limit CoarseRuns::limit(double guess) const {
  const double fine = largest_stable(grids_[0], guess);
  if (!std::isfinite(fine) || fine == 0) return {fine, 1};
  const double coarse = largest_stable(grids_[1], fine);
  const double power =
      std::isfinite(coarse) && coarse > 0 ? std::clamp(std::log2(coarse / fine), 0.0, largest_power) : unknown_power;
  const double factor = std::exp2(power * halvings_);
  return {fine / factor, factor};
}

void lower_by(const CoarseRuns& runs, Verdict& verdict) {
  if (verdict.limit.kind == StepLimit::Kind::never) return;
  const bool has_limit = verdict.limit.kind == StepLimit::Kind::limit;
  const CoarseRuns::Limit found = runs.limit(has_limit ? verdict.limit.step : verdict.step);
  if (!(found.step < (has_limit ? surely_lower * verdict.limit.step : infinite_step))) return;
  verdict.limit.kind = found.step > 0 ? StepLimit::Kind::limit : StepLimit::Kind::never;
  verdict.limit.step = found.step;
  verdict.limit.order = 1;
  verdict.is_of_means = true;
  verdict.place.clear();
  if (!(verdict.step > found.step)) return;
  const double growth = runs.growth(found.factor * verdict.step);
  verdict.growth = std::max(verdict.growth, std::exp(growth));
  verdict.beyond = std::max(verdict.beyond, growth - 2 * verdict.growth_rate * verdict.step - verdict.growth_by_events);
}

}  // namespace dpde::stability
