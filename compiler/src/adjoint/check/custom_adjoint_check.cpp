// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/custom_adjoint_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "adjoint/check/custom_adjoint_places.h"
#include "adjoint/check/rounding_between.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/interpret/interpret.h"
#include "stencil/interpret/with_rounding.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/text/print_stencil.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

constexpr double largest_error = 1e-11;
constexpr int most_cells = 4000;
constexpr int most_in_boxes = 100000;  // cells of all boxes together, for each input range
constexpr std::size_t longest_hint = 200;

/// Ranges from which inputs are drawn: functions may be undefined in some, and take other branches in others.
constexpr std::array<std::array<double, 2>, 4> input_ranges{{{0.5, 1.5}, {-1.5, 1.5}, {5, 15}, {-15, -5}}};

/// Boundary conditions that cannot hide errors: the ghost value is neither the cell's value nor its negative, but
/// contains a third or a fifth of it.
AxisBoundary walls(int axis, Topology topology) {
  const Expr spacing = param(std::string("h") + "xyz"[axis]);
  return {topology, {SideKind::mixed, 0.4, 1.0 / spacing, 1.0}, {SideKind::mixed, 0.7, 3.0 / spacing, 1.0}};
}

/// One run of a kernel between fills, as a program of its own.
Module lone_program(const Kernel& kernel, const std::vector<Topology>& axes) {
  Program program{"p", axes, {}, {}, {}};
  const Signature s = signature(kernel);
  for (const Signature::Read& read : s.reads) {
    std::vector<AxisBoundary> boundary;
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
      boundary.push_back(walls(static_cast<int>(axis), axes[axis]));
    if (!is_coordinate(read.field)) program.body.push_back(Fill{read.field, boundary});
  }
  Module module{{kernel}, {}, {}};
  Kernel begin{kernel.name + "_begin", kernel.rank, {}, {}, {}, {}};  // initialises the fields that are added to
  for (const std::string& field : s.updates) begin.stores.push_back({field, false, 0.0, {}});
  if (!begin.stores.empty()) {
    program.body.push_back(Run{begin.name});
    module.kernels.push_back(begin);
  }
  program.body.push_back(Run{kernel.name});
  for (const Store& store : kernel.stores) program.keeps.push_back(store.field);
  module.programs.push_back(std::move(program));
  return module;
}

/// A grid in which all neighbours of a cell differ, unless it would have too many cells.
Grid grid_for(const Kernel& kernel) {
  Grid grid{kernel.rank, {1, 1, 1}};
  const int most = static_cast<int>(std::pow(most_cells, 1.0 / kernel.rank));
  for (int axis = 0; axis < kernel.rank; ++axis) {
    int reach = 0;
    for (const Signature::Read& read : signature(kernel).reads) reach = std::max(reach, read.halo[axis]);
    grid.cells[axis] = std::min(2 * reach + 3, most);
  }
  return grid;
}

int cells_of(const Grid& grid) { return grid.cells[0] * grid.cells[1] * grid.cells[2]; }

/// Two numbers that must agree, the magnitude of their terms, and the difference that rounding may cause.
struct Products {
  double forward = 0, reverse = 0, scale = 0, rounding = 0;
  double error() const {
    const double difference = std::abs(forward - reverse);
    return difference <= rounding ? 0 : difference / std::max({std::abs(forward), std::abs(reverse), scale, 1e-300});
  }
};

Derivative rounded(const Derivative& exact, double phase) {
  return {with_rounding(exact.module, phase), exact.program, exact.links, exact.is_adjoint};
}

constexpr double spacing = 0.3;  // of the cells, if not known

/// A program with its derivatives by one input.
class Comparison {
 public:
  Comparison(const Module& module, const Derivative& tangent, const Derivative& adjoint, std::string input)
      : program_(module.programs.front()),
        interface_(interface_of(module, program_)),
        tangent_(tangent),
        adjoint_(adjoint),
        input_(std::move(input)) {}

  /// Dot products on the cells of a box, with values drawn from `range`; parameters in `known` have their values there.
  Products products(const Box& box, const std::array<double, 2>& range, const Params& known, std::mt19937_64& random) {
    box_ = box;
    inputs_.clear();
    for (const std::string& field : interface_.inputs) {
      if (!is_coordinate(field)) inputs_[field] = draw(range, random);
    }
    draw_params(range, known, random);
    direction_ = draw({-1, 1}, random);
    draw_seeds(random);
    Products result = products(tangent_, adjoint_);
    if (std::isfinite(result.forward - result.reverse) && result.error() > largest_error)
      result.rounding = rounding(random);
    return result;
  }

 private:
  void draw_seeds(std::mt19937_64& random) {
    seeds_.clear();
    sum_seeds_.clear();
    for (const std::string& field : program_.keeps) seeds_[field] = draw({-1, 1}, random);
    for (const std::string& sum : interface_.sums) sum_seeds_[sum] = draw_one({-1, 1}, random);
  }

  Products products(const Derivative& tangent, const Derivative& adjoint) {
    Products result;
    const bool is_field = inputs_.contains(input_);
    const std::vector<double>& direction = direction_;
    State forward = start(tangent);
    if (is_field) forward.set(*tangent.field(input_), direction);
    if (!is_field) params_[*tangent.param(input_)] = direction.front();
    const std::map<std::string, double> rates =
        interpret(tangent.module, *tangent.module.find_program(tangent.program), forward, params_);
    State back = start(adjoint);
    for (const std::string& result_field : program_.keeps) {
      const std::string *const rate = tangent.field(result_field), *const bar = adjoint.field(result_field);
      if (rate == nullptr) continue;
      const std::vector<double>& seed = seeds_.at(result_field);
      if (bar != nullptr) back.set(*bar, seed);
      add(seed, forward.get(*rate), result.forward, result.scale);
    }
    for (const std::string& sum : interface_.sums) {
      const std::string *const dot = tangent.sum(sum), *const bar = adjoint.sum(sum);
      const auto rate = dot != nullptr ? rates.find(*dot) : rates.end();
      if (rate == rates.end()) continue;
      const double seed = sum_seeds_.at(sum);
      if (bar != nullptr) params_[*bar] = seed;
      add({seed}, {rate->second}, result.forward, result.scale);
    }
    const auto sums = interpret(adjoint.module, *adjoint.module.find_program(adjoint.program), back, params_);
    if (is_field) {
      add(direction, back.get(*adjoint.field(input_)), result.reverse, result.scale);
    } else {
      const auto sum = sums.find(*adjoint.param(input_));
      add({direction.front()}, {sum == sums.end() ? 0.0 : sum->second}, result.reverse, result.scale);
    }
    return result;
  }

  /// Difference that rounding may cause, measured by perturbing inputs, parameters, direction, seeds and the results of
  /// all operations. Perturbed inputs alone do not suffice: (-1 + 1e-13)*d + d has three correct digits, and the same
  /// rounding error for all nearby d.
  double rounding(std::mt19937_64& random) {
    constexpr double epsilon = 0x1p-52;
    const Comparison as_drawn = *this;
    double size = 0;
    for (const double value : direction_) size += std::abs(value);
    for (const auto& [field, values] : inputs_) {
      for (const double value : values) size = std::max(size, std::abs(value));
    }
    const auto nudged = [&](double by) {
      Comparison near = as_drawn;
      for (auto* fields : {&near.inputs_, &near.seeds_}) {
        for (auto& [field, values] : *fields) nudge(values, by, random);
      }
      for (auto* scalars : {&near.params_, &near.sum_seeds_}) {
        for (auto& [name, value] : *scalars) nudge({&value, 1}, by, random);
      }
      nudge(near.direction_, by, random);
      const double phase = draw_one({1, 10}, random);
      const Products both = near.products(rounded(tangent_, phase), rounded(adjoint_, phase + 1));
      return TwoWays{both.forward, both.reverse};
    };
    return rounding_between(nudged, epsilon, most_roundings * epsilon * size);
  }

  double draw_one(const std::array<double, 2>& range, std::mt19937_64& random) {
    return std::uniform_real_distribution<double>(range[0], range[1])(random);
  }
  /// Draws the parameters of the program and of the custom adjoint, which may use spacing and time even if the program
  /// does not; parameters of the grid have their true values.
  void draw_params(const std::array<double, 2>& range, const Params& known, std::mt19937_64& random) {
    params_ = known;
    std::vector<std::string> names = interface_.params;
    const Interface given = interface_of(adjoint_.module, *adjoint_.module.find_program(adjoint_.program));
    names.insert(names.end(), given.params.begin(), given.params.end());
    for (const std::string& name : names) {
      if (!params_.contains(name)) params_[name] = draw_one(range, random);
    }
    params_["hx"] = box_.spacing[0];
    params_["hy"] = box_.spacing[1];
    params_["hz"] = box_.spacing[2];
    params_["cells"] = static_cast<double>(cells_of(box_.grid));
  }
  std::vector<double> draw(const std::array<double, 2>& range, std::mt19937_64& random) {
    std::vector<double> values(static_cast<std::size_t>(cells_of(box_.grid)));
    for (double& value : values) value = draw_one(range, random);
    return values;
  }

  State start(const Derivative& derivative) const {
    const Program& program = *derivative.module.find_program(derivative.program);
    int halo = 1;
    for (const auto& [field, widths] : required_halo(derivative.module, program))
      halo = std::max(halo, *std::max_element(widths.begin(), widths.end()));
    State state(box_.grid, halo);
    for (const auto& [field, values] : inputs_) state.set(field, values);
    for (int axis = 0; axis < box_.grid.rank; ++axis)
      state.set_coordinate(axis, program.axes[axis], box_.low[axis], box_.spacing[axis]);
    return state;
  }

  static void add(const std::vector<double>& a, const std::vector<double>& b, double& total, double& scale) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      total += a[i] * b[i];
      scale += std::abs(a[i] * b[i]);
    }
  }

  const Program& program_;
  const Interface interface_;
  const Derivative &tangent_, &adjoint_;
  const std::string input_;
  Box box_;
  std::map<std::string, std::vector<double>> inputs_, seeds_;
  std::vector<double> direction_;
  std::map<std::string, double> sum_seeds_;
  Params params_;
};

Activity by_input(const Kernel& kernel, const std::string& input) {
  const bool is_field = signature(kernel).find_read(input) != nullptr;
  return is_field ? Activity{{input}, {}} : Activity{{}, {input}};
}

/// The largest error and its box; NaN if no draw gave finite numbers, 0 if there is nothing to compare.
struct Found {
  double error = NAN;
  Box box;
  void note(const Products& products, const Box& at) {
    if (!std::isfinite(products.forward)) return;
    const double found = std::isfinite(products.reverse) ? products.error() : INFINITY;
    if (!(found <= error)) *this = {found, at};
  }
};

/// Compares the kernel's derivatives on such axes; false if it has none, which is reported when the program is
/// differentiated.
bool compare(const Kernel& kernel, const std::string& input, Reverse reverse, const std::vector<Topology>& axes,
             const std::function<void(Comparison&)>& on) {
  const Module module = lone_program(kernel, axes);
  DiagnosticSink silent;
  const Derivative tangent = adjoint::tangent(module, "p", by_input(kernel, input), silent);
  const Derivative adjoint = reverse(module, "p", by_input(kernel, input), silent);
  if (silent.has_errors()) return false;
  Comparison comparison(module, tangent, adjoint, input);
  on(comparison);
  return true;
}

/// Errors on one small grid, with periodic axes and with walls.
Found found_anywhere(const Kernel& kernel, const std::string& input, Reverse reverse) {
  Found found;
  std::mt19937_64 random(20240229);
  const Box box{grid_for(kernel), {}, {spacing, spacing, spacing}};
  for (const Topology topology : {Topology::periodic, Topology::bounded}) {
    const bool has_derivatives =
        compare(kernel, input, reverse, std::vector(static_cast<std::size_t>(kernel.rank), topology),
                [&](Comparison& comparison) {
                  for (const std::array<double, 2>& range : input_ranges)
                    found.note(comparison.products(box, range, {}, random), box);
                });
    if (!has_derivatives) return {0, {}};
  }
  return found;
}

/// Errors on boxes of the scene's grid. Half of the draws use the scene's parameters.
Found found_at_places(const Kernel& kernel, const std::string& input, Reverse reverse,
                      const std::vector<Topology>& axes, const Surroundings& surroundings) {
  Found found;
  std::mt19937_64 random(20240229);
  const std::vector<Box> boxes = boxes_of(kernel, surroundings, grid_for(kernel).cells, random);
  int cells = 1;
  for (const Box& box : boxes) cells += cells_of(box.grid);
  const int ranges = static_cast<int>(input_ranges.size()), wanted = std::clamp(most_in_boxes / cells, 1, ranges);
  int draw = 0;
  const bool has_derivatives = compare(kernel, input, reverse, axes, [&](Comparison& comparison) {
    for (const Box& box : boxes) {
      for (int tried = 0, done = 0; tried < 2 * ranges && done < wanted; ++tried, ++draw) {
        const Params known = draw % 2 == 0 ? surroundings.params : Params{};
        const Products products = comparison.products(box, input_ranges[draw / 2 % ranges], known, random);
        found.note(products, box);
        if (std::isfinite(products.forward)) ++done;
      }
    }
  });
  return has_derivatives ? found : Found{0, {}};
}

/// The formula that adjoint() would derive.
std::string derived_formula(Kernel kernel, const std::string& input, Reverse reverse) {
  kernel.custom_adjoints.clear();
  DiagnosticSink silent;
  const Derivative derived =
      reverse(lone_program(kernel, std::vector(static_cast<std::size_t>(kernel.rank), Topology::periodic)), "p",
              by_input(kernel, input), silent);
  for (const Kernel& found : derived.module.kernels) {
    if (!found.lets.empty() || derived.module.kernels.size() != 1) break;
    if (!found.stores.empty())
      return fmt::format("adjoint {} = {}", bar_of(input), print(found.stores[0].value, kernel.rank));
    if (!found.sums.empty())
      return fmt::format("adjoint {} += {}", bar_of(input), print(found.sums[0].value, kernel.rank));
  }
  return "";
}

/// Text of the range of cell centres: "x = 0.98 .. 1, y = 0 .. 0.1".
std::string place_of(const Box& box) {
  std::string place;
  for (int axis = 0; axis < box.grid.rank; ++axis) {
    const double first = box.low[axis] + 0.5 * box.spacing[axis],
                 last = first + (box.grid.cells[axis] - 1) * box.spacing[axis];
    place += fmt::format("{}{} = {:.4g} .. {:.4g}", axis == 0 ? "" : ", ", "xyz"[axis], first, last);
  }
  return place;
}

void report(const Kernel& kernel, const CustomAdjoint& given, const Found& found, bool at_places, Reverse reverse,
            DiagnosticSink& sink) {
  // The derived text would not show the offset of a sum's seed.
  const std::string formula = kernel.sums.empty() ? derived_formula(kernel, given.input, reverse) : "";
  const bool is_short = !formula.empty() && formula.size() <= longest_hint;
  sink.report("not-the-transpose", given.origin.range, {given.input, kernel.name, fmt::format("{:.1e}", found.error)},
              (is_short ? "derived it is " + formula : "leave the line out: what is not given is derived") +
                  (at_places ? "; seen at " + place_of(found.box) : ""));
}

}  // namespace

bool check_given(const Module& module, const Program& program, const Varied& varied, Reverse reverse,
                 const Surroundings& surroundings, DiagnosticSink& sink) {
  bool good = true;
  std::set<int> told;  // source positions of formulas: stages and passes have copies
  for (const Kernel* run : kernels_run(module, program)) {
    const Kernel& kernel = *run;
    const bool at_places = surroundings.axes.size() == program.axes.size() && names_coordinates(kernel);
    for (const CustomAdjoint& given : kernel.custom_adjoints) {
      if (!varied.fields.contains(given.input) && !varied.params.contains(given.input)) continue;
      if (told.contains(given.origin.range.begin)) continue;
      const Found found = at_places ? found_at_places(kernel, given.input, reverse, program.axes, surroundings)
                                    : found_anywhere(kernel, given.input, reverse);
      if (found.error <= largest_error) continue;
      report(kernel, given, found, at_places, reverse, sink);
      told.insert(given.origin.range.begin);
      good = false;
    }
  }
  return good;
}

}  // namespace dpde::adjoint
