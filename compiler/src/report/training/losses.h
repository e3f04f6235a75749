// SPDX-License-Identifier: Apache-2.0
// Losses of an optimisation and of a training, as panels and tables.
#pragma once

#include <string>
#include <vector>

#include "plot/picture.h"
#include "training/tests/trials.h"

namespace dpde::report {

/// Of each iteration.
plot::LinePanel loss_panel(const std::vector<double>& losses);
std::string loss_table(const std::vector<double>& losses);

/// Against the number of updates: batches, epochs and validation; of several trials what they are judged by.
plot::LinePanel loss_panel(const training::Trials& trials);
/// Of each batch and of each epoch, of all trials; of one alone without its number.
std::string loss_table(const training::Trials& trials);
std::string epoch_table(const training::Trials& trials);

}  // namespace dpde::report
