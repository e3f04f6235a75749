// SPDX-License-Identifier: Apache-2.0
// Prints parts of lines, and items of models.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "syntax/ast.h"

namespace dpde::ast {

std::string print_names(const std::vector<Identifier>& names);
/// u, v in m/s, h in m
std::string print_names(const std::vector<Identifier>& names, const std::vector<UnitText>& units);
std::string print_list(const std::vector<Expr>& values);
/// " at t = 1, 2", ", mean over time", or empty.
std::string print_when(const When& when);
/// " on faces", or empty.
std::string print_placement(const std::optional<Identifier>& on);
/// u, omega = curl(u), w on centres = curl(u)
std::string print_formulas(const std::vector<NamedFormula>& formulas);
/// " in m/s", or empty.
std::string print_unit(const UnitText& unit);

std::string print_field(const FieldItem& item);
std::string print_coefficient(const CoefficientItem& item);
std::string print_params(const ParamItem& item);
std::string print_solved(const SolvedItem& item);
std::string print_constraint(const ConstraintItem& item);
/// Text before the block of a program's solve.
std::string print_solve_head(const SolveItem& item);
std::string print_held(const HeldItem& item);
std::string print_accuracy(const AccuracyItem& item);

}  // namespace dpde::ast
