// SPDX-License-Identifier: Apache-2.0
#include "chart/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/build.h"
#include "model/from_ast.h"
#include "model/print/print_model.h"
#include "model/uses.h"

namespace dpde::chart {

namespace {

using Method = std::map<std::string, std::string>;
constexpr double factors[] = {0.25, 0.5, 1, 2};
constexpr double chosen_fractions[] = {0.9, 0.45};
constexpr int fewest_cells = 8;

struct Uses {
  bool advect = false, first = false, second = false;
  bool dealias = false;  // only for waves: it would remove waves that differences resolve
};

Uses uses_of(const model::Problem& problem) {
  Uses uses;
  uses.dealias = problem.scheme.dealias;
  model::for_each_formula(problem, [&](const model::Use& use) {
    if (!model::makes_state(use.kind)) return;  // methods are judged by states
    any_part(use.formula, [&](const model::Expr& e) {
      if (is<model::Advect>(e)) uses.advect = true;
      if (const auto* d = as<model::Derivative>(e)) (d->order % 2 == 0 ? uses.second : uses.first) = true;
      return false;
    });
  });
  return uses;
}

/// Whether all derivatives are by Fourier series.
bool is_of_waves(const Uses& uses, const model::Scheme& scheme) {
  const bool is_used = uses.advect || uses.first || uses.second;
  return is_used && (!uses.advect || model::is_spectral(scheme.transport)) &&
         (!uses.first || scheme.derivative_order == model::spectral) &&
         (!uses.second || scheme.laplacian_order == model::spectral);
}

Method central(const Uses& uses, const std::string& order) {
  Method method;
  if (uses.advect) method["advect"] = "central" + order;
  if (uses.first) method["dx"] = "central" + order;
  if (uses.second) method["lap"] = "central" + order;
  if (uses.dealias) method["dealias"] = "none";
  return method;
}

/// Central differences of order 4, except advection.
Method upwind(const Uses& uses, const std::string& advect) {
  Method method = central(uses, "4");
  method["advect"] = advect;
  return method;
}

void add_new(std::vector<Method>& methods, const Method& method, const model::Scheme& own) {
  const auto is_same = [&](const Method& known) {
    return model::with_settings(own, known) == model::with_settings(own, method);
  };
  if (std::ranges::none_of(methods, is_same)) methods.push_back(method);
}

}  // namespace

std::string kind_of_method(const model::Problem& problem) {
  if (!problem.program.empty()) return "program " + problem.program;
  const Uses uses = uses_of(problem);
  const model::Scheme& scheme = problem.scheme;
  if (uses.advect) {
    std::string text = model::print(scheme.transport);
    for (const auto& [state, own] : scheme.transports) text += fmt::format(", {} of {}", model::print(own), state);
    return text;
  }
  if (uses.first) return model::print_order(scheme.derivative_order);
  return uses.second ? model::print_order(scheme.laplacian_order) : model::print(scheme.time);
}

std::map<std::string, std::string> cells_of(const model::Problem& problem, double factor) {
  Method cells;
  if (!problem.has_grid) return cells;
  for (const model::Axis& axis : problem.axes)
    cells["cells." + axis.name] = fmt::format("{}", std::max(1L, std::lround(axis.cells * factor)));
  return cells;
}

Entry refined(const model::Problem& problem, const Method& method, double fraction, double factor) {
  return {{method, cells_of(problem, factor)}, problem.has_grid ? fraction : fraction / factor};
}

std::vector<Method> methods_for(const model::Problem& problem, const Wishes& wishes) {
  std::vector<Method> methods;
  if (!wishes.method.empty()) {
    methods.push_back({});
    for (const auto& [key, values] : wishes.method) {
      std::vector<Method> next;
      for (const Method& method : methods) {
        for (const std::string& value : values) {
          next.push_back(method);
          next.back()[key] = value;
        }
      }
      methods = std::move(next);
    }
    return methods;
  }
  methods.push_back({});
  if (!problem.program.empty()) return methods;
  const Uses uses = uses_of(problem);
  const bool is_second_order =
      std::ranges::any_of(problem.states, [](const auto& s) { return !s.velocity_of.empty(); });
  const auto add = [&](Method method, const std::string& time) {
    method["time"] = time;
    add_new(methods, method, problem.scheme);
  };
  const std::string cheap = is_second_order ? "leapfrog" : "ssp_rk3";
  if (!uses.advect) add(central(uses, "2"), cheap);
  add(central(uses, "2"), "rk4");
  add(central(uses, "4"), cheap);
  add(central(uses, "4"), "rk4");
  if (!uses.advect) return methods;
  const std::string damped = is_second_order ? "rk4" : "ssp_rk3";  // leapfrog amplifies damped modes
  add(upwind(uses, "upwind3"), damped);
  add(upwind(uses, "upwind5"), "rk4");
  add(upwind(uses, "weno5"), damped);
  add(upwind(uses, "muscl_van_leer"), damped);
  return methods;
}

namespace {

Entry entry_of(const Method& method, const Method& resolution, double fraction) {
  Entry entry{{method, resolution}, fraction};
  const auto solve = entry.variant.method.find("solve");
  if (solve == entry.variant.method.end() || solve->second.find('(') == std::string::npos) return entry;
  entry.variant.resolution["solve"] = solve->second;
  solve->second.resize(solve->second.find('('));
  return entry;
}

void add_entries(const Method& method, const Wishes& wishes, const Method& cells, std::vector<Entry>& entries) {
  std::vector<double> fractions = wishes.fractions;
  if (fractions.empty()) fractions.assign(std::begin(chosen_fractions), std::end(chosen_fractions));
  for (std::size_t f = 0; wishes.steps.empty() && f < fractions.size(); ++f)
    entries.push_back(entry_of(method, cells, fractions[f]));
  for (const double step : wishes.steps) {
    entries.push_back(entry_of(method, cells, 0));
    entries.back().variant.resolution["step"] = fmt::format("{}", step);
  }
}

}  // namespace

std::vector<Entry> entries_on(const model::Problem& problem, const Wishes& wishes, const Method& cells) {
  std::vector<Entry> entries;
  for (const Method& method : methods_for(problem, wishes)) add_entries(method, wishes, cells, entries);
  return entries;
}

std::vector<Entry> entries_of(const model::Problem& problem, const Wishes& wishes) {
  std::vector<Method> cells;
  for (const int count : wishes.cells) cells.push_back({{"cells", fmt::format("{}", count)}});
  if (!problem.has_grid && cells.empty()) cells.push_back({});
  for (const double factor : factors) {
    if (!problem.has_grid) break;
    const bool is_coarse = std::ranges::any_of(
        problem.axes, [&](const model::Axis& axis) { return axis.cells * factor < fewest_cells && factor < 1; });
    if (wishes.cells.empty() && !is_coarse) cells.push_back(cells_of(problem, factor));
  }
  std::vector<Entry> entries;
  for (const Method& method : methods_for(problem, wishes)) {
    for (const Method& count : cells) add_entries(method, wishes, count, entries);
  }
  return entries;
}

double finest_of(const model::Problem& scene, const std::vector<Entry>& entries) {
  double most = 1;
  for (const Entry& entry : entries) {
    for (const model::Axis& axis : scene.axes) {
      const auto own = entry.variant.resolution.find("cells." + axis.name),
                 all = entry.variant.resolution.find("cells");
      const auto& found = own != entry.variant.resolution.end() ? own : all;
      if (found != entry.variant.resolution.end()) most = std::max(most, std::stod(found->second) / axis.cells);
    }
  }
  return most;
}

Method exact_solves(const model::Scheme& scheme) {
  SolveBy by = scheme.solve;
  by.tolerance = std::min(by.tolerance, SolveBy{}.tolerance);
  by.most_iterations = std::max(by.most_iterations, SolveBy{}.most_iterations);
  by.warns = false;
  return scheme.solve == by ? Method{} : Method{{"solve", model::print(by)}};
}

/// Keeps Fourier series if the scene uses them: no difference resolves as much.
Method most_accurate(const model::Problem& problem) {
  const Uses uses = uses_of(problem);
  Method method = is_of_waves(uses, problem.scheme) ? Method{} : central(uses, "6");
  method["time"] = model::is_exponential(problem.scheme.time) && method.empty() ? "etdrk4" : "rk4";
  method["real"] = "f64";
  method.merge(exact_solves(problem.scheme));
  return method;
}

}  // namespace dpde::chart
