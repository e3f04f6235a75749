// SPDX-License-Identifier: Apache-2.0
// A trained network on a chart: its error on data that it has not seen against the seconds of a unit of time, beside
// plain methods; and what it costs with data and training, beside the plain method of the same error.
#pragma once

#include "train.h"

namespace dpde::tools {

/// `results` are those of the tests of `scenes`. The picture and table TEST_chart, and the keys points and best_plain.
void write_training_chart(Job& job, const training::TestScenes& scenes, const TestResults& results, Json& json);

}  // namespace dpde::tools
