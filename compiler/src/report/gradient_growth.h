// SPDX-License-Identifier: Apache-2.0
// Report of the growth of an adjoint in the reverse sweep.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/run/gradient_growth.h"
#include "driver/scene/inverse.h"
#include "source/diagnostic.h"
#include "support/json.h"

namespace dpde::report {

/// For the gradient of the task at `x`, with the samples of its adjoint; nullopt if nothing is known.
std::optional<analysis::GradientGrowth> gradient_growth(driver::Session& session, driver::Inverse& inverse,
                                                        const std::vector<analysis::AdjointWatch::Look>& looks,
                                                        const Eigen::VectorXd& x, const Eigen::VectorXd& gradient);
/// null if nothing is known.
Json json_of(const std::optional<analysis::GradientGrowth>& growth);
/// Warns if the gradient is inaccurate, with the reason.
void warn_of_growth(const model::Problem& problem, const std::optional<analysis::GradientGrowth>& growth,
                    DiagnosticSink& sink);

/// For a gradient that is not finite: says that its adjoint has overflowed; "" if it has not, or if the run itself
/// blows up. Changes the session's run.
std::string help_for_growth(driver::Session& session, const std::vector<analysis::AdjointWatch::Look>& looks);

}  // namespace dpde::report
