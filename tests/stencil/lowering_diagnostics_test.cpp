// SPDX-License-Identifier: Apache-2.0
// What no scheme can discretise is reported at its place, with a way out, and nothing is lowered.
#include <gtest/gtest.h>

#include "stencil/lower/from_model.h"
#include "stencil/model_builder.h"

namespace lowering_diagnostics {
namespace {

using namespace model_builder;

const Expr u = field("u"), v = field("v");

Expr at(int begin, const Expr& e) { return Expr(model::Node{e->kind, {{begin, begin + 1}}}); }

/// "E0551 at 7: message" for each report.
std::vector<std::string> complaints(const model::Problem& problem) {
  dpde::DiagnosticSink sink;
  const dpde::stencil::Module module = dpde::stencil::from_model(problem, dpde::stencil::program_names(problem), sink);
  std::vector<std::string> texts;
  for (const dpde::Diagnostic& d : sink.all()) {
    EXPECT_FALSE(d.hint.empty());
    texts.push_back(std::string(d.kind->code) + " at " + std::to_string(d.range.begin) + ": " + d.message);
  }
  EXPECT_EQ(module == dpde::stencil::Module{}, !texts.empty());
  return texts;
}

std::vector<std::string> semi_lagrangian(const Expr& rate,
                                         model::Advection advect = model::Advection::semi_lagrangian) {
  model::Problem p = problem({state("u", rate), state("v", 0.0)});
  p.scheme.transport.advect = advect;
  p.scheme.transport.order = 1;
  return complaints(p);
}

TEST(LoweringDiagnostics, FormOfSemiLagrangianEquations) {
  const std::vector<std::string> wrong{
      "E0551 at 7: semi-Lagrangian advection of u needs one term -advect(v, u) of its equation"};
  const Expr transport = at(7, advect({u}, u));
  EXPECT_EQ(semi_lagrangian(lap(u) - transport), std::vector<std::string>{});
  EXPECT_EQ(semi_lagrangian(lap(u) - (transport - v)), std::vector<std::string>{});
  EXPECT_EQ(semi_lagrangian(lap(u) + transport, model::Advection::maccormack), wrong);
  EXPECT_EQ(semi_lagrangian(lap(u) + transport), wrong);                          // sign
  EXPECT_EQ(semi_lagrangian(lap(u) - (v - transport)), wrong);                    // sign
  EXPECT_EQ(semi_lagrangian(-at(7, 2.0 * advect({u}, u))), wrong);                // factor
  EXPECT_EQ(semi_lagrangian(-at(7, advect({u}, v))), wrong);                      // another state
  EXPECT_EQ(semi_lagrangian(-at(7, advect({u}, u * u))), wrong);                  // no state
  EXPECT_EQ(semi_lagrangian(-at(7, advect({advect({u}, u)}, u))), wrong);         // velocity
  EXPECT_EQ(semi_lagrangian(-at(3, advect({u}, u)) - transport), wrong);          // two of them
  EXPECT_EQ(semi_lagrangian(-advect({u}, u) + at(7, d(advect({u}, u)))), wrong);  // inside another term
}

TEST(LoweringDiagnostics, DifferencesWithoutEnd) {
  Expr e = u;
  for (int depth = 0; depth < 4; ++depth) e = lap(e, 3);
  EXPECT_EQ(complaints(problem({state("u", e)}, {4, 4, 4})), std::vector<std::string>{});
  for (int depth = 0; depth < 2; ++depth) e = lap(e, 3);
  model::Problem p = problem({state("u", -at(3, e))}, {4, 4, 4});
  EXPECT_EQ(complaints(p),
            std::vector<std::string>{"E0552 at -1: the differences of this expression have more than 50000 parts"});
  p = problem({state("u", u)}, {4, 4, 4});
  p.observables = {{"o", at(5, mean(e)), {}}};
  EXPECT_EQ(complaints(p),
            std::vector<std::string>{"E0552 at 5: the differences of this expression have more than 50000 parts"});
}

/// Both ends of the step are read behind one fill.
TEST(LoweringDiagnostics, VelocityOfMacCormackBesideAWallThatMoves) {
  model::Problem p = problem({state("u", -advect({at(5, d(v))}, u)), state("v", 0.0)});
  p.scheme.transport.advect = model::Advection::maccormack;
  p.scheme.transport.order = 2;
  p.axes[0].topology = dpde::Topology::bounded;
  EXPECT_EQ(complaints(p), std::vector<std::string>{});
  p.states[1].boundary[0].high.value = param("t");
  EXPECT_EQ(complaints(p), std::vector<std::string>{"E0311 at 5: a velocity with differences of v, whose walls move, "
                                                    "cannot appear in a scene with advect = maccormack"});
}

}  // namespace
}  // namespace lowering_diagnostics
