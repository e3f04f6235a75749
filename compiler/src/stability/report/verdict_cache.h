// SPDX-License-Identifier: Apache-2.0
// Verdicts that took long are kept by what they are of: the text of the problem and of its step, its numbers, and the
// values of its fields as the run begins. The cache adds the version of dpde.
#pragma once

#include "stability/stability_report.h"

namespace dpde::stability {

/// What verdict_of() and grows_nothing() do where nothing is kept.
StabilityReport examine(driver::Session& session, const Look& look = {});
bool look_for_growth(driver::Session& session, const Look& look = {});
/// The same of a group whose step has networks; no limit is looked for above `most`.
void examine_networks(driver::Session& session, const StateGroup& group, double most, StabilityReport& verdict);
bool networks_grow_nothing(driver::Session& session, const StateGroup& group);

/// The numbers and fields of a scene as its run begins.
std::string key_of_fields(driver::Session& session);
/// What a verdict is kept by.
std::string key_of(driver::Session& session);

/// As text, and back; nullopt of what is no such text.
std::string text_of(const StabilityReport& verdict);
std::optional<StabilityReport> verdict_from(const std::string& text);

}  // namespace dpde::stability
