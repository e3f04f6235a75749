// SPDX-License-Identifier: Apache-2.0
// Verdicts that took long are cached. The key is the text of the problem and of its step, its parameters, and the
// initial values of its fields; the cache adds the version of dpde.
#pragma once

#include "stability/stability_report.h"

namespace dpde::stability {

/// verdict_of() and grows_nothing() without the cache.
StabilityReport examine(driver::Session& session, const Look& look = {});
bool look_for_growth(driver::Session& session, const Look& look = {});
/// The same for a group whose step has networks; no limit is searched for above `most`.
void examine_networks(driver::Session& session, const StateGroup& group, double most, StabilityReport& verdict);
bool networks_grow_nothing(driver::Session& session, const StateGroup& group);

/// A key of the parameters and initial fields of a scene.
std::string key_of_fields(driver::Session& session);
/// The key of a verdict.
std::string key_of(driver::Session& session);

/// A verdict as text, and back; nullopt if the text is not a verdict.
std::string text_of(const StabilityReport& verdict);
std::optional<StabilityReport> verdict_from(const std::string& text);

}  // namespace dpde::stability
