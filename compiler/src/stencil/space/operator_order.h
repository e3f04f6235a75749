// SPDX-License-Identifier: Apache-2.0
// Measures the order of accuracy of an operator of the file: its differences, applied to smooth fields, are expanded as
// a series in the cell width. The limit of the series is the approximated expression, and the first power after it is
// the order. All fields that it reads are assumed smooth and generic: limiters and upwinding have their order away from
// kinks.
#pragma once

#include <string>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::stencil {

struct MeasuredOrder {
  /// none: the result grows as h^-order as h decreases. exact: no power was found. unknown: not measured.
  enum class Kind { found, none, exact, unknown } kind = Kind::unknown;
  int order = 0;
  std::string why;  // the reason, if unknown
};

MeasuredOrder measure_order(const model::Problem& problem, const model::StatedOrder& stated);

/// Reports operators of lower order than stated as errors, and of higher order as warnings. False after an error.
bool check_stated_orders(const model::Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::stencil
