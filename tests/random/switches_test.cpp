// SPDX-License-Identifier: Apache-2.0
// Random models with switches: a gradient is given only where differences of the loss come to it, kinks aside, and none
// is refused whose branches meet. DPDE_SWITCH_MODELS: how many (20; 2000 where tests are thorough); DPDE_RANDOM_SEED:
// the first of their seeds (1).
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>

#include "analysis/certificate/certificate.h"
#include "analysis/generic_point.h"
#include "driver/scene/inverse.h"
#include "random/random_switches.h"
#include "source/render.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Differences of the loss beside a random point.
struct Differences {
  bool are_known = false, agree_elsewhere = false, jump = false;
};

Differences differences_of(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                           std::uint64_t seed) {
  DiagnosticSink sink;
  Differences result;
  const auto session = driver::Session::open(source, compiled, {}, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  EXPECT_TRUE(inverse) << source.text();
  if (!inverse) return result;
  std::mt19937_64 random(seed);
  const analysis::Point point = analysis::generic_point(*session, *inverse, random);
  Eigen::VectorXd gradient(inverse->size());
  if (!std::isfinite(inverse->value_and_gradient(point.x, gradient)) || !gradient.allFinite()) return result;
  const analysis::Line loss = [&](double step) { return inverse->value(point.x + step * point.direction); };
  const double slope = gradient.dot(point.direction), rounding = analysis::rounding_of(loss, 0x1p-40, 0x1p-52);
  std::vector<double> steps;
  for (int k = 0; k < 16; ++k) steps.push_back(2e-2 * std::exp2(-k));
  result.are_known = true;
  result.agree_elsewhere =
      analysis::judge(analysis::quotients_of(loss, steps, rounding), {slope, 1e-11 * std::abs(slope)}).is_elsewhere;
  result.jump = analysis::jump_beside(loss, slope, steps, rounding).has_value();
  return result;
}

/// Whether the loss jumps ahead of a certificate's point, within its reach, so that it differs there from what the
/// derivative says by more than a thousandth, and the jump alone by about as much: kinks are the rest of it.
bool jumps_ahead(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                 const analysis::Point& point) {
  constexpr double reach = 1e-2, rounding = 1e-9;  // of its largest remainder; of the loss, more than there is
  DiagnosticSink sink;
  const auto session = driver::Session::open(source, compiled, {}, sink);
  const auto inverse = session ? driver::Inverse::open(*session, source, sink) : nullptr;
  EXPECT_TRUE(inverse) << source.text();
  Eigen::VectorXd gradient(point.x.size());
  if (!inverse || !std::isfinite(inverse->value_and_gradient(point.x, gradient))) return false;
  inverse->hold_steps(true);
  const auto loss = [&](double step) { return inverse->value(point.x + step * point.direction); };
  const double here = loss(0), change = reach * gradient.dot(point.direction), found = loss(reach) - here;
  const double rest = std::abs(found - change), least = rounding * (std::abs(here) + std::abs(change) / reach);
  if (!(rest > least && rest > 1e-3 * std::max(std::abs(change), std::abs(found)))) return false;
  const analysis::Line ahead = [&](double step) { return loss(reach / 2 + step); };
  const auto jump = analysis::jump_within(ahead, reach / 2, analysis::rounding_of(loss, 0x1p-40, 0x1p-52));
  return jump && jump->size > 0.5 * rest && jump->size < 1.5 * rest;
}

std::shared_ptr<const driver::Compiled> compile(const SourceFile& source, bool takes_jumps, driver::Backend backend,
                                                DiagnosticSink& sink) {
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = backend;
  options.adjoint = true;
  options.tangent = backend == driver::Backend::jit;
  options.takes_jumps = takes_jumps;
  std::optional<driver::Compiled> result = driver::compile(source, options, sink);
  return result ? std::make_shared<const driver::Compiled>(std::move(*result)) : nullptr;
}

std::string error_of(const DiagnosticSink& sink) {
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity == Severity::error) return std::string(d.kind->code);
  }
  return "";
}

class RandomSwitches : public ::testing::Test {
 protected:
  std::map<std::string, int> total_;

  /// What is taken: differences come to its gradient, and do not jump.
  void expect_right(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled,
                    std::uint64_t seed) {
    const Differences found = differences_of(source, compiled, seed);
    EXPECT_FALSE(found.agree_elsewhere) << "seed " << seed << ": the gradient is wrong\n" << source.text();
    // Of a switch that the run looks at a jump may lie ahead: the gradient is refused where it acts at the point
    // itself, which WatchedSwitches and WatchedRuns hold against secants.
    const bool is_ahead = found.jump && !compiled->watched.empty();
    EXPECT_FALSE(found.jump && !is_ahead) << "seed " << seed << ": a gradient is given of what jumps\n"
                                          << source.text();
    ++total_[is_ahead ? "taken, with a jump beside" : found.are_known ? "taken" : "not finite"];
  }

  /// What is refused for its jumps, taken by force: where differences show one at the certificate's own point, it does
  /// not pass.
  void expect_not_certified(const SourceFile& source, std::uint64_t seed) {
    DiagnosticSink sink;
    const auto forced = compile(source, true, driver::Backend::jit, sink);
    ASSERT_TRUE(forced) << source.text();
    const auto certificate = analysis::certify(source, forced, {.seed = seed}, sink);
    ASSERT_TRUE(certificate) << source.text();
    const bool is_certified = certificate->passed();
    ++total_[is_certified ? "by force: certified" : certificate->jump ? "by force: shown" : "by force: not certified"];
    EXPECT_FALSE(is_certified && jumps_ahead(source, forced, certificate->point))
        << "seed " << seed << " is certified and jumps\n"
        << source.text();
  }
};

TEST_F(RandomSwitches, NoGradientIsGivenOfWhatJumps) {
  const std::uint64_t first = setting("DPDE_RANDOM_SEED", 1);
  const std::uint64_t count = setting("DPDE_SWITCH_MODELS", is_thorough() ? 2000 : 20);
  for (std::uint64_t seed = first; seed < first + count && !HasFatalFailure(); ++seed) {
    const SwitchModel model = random_switches(seed);
    const SourceFile source("switches.dpde", model.text);
    DiagnosticSink sink;
    const auto compiled = compile(source, false, driver::Backend::interpreter, sink);
    const std::string code = error_of(sink);
    if (compiled) {
      expect_right(source, compiled, seed);
      if (model.may_jump) ++total_["taken, though branches do not meet"];
      continue;
    }
    ++total_[code];
    const bool is_right = (code == "E0607" && model.may_only_switch) || (code == "E0609" && model.may_jump);
    EXPECT_TRUE(is_right) << "seed " << seed << ": refused by " << code << "\n"
                          << render_text(source, sink.all()[0]) << model.text;
    if (code == "E0609" && seed % 10 == 0) expect_not_certified(source, seed);
  }
  for (const auto& [what, times] : total_) std::cout << what << ": " << times << ", ";
  std::cout << "\n";
}

}  // namespace
}  // namespace dpde::testing
