// SPDX-License-Identifier: Apache-2.0
// Units of functions and operators, for the table of built_ins.cpp. Each rule takes a call without errors.
#pragma once

#include "model/from_ast/formulas/measures.h"

namespace dpde::model::unit_rules {

using Rule = MeasureList(Measures& measures, const ast::Call& e, SourceRange range);

Rule along_axis;        // dx(f): unit of f over that of the coordinate
Rule along_named_axis;  // d(f, x, n)
Rule laplacian, gradient, divergence, advection, curl, poisson_bracket;
Rule integral;   // over space, some axes, a wall, or between two limits
Rule reduction;  // mean, sum and norm: unit of the operand
Rule extreme;    // max and min, of two numbers or over space
Rule sample;     // unit of the operand; the position has those of the coordinates
Rule inject;     // over a volume
Rule force, torque;
Rule angle;    // atan2(y, x): a pure number, of two numbers with one unit
Rule choice;   // if(c, a, b): unit of both
Rule operand;  // abs, interpolate, ...: unit of the first argument
Rule square_root, sign, pure_number;
Rule product_of_components;  // dot, inner
Rule product_of_lists;       // outer, cross
Rule trace;                  // sum of components with equal units
Rule turned;                 // sym, transpose
Rule rate;                   // dt(u)
Rule number;                 // noise and random fields: a number of any unit

}  // namespace dpde::model::unit_rules
