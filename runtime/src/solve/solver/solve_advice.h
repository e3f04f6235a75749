// SPDX-License-Identifier: Apache-2.0
// What to write where a solve has found nothing. Methods are advised only where they solve the system at hand: they are
// tried.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "solve/solver/linear_solver.h"

namespace dpde {

constexpr std::int64_t most_cells_tried = 100'000;  // on more, trying methods takes long

/// `failed`: what the method of `options` has met. "" on more cells than methods are tried on.
std::string advice_on(const std::shared_ptr<const GridOperator>& a, const SolveOptions& options,
                      std::span<const double> right, const SolveReport& failed);

}  // namespace dpde
