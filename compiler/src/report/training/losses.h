// SPDX-License-Identifier: Apache-2.0
// Losses of an optimisation or a training, as panels and tables.
#pragma once

#include <string>
#include <vector>

#include "plot/picture.h"
#include "training/tests/trials.h"

namespace dpde::report {

/// One point for each iteration.
plot::LinePanel loss_panel(const std::vector<double>& losses);
std::string loss_table(const std::vector<double>& losses);

/// Against the number of updates: batches, epochs and validation; for several trials only the loss that ranks them.
plot::LinePanel loss_panel(const training::Trials& trials);
/// By batch and by epoch, for all trials; for a single trial without its number.
std::string loss_table(const training::Trials& trials);
std::string epoch_table(const training::Trials& trials);

}  // namespace dpde::report
