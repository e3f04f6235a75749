// SPDX-License-Identifier: Apache-2.0
// Random models with switches: a gradient is given only where differences of the loss come to it, kinks aside, and none
// is refused whose branches meet. DPDE_SWITCH_MODELS: how many (20; 2000 where tests are thorough); DPDE_RANDOM_SEED:
// the first of their seeds (1).
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <map>

#include "analysis/certificate.h"
#include "analysis/generic_point.h"
#include "driver/inverse.h"
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
    EXPECT_FALSE(found.jump) << "seed " << seed << ": a gradient is given of what jumps\n" << source.text();
    ++total_[found.are_known ? "taken" : "not finite"];
  }

  /// What is refused for its jumps, taken by force: where the certificate's own table shows one, it does not pass.
  void expect_not_certified(const SourceFile& source, std::uint64_t seed) {
    DiagnosticSink sink;
    const auto forced = compile(source, true, driver::Backend::jit, sink);
    ASSERT_TRUE(forced) << source.text();
    const auto certificate = analysis::certify(source, forced, {.seed = seed}, sink);
    ASSERT_TRUE(certificate) << source.text();
    const bool shown = certificate->jump.has_value();
    ++total_[shown ? "by force: shown" : certificate->passed() ? "by force: nothing near" : "by force: not certified"];
    EXPECT_FALSE(shown && certificate->passed());
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
