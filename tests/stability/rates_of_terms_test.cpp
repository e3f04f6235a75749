// SPDX-License-Identifier: Apache-2.0
// The share of each term of coupled equations in the limit. For nearly every term one check of all contributions shows
// that the step also grows without it. The results agree with an analysis of the problem without the term.
#include "stability/waves/rates_of_terms.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "model/build.h"
#include "stability/equations.h"
#include "stability_support.h"

namespace dpde::stability {
namespace {

/// `count` fields, each with its own diffusion and products with all fields that `is_read` says.
std::string coupled(int count, const std::string& time, const std::function<bool(int, int)>& is_read, double strength) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> factor(-strength, strength);
  std::string fields, equations, starts;
  for (int i = 0; i < count; ++i) {
    fields += fmt::format("field c{}; ", i);
    starts += fmt::format("initial c{} = 0.5 + 0.1*sin(2*pi*(x/16 + {}/{}))\n", i, i, count);
    equations += fmt::format("dt(c{}) = {:.2f}*lap(c{}) - 0.5*c{}", i, 0.4 + 0.01 * i, i, i);
    for (int k = 0; k < count; ++k) {
      if (is_read(i, k)) equations += fmt::format(" + {:.3f}*c{}*c{}", factor(random), i, k);
    }
    equations += "\n";
  }
  return fmt::format(
      "model m {{ {}\n{} }} scheme q {{ time = {} }}\nscene s : m with q {{ grid x = 0 .. 16, cells 16, periodic\n"
      "{} time 0 .. 1, step 0.1 }}",
      fields, equations, time, starts);
}

model::Problem without(model::Problem problem, const RateTerm& left_out) {
  for (model::State& state : problem.states) {
    if (state.name != left_out.state) continue;
    model::Expr rest = model::number(0);
    for (const model::Term& term : model::terms_of(*state.rhs)) {
      if (term.value->origin.range != left_out.range)
        rest = model::binary(term.negative ? BinaryOp::subtract : BinaryOp::add, rest, term.value);
    }
    state.rhs = rest;
  }
  return problem;
}

/// Every term of a dense coupling, for one lowering: no problem without a term has to be made.
TEST(RatesOfTerms, DecideNearlyAllTermsOfDenseCouplings) {
  const auto session = open_scene(coupled(
      8, "rk4", [](int, int) { return true; }, 0.3));
  const StabilityReport verdict = verdict_of(*session);
  const std::vector<RateTerm> terms = rate_terms(session->problem(), verdict.group);
  EXPECT_EQ(terms.size(), 80u);
  const auto rates = RatesOfTerms::make(session->problem(), verdict, terms);
  ASSERT_TRUE(rates);
  for (std::size_t i = 0; i < terms.size(); ++i)
    EXPECT_TRUE(rates->surely_grows_without(i, 1.25 * verdict.limit.step)) << terms[i].state;
  EXPECT_FALSE(limiting_term(session->problem(), verdict));
}

TEST(RatesOfTerms, SayWhatAnalysesWithoutTheTermSay) {
  const auto neighbours = [](int i, int k) { return (k - i + 5) % 5 < 2; };
  int decided = 0;
  for (const char* time : {"euler", "ssp_rk3", "rk4"}) {
    for (const double strength : {0.3, 8.0}) {
      const auto session = open_scene(coupled(5, time, neighbours, strength));
      const model::Problem& problem = session->problem();
      const StabilityReport verdict = verdict_of(*session);
      if (verdict.limit.kind != StepLimit::Kind::limit) continue;
      const std::vector<RateTerm> terms = rate_terms(problem, verdict.group);
      const auto rates = RatesOfTerms::make(problem, verdict, terms);
      ASSERT_TRUE(rates);
      for (const double step : {1.05 * verdict.limit.step}) {
        for (std::size_t i = 0; i < terms.size(); ++i) {
          if (!rates->surely_grows_without(i, step)) continue;
          const model::Problem other = without(problem, terms[i]);
          const std::optional<LinearStep> linear = linear_step(other, verdict.group);
          const Equations equations(other, verdict.group);
          const auto analysis = FrozenAnalysis::make(*linear, verdict.worst, 1, verdict.step, &equations);
          EXPECT_FALSE(analysis->is_stable(step)) << time << " " << strength << " " << i;
          ++decided;
        }
      }
    }
  }
  EXPECT_GT(decided, 50);
}

/// A term that limits one field alone is still found and reported.
TEST(RatesOfTerms, NameTheTermThatLimits) {
  const std::string text =
      "model m { field a, b, c\n dt(a) = 3*lap(a) + 0.1*b\n dt(b) = 0.2*lap(b) - b + a*c\n dt(c) = 0.1*lap(c) - c*b }\n"
      "scheme q { time = rk4 }\nscene s : m with q { grid x = 0 .. 16, cells 16, periodic\n"
      "initial a = 1\n initial b = 0.5\n initial c = 0.2\n time 0 .. 1, step 0.1 }";
  const auto session = open_scene(text);
  const StabilityReport verdict = verdict_of(*session);
  const std::optional<SourceRange> range = limiting_term(session->problem(), verdict);
  ASSERT_TRUE(range);
  EXPECT_EQ(text.substr(static_cast<std::size_t>(range->begin), static_cast<std::size_t>(range->end - range->begin)),
            "3*lap(a)");
}

}  // namespace
}  // namespace dpde::stability
