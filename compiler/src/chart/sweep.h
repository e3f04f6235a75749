// SPDX-License-Identifier: Apache-2.0
// Which variants a chart runs: methods times cells times steps.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chart/point.h"

namespace dpde::chart {

/// What a person asked for; what is empty is chosen.
struct Wishes {
  std::map<std::string, std::vector<std::string>> method;  // by scheme key: real, advect, time ...; scheme: of blocks
  std::vector<int> cells;                                  // along every axis
  std::vector<double> steps;
  /// In place of steps: parts of the largest stable one; where there is none, of the scene's step, which shrinks with
  /// the cells.
  std::vector<double> fractions;
};

/// Methods that suit the scene's equations where none are asked for: its own, and central differences of order 2 and 4,
/// with ssp_rk3 (leapfrog for equations of second order) and rk4; where something is advected also upwind differences
/// of order 3 and 5, and weno and muscl for what is not smooth. Eight at most, none twice.
std::vector<std::map<std::string, std::string>> methods_for(const model::Problem& problem, const Wishes& wishes);

/// Each of the methods with each of the steps, on these cells (keys of --set). Tolerances of solves, as of
/// solve=cg(1e-4), are resolutions as cells and steps are: the method is solve=cg.
std::vector<Entry> entries_on(const model::Problem& problem, const Wishes& wishes,
                              const std::map<std::string, std::string>& cells);
/// On all cells: the scene's times 1/4, 1/2, 1 and 2 where none are asked for.
std::vector<Entry> entries_of(const model::Problem& problem, const Wishes& wishes);

/// How the problem takes derivatives in space: "upwind(3)", "central(4)"; of a program by hand its name, of what has no
/// derivatives the time scheme.
std::string kind_of_method(const model::Problem& problem);

/// So many times the scene's cells along each axis, as --set has them; {} of a scene without a grid.
std::map<std::string, std::string> cells_of(const model::Problem& problem, double factor);
/// On so many times the cells; without a grid by steps shorter by the factor.
Entry refined(const model::Problem& problem, const std::map<std::string, std::string>& method, double fraction,
              double factor);
/// The most cells of an entry along an axis, in units of the scene's; 1 at least.
double finest_of(const model::Problem& scene, const std::vector<Entry>& entries);

/// The scene's solves, to the tolerance of a reference: {} where theirs is as small.
std::map<std::string, std::string> exact_solves(const model::Scheme& scheme);
/// Central differences of order 6 and rk4, in double precision, and solves to the smallest tolerance.
std::map<std::string, std::string> most_accurate(const model::Problem& problem);

}  // namespace dpde::chart
