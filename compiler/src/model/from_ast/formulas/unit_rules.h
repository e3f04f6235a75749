// SPDX-License-Identifier: Apache-2.0
// Units of what functions and operators make, for the table of built_ins.cpp. Each takes a call that has been
// elaborated without an error.
#pragma once

#include "model/from_ast/formulas/measures.h"

namespace dpde::model::unit_rules {

using Rule = MeasureList(Measures& measures, const ast::Call& e, SourceRange range);

Rule along_axis;        // dx(f): that of f over the coordinate's
Rule along_named_axis;  // d(f, x, n)
Rule laplacian, gradient, divergence, advection, curl, poisson_bracket;
Rule integral;   // over space, some axes, a wall, or between two ends
Rule reduction;  // mean and sum: that of the operand
Rule extreme;    // max and min, of two numbers or over space
Rule sample;     // that of the operand; its place has those of the coordinates
Rule inject;     // over a volume
Rule force, torque;
Rule choice;   // if(c, a, b): that of both
Rule operand;  // abs, interpolate, ...: that of the first argument
Rule norm, square_root, sign, pure_number;
Rule product_of_components;  // dot, inner
Rule product_of_lists;       // outer, cross
Rule trace;                  // the sum of components that are alike
Rule turned;                 // sym, transpose
Rule rate;                   // dt(u)
Rule number;                 // noise and random fields: a number of any unit
Rule unknown;                // load

}  // namespace dpde::model::unit_rules
