// SPDX-License-Identifier: Apache-2.0
// random_field(seed = 1, lowest = 2, highest = 8, slope = -2), and random_signal with the same arguments: sums of waves
// with random phases. These are formulas, so they are the same on every grid and in every program, and are allowed
// wherever formulas are. noise(7) is a separate number in each cell: not a formula, but data that the runtime draws
// (dpde/runtime/random.h).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "model/build.h"
#include "model/from_ast/formulas/elaborate.h"
#include "model/from_ast/names/seed.h"

namespace dpde::model {

namespace {

constexpr double two_pi = 6.283185307179586;
constexpr double highest_number = 64;  // number of waves along the grid
constexpr std::size_t most_waves = 48;

struct Wave {
  std::array<int, 3> number{};  // number of periods along each axis
  double weight = 0;            // share of the energy
  double phase = 0;
};

/// In [0, 1). The standard fixes the output of the engine but not that of its distributions.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// From each pair n, -n selects the one whose first nonzero component is positive.
bool is_of_half_space(const std::array<int, 3>& n) {
  for (const int component : n) {
    if (component != 0) return component > 0;
  }
  return false;
}

/// All waves with lowest <= |n| <= highest. A shell of radius |n| has about |n|^(axes-1) waves and the energy
/// |n|^slope.
std::vector<Wave> waves_between(double lowest, double highest, double slope, int axes) {
  std::vector<Wave> waves;
  const int reach = static_cast<int>(std::floor(highest));
  const auto limit = [&](int axis) { return axis < axes ? reach : 0; };
  for (int x = -limit(0); x <= limit(0); ++x) {
    for (int y = -limit(1); y <= limit(1); ++y) {
      for (int z = -limit(2); z <= limit(2); ++z) {
        const double size = std::sqrt(static_cast<double>(x * x + y * y + z * z));
        if (!is_of_half_space({x, y, z}) || size < lowest || size > highest) continue;
        waves.push_back({{x, y, z}, std::pow(size, slope - (axes - 1)), 0});
      }
    }
  }
  return waves;
}

/// Reduces the waves to `most_waves`. Waves of large energy are kept; the others are sampled with probabilities
/// proportional to their energies and get equal energies. So the expected energy of each wave is its own, and the total
/// energy is unchanged.
void choose(std::vector<Wave>& waves, std::mt19937_64& random) {
  if (waves.size() <= most_waves) return;
  std::ranges::stable_sort(waves, std::ranges::greater{}, &Wave::weight);
  std::vector<double> rest(waves.size() + 1,
                           0);  // energy of all waves from this one on; summed from the smallest, to avoid cancellation
  for (std::size_t i = waves.size(); i-- > 0;) rest[i] = rest[i + 1] + waves[i].weight;
  std::size_t sure = 0;
  while (sure < most_waves && waves[sure].weight * static_cast<double>(most_waves - sure) >= rest[sure]) ++sure;
  if (sure == most_waves) return waves.resize(most_waves);
  for (std::size_t i = waves.size() - 1; i > sure; --i) {
    std::swap(waves[i], waves[sure + static_cast<std::size_t>(uniform(random) * static_cast<double>(i - sure + 1))]);
  }
  // systematic sampling: equidistant points on the cumulated energies
  std::vector<Wave> chosen(waves.begin(), waves.begin() + static_cast<std::ptrdiff_t>(sure));
  const double distance = rest[sure] / static_cast<double>(most_waves - sure);
  double next = uniform(random) * distance, end = 0;
  for (std::size_t i = sure; i < waves.size() && chosen.size() < most_waves; ++i) {
    end += waves[i].weight;
    if (end <= next) continue;
    chosen.push_back(waves[i]);
    chosen.back().weight = distance;
    next += distance;
  }
  waves = std::move(chosen);
}

/// A direction, a coordinate or the time, with its begin and length.
struct Direction {
  Expr place;
  double begin, length;
};

Expr sum_of(const std::vector<Wave>& waves, const std::vector<Direction>& directions) {
  double energy = 0;
  for (const Wave& wave : waves) energy += wave.weight;
  std::optional<Expr> sum;
  for (const Wave& wave : waves) {
    std::optional<Expr> angle;
    double phase = wave.phase;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      if (wave.number[d] == 0) continue;
      const double rate = two_pi * wave.number[d] / directions[d].length;
      phase -= rate * directions[d].begin;
      angle = angle ? plus(*angle, times(rate, directions[d].place)) : times(rate, directions[d].place);
    }
    // the mean of cos^2 is 1/2: the mean square of the sum is 1
    const Expr term =
        times(std::sqrt(2 * wave.weight / energy), call(Fn::cos, {plus(*angle, std::remainder(phase, two_pi))}));
    sum = sum ? plus(*sum, term) : term;
  }
  return *sum;
}

}  // namespace

namespace formulas {

namespace {

struct Spectrum {
  double seed = 0, lowest = 1, highest = 1, slope = 0;
};

std::optional<Spectrum> spectrum(FormulaScope& here, const ast::Call& e) {
  Spectrum result;
  const std::pair<const char*, double*> known[] = {
      {"seed", &result.seed}, {"lowest", &result.lowest}, {"highest", &result.highest}, {"slope", &result.slope}};
  std::vector<std::string> given;
  bool fine = true;
  for (const ast::Argument& argument : e.arguments) {
    const auto found = std::ranges::find_if(known, [&](const auto& entry) { return argument.name == entry.first; });
    fine = fine && found != std::end(known) && std::ranges::count(given, argument.name) == 0;
    if (!fine) break;
    given.push_back(argument.name);
    const auto value = evaluate(here.elaboration, argument.value, "the " + argument.name);
    if (!value) return std::nullopt;
    *found->second = *value;
  }
  for (const char* name : {"seed", "lowest", "highest"}) fine = fine && std::ranges::count(given, name) == 1;
  if (!fine) {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range,
                                 {e.callee, "seed, lowest, highest and, if it is not 0, slope", "this"},
                                 fmt::format("write {}(seed = 1, lowest = 2, highest = 8, slope = -2)", e.callee));
    return std::nullopt;
  }
  const bool has_waves =
      result.lowest > 0 && std::floor(result.highest) >= std::ceil(result.lowest) && result.highest <= highest_number;
  if (is_seed(result.seed) && has_waves && std::abs(result.slope) <= 20) return result;
  here.elaboration.sink.report(
      "bad-spectrum", e.callee_range, {e.callee},
      fmt::format("seed is a whole number from 0 on; a whole number lies between lowest > 0 and highest "
                  "<= {}; slope is between -20 and 20",
                  highest_number));
  return std::nullopt;
}

}  // namespace

TypedExpr random_waves(FormulaScope& here, const ast::Call& e, SourceRange range) {
  const auto given = spectrum(here, e);
  if (!given) return {};
  const Problem& problem = here.elaboration.problem;
  const bool in_time = e.callee == "random_signal";
  if (!in_time && here.axis_count() == 0) return refuse(here, e.callee, e.callee_range);  // or no axis is known yet
  std::vector<Direction> directions;
  const FunctionScope* const function = std::exchange(here.function, nullptr);  // its x is not the coordinate
  const std::map<std::string, TypedExpr> running = std::exchange(here.variables, {});
  for (int axis = 0; axis < (in_time ? 1 : here.axis_count()); ++axis) {
    const TypedExpr place = named(here, {in_time ? "t" : axis_name(axis)}, range);
    if (place.type == TypedExpr::Type::none) break;
    const Axis& along = problem.axes[static_cast<std::size_t>(axis)];
    directions.push_back(
        in_time ? Direction{place.parts[0], problem.t_begin, problem.steps > 0 ? problem.steps * problem.step : 1}
                : Direction{place.parts[0], along.low, along.high - along.low});
  }
  here.function = function;
  here.variables = running;
  const int count = static_cast<int>(directions.size());
  if (count != (in_time ? 1 : here.axis_count())) return {};
  std::mt19937_64 random(static_cast<std::uint64_t>(given->seed));
  std::vector<Wave> waves = waves_between(given->lowest, given->highest, given->slope, count);
  choose(waves, random);
  for (Wave& wave : waves) wave.phase = two_pi * uniform(random);
  return {TypedExpr::Type::number, {sum_of(waves, directions)}};
}

/// Allowed only where it is evaluated once: in an equation it would look like noise in time.
TypedExpr white_noise(FormulaScope& here, const ast::Call& e, SourceRange range) {
  if (here.context != FormulaContext::initial && here.context != FormulaContext::coefficient &&
      here.context != FormulaContext::control_field) {
    here.elaboration.sink.report(
        "not-allowed-here", e.callee_range, {"noise", std::string(place_of(here.context))},
        "noise is drawn once a run: write coefficient f in the model, f = noise(7) in the scene, and f here");
    return {};
  }
  const bool one = e.arguments.size() == 1 && (e.arguments[0].name.empty() || e.arguments[0].name == "seed");
  if (!one) {
    here.elaboration.sink.report("wrong-argument-count", e.callee_range, {"noise", "a seed", "this"}, "write noise(7)");
    return {};
  }
  const auto seed = evaluate(here.elaboration, e.arguments[0].value, "the seed");
  if (!seed) return {};
  if (!is_seed(*seed)) {
    here.elaboration.sink.report("bad-seed", e.arguments[0].value.range(), {fmt::format("{}", *seed)},
                                 "write noise(7)");
    return {};
  }
  return {TypedExpr::Type::number, {noise(static_cast<std::uint64_t>(*seed), {range})}};
}

}  // namespace formulas

}  // namespace dpde::model
