// SPDX-License-Identifier: Apache-2.0
// Advice for a solve without a solution. Methods are suggested only if they solve the present system: they are tried.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "solve/solver/linear_solver.h"

namespace dpde {

constexpr std::int64_t most_cells_tried = 100'000;  // on more cells trying methods takes long

/// `failed`: the report of the method of `options`. "" on more cells than that.
std::string advice_on(const std::shared_ptr<const GridOperator>& a, const SolveOptions& options,
                      std::span<const double> right, const SolveReport& failed);

}  // namespace dpde
