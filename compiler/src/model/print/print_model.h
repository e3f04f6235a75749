// SPDX-License-Identifier: Apache-2.0
// Problems as text (stage `model`): the words of the language, with numbers evaluated, operators spelled out over the
// axes, and what was dropped as comments. For people: it is not read back.
#pragma once

#include <string>

#include "model/model.h"

namespace dpde::model {

std::string print(const Problem& problem);
std::string print(const Expr& expr);
/// A formula or load(...).
std::string print(const Source& source);
/// As a scheme block has it.
std::string print(const Transport& transport);
/// central(4), spectral
std::string print_order(int order);
std::string print(TimeScheme time);
/// cg(1e-12, 200, warn), without what is not said otherwise.
std::string print(const SolveBy& by);
/// A scheme block with all its keys, on a line of its own.
std::string print(const Scheme& scheme);
/// F = sin(t) every 0.5, where a step takes `step`.
std::string print(const Control& control, double step);
/// kappa = 1 + x, with the interval of a control field.
std::string print(const Coefficient& coefficient, double step);
/// output u, v every 0.1, where a step takes `step`.
std::string print(const Output& output, double step);

}  // namespace dpde::model
