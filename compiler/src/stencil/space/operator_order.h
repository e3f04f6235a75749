// SPDX-License-Identifier: Apache-2.0
// The order of an operator of the file, measured: what its differences give of smooth fields, as a series in the cell
// width. The limit of the series is what the operator approximates, and the first power behind it is the order. Fields
// that it reads are taken as smooth, and as some in general: limiters and upwinding have the order that they have away
// from kinks.
#pragma once

#include <string>

#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::stencil {

struct MeasuredOrder {
  /// none: what it gives grows as h^-order when cells become smaller. exact: no power was found. unknown: not measured.
  enum class Kind { found, none, exact, unknown } kind = Kind::unknown;
  int order = 0;
  std::string why;  // of what is unknown
};

MeasuredOrder measure_order(const model::Problem& problem, const model::StatedOrder& stated);

/// Reports operators that have a lower order than is stated, and warns of those with a higher one. False after an
/// error.
bool check_stated_orders(const model::Problem& problem, DiagnosticSink& sink);

}  // namespace dpde::stencil
