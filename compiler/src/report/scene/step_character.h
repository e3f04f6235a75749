// SPDX-License-Identifier: Apache-2.0
// Report of a step's properties other than stability: cell numbers, positivity, damping and delay of waves.
#pragma once

#include <string>
#include <vector>

#include "driver/scene/session.h"
#include "source/diagnostic.h"
#include "stability/report/local_character.h"
#include "support/json.h"

namespace dpde::report {

struct StepCharacter {
  std::vector<stability::CellNumber> cells;
  stability::Positivity positivity;
};
StepCharacter character_of(driver::Session& session, double step);

/// The keys monotone and cell_numbers.
Json json_of(const driver::Session& session, const StepCharacter& character);
std::string text_of(const driver::Session& session, const StepCharacter& character);
/// Warns if central differences oscillate.
void warn_of_cell_numbers(const driver::Session& session, const StepCharacter& character, DiagnosticSink& sink);

/// One row for each wave; `step` is the scene's step.
Json json_of(const driver::Session& session, const std::vector<stability::Wave>& waves, double step);
std::string text_of(const driver::Session& session, const std::vector<stability::Wave>& waves, double step);

}  // namespace dpde::report
