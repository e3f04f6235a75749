// SPDX-License-Identifier: Apache-2.0
// Problems as text (stage `model`): in the words of the language, with numbers evaluated, operators written out over
// the axes, and dropped items as comments. For people only: it cannot be parsed again.
#pragma once

#include <string>

#include "model/model.h"

namespace dpde::model {

std::string print(const Problem& problem);
std::string print(const Expr& expr);
/// A formula or load(...).
std::string print(const Source& source);
/// In the syntax of a scheme block.
std::string print(const Transport& transport);
/// central(4), spectral
std::string print_order(int order);
std::string print(TimeScheme time);
/// cg(1e-12, 200, warn), without defaults.
std::string print(const SolveBy& by);
/// A scheme block with all its keys, on a line of its own.
std::string print(const Scheme& scheme);
/// F = sin(t) every 0.5, for time step `step`.
std::string print(const Control& control, double step);
/// kappa = 1 + x, with the interval of a control field.
std::string print(const Coefficient& coefficient, double step);
/// output u, v every 0.1, for time step `step`.
std::string print(const Output& output, double step);

}  // namespace dpde::model
