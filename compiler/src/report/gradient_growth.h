// SPDX-License-Identifier: Apache-2.0
// What is said of the growth of a gradient on its way back.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/run/gradient_growth.h"
#include "driver/scene/inverse.h"
#include "source/diagnostic.h"
#include "support/json.h"

namespace dpde::report {

/// Of the gradient of the task at `x`, whose run the looks are of; nullopt where nothing is known of it.
std::optional<analysis::GradientGrowth> gradient_growth(driver::Session& session, driver::Inverse& inverse,
                                                        const std::vector<analysis::AdjointWatch::Look>& looks,
                                                        const Eigen::VectorXd& x, const Eigen::VectorXd& gradient);
/// null where nothing is known.
Json json_of(const std::optional<analysis::GradientGrowth>& growth);
/// Where the gradient has lost its digits, and why.
void warn_of_growth(const model::Problem& problem, const std::optional<analysis::GradientGrowth>& growth,
                    DiagnosticSink& sink);

/// For a gradient that is not finite: that its adjoint has grown beyond all numbers; "" where it has not, and where it
/// is the run that leaves all bounds. The session's run is another one afterwards.
std::string help_for_growth(driver::Session& session, const std::vector<analysis::AdjointWatch::Look>& looks);

}  // namespace dpde::report
