// SPDX-License-Identifier: Apache-2.0
// Variants of a chart: methods times cells times steps.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chart/point.h"

namespace dpde::chart {

/// The user's choices; empty ones are chosen automatically.
struct Wishes {
  std::map<std::string, std::vector<std::string>> method;  // by scheme key: real, advect, time ...; scheme: of blocks
  std::vector<int> cells;                                  // along every axis
  std::vector<double> steps;
  /// Replaces steps: fractions of the largest stable step; if there is none, of the scene's step, scaled with the cell
  /// width.
  std::vector<double> fractions;
};

/// Methods suited to the scene's equations, if none are requested: its own; central differences of order 2 and 4, with
/// ssp_rk3 (leapfrog for second-order equations) and rk4; for advection also upwind differences of order 3 and 5, and
/// weno and muscl for solutions that are not smooth. At most eight, without duplicates.
std::vector<std::map<std::string, std::string>> methods_for(const model::Problem& problem, const Wishes& wishes);

/// Each method with each step, on these cells (keys of --set). Tolerances of solves, as in solve=cg(1e-4), count as
/// resolution like cells and steps: the method is solve=cg.
std::vector<Entry> entries_on(const model::Problem& problem, const Wishes& wishes,
                              const std::map<std::string, std::string>& cells);
/// On all cells; by default 1/4, 1/2, 1 and 2 times the scene's.
std::vector<Entry> entries_of(const model::Problem& problem, const Wishes& wishes);

/// The spatial discretisation: "upwind(3)", "central(4)"; for a hand-written program its name, without derivatives the
/// time scheme.
std::string kind_of_method(const model::Problem& problem);

/// Settings for `factor` times the scene's cells along each axis, for --set; {} for a scene without a grid.
std::map<std::string, std::string> cells_of(const model::Problem& problem, double factor);
/// With `factor` times the cells; without a grid, with steps shorter by the factor.
Entry refined(const model::Problem& problem, const std::map<std::string, std::string>& method, double fraction,
              double factor);
/// Largest number of cells of an entry along an axis, relative to the scene's; at least 1.
double finest_of(const model::Problem& scene, const std::vector<Entry>& entries);

/// The scene's solves with the tolerance of a reference: {} if theirs is as small.
std::map<std::string, std::string> exact_solves(const model::Scheme& scheme);
/// Central differences of order 6, rk4, double precision, and solves with the smallest tolerance.
std::map<std::string, std::string> most_accurate(const model::Problem& problem);

}  // namespace dpde::chart
