// SPDX-License-Identifier: Apache-2.0
// The verifier finds each broken invariant.
#include <functional>
#include <limits>

#include "model/build.h"
#include "model/model_support.h"

namespace dpde::model {
namespace {

Problem sound() {
  return problem_of(text_with("k*lap(u) - advect(c, u) + w", 1, "  observe e = mean(u^2)\n") +
                    "task t : s {\n  data v = load(\"v.npy\")\n  unknown k\n  minimise mean((u - v)^2) at t = 0.5\n  "
                    "using adam(rate = 1)\n}\n");
}

struct Breakage {
  const char* mistake;
  std::function<void(Problem&)> apply;
};

TEST(VerifyModel, FindsEachBreakage) {
  ASSERT_EQ(verify(sound()), std::vector<std::string>{});
  const Expr u = field("u");
  const std::vector<Breakage> breakages{
      {"axis 0 is called y", [](Problem& p) { p.axes[0].name = "y"; }},
      {"axis x has 0 cells", [](Problem& p) { p.axes[0].cells = 0; }},
      {"axis x reaches from 1 to 1", [](Problem& p) { p.axes[0].low = 1; }},
      {"the step is 0",
       [](Problem& p) {
         p.step = 0;
         p.task.reset();
         p.params[0].unknown = false;
       }},
      {"the run has 0 steps",
       [](Problem& p) {
         p.steps = 0;
         p.task.reset();
         p.params[0].unknown = false;
       }},
      {"two things are called u", [](Problem& p) { p.params.push_back({"u"}); }},
      {"parameter c is nan", [](Problem& p) { p.params[1].value = std::numeric_limits<double>::quiet_NaN(); }},
      {"state u has no equation", [](Problem& p) { p.states[0].rhs.reset(); }},
      {"state u has boundaries on 0 axes", [](Problem& p) { p.states[0].boundary.clear(); }},
      {"the step is a model or a program", [](Problem& p) { p.model.clear(); }},
      {"equation of u: there is no parameter q", [](Problem& p) { p.states[0].rhs = param("q"); }},
      {"equation of u: there is no field q", [](Problem& p) { p.states[0].rhs = field("q"); }},
      {"equation of u: there is no axis 1", [](Problem& p) { p.states[0].rhs = coordinate(1); }},
      {"equation of u: a reduction along axis 1",
       [&](Problem& p) {
         p.states[0].rhs = reduce(Reduce{Reduce::Kind::sum, u, {true, true, false}});
       }},
      {"equation of u: derivative of order 3 along axis 0",
       [&](Problem& p) {
         p.states[0].rhs = Expr(Node{Derivative{u, 0, 3}, {}});
       }},
      {"equation of u: velocity of 2 components",
       [&](Problem& p) {
         p.states[0].rhs = advect({u, u}, u);
       }},
      {"equation of u: min has 1 arguments", [&](Problem& p) { p.states[0].rhs = call(Fn::min, {u}); }},
      {"equation of u: a condition stands where a number is needed",
       [&](Problem& p) { p.states[0].rhs = binary(BinaryOp::less, u, 1.0); }},
      {"equation of u: a condition and a number are mixed up", [&](Problem& p) { p.states[0].rhs = select(u, u, u); }},
      {"equation of u: a number is not finite",
       [](Problem& p) { p.states[0].rhs = Expr(std::numeric_limits<double>::infinity()); }},
      {"initial state of u: a field cannot stand here", [&](Problem& p) { p.states[0].initial.formula = u; }},
      {"initial state of u: neither a formula nor a file, or both",
       [](Problem& p) { p.states[0].initial.file = "u.npy"; }},
      {"boundary of u: a coordinate cannot stand here",
       [](Problem& p) { p.states[0].boundary[0].low.a = coordinate(0); }},
      {"exact solution of u: a derivative cannot stand here",
       [](Problem& p) { p.states[0].exact = derivative(coordinate(0), 0, 1); }},
      {"exact solution of u: a reduction cannot stand here",
       [](Problem& p) { p.states[0].exact = reduce(Reduce::Kind::sum, coordinate(0)); }},
      {"observable e: a reduction along no axis",
       [&](Problem& p) {
         p.observables[0].value = reduce(Reduce::Kind::sum, reduce(Reduce{Reduce::Kind::max, u, {}}));
       }},
      {"datum v comes from a file or from a scene", [](Problem& p) { p.task->data[0].scene = "s"; }},
      {"unknown q is nothing", [](Problem& p) { p.task->unknowns[0].name = "q"; }},
      {"a task has unknowns and losses", [](Problem& p) { p.task->losses.clear(); }},
      {"loss: t = 0.3 is no state of the run", [](Problem& p) { p.task->losses[0].when.times = {0.3}; }},
      {"loss: times without at, or at without times", [](Problem& p) { p.task->losses[0].when.times.clear(); }},
      {"the optimiser has no rate", [](Problem& p) { p.task->optimiser->rate = 0; }},
      {"the optimiser has no iterations", [](Problem& p) { p.task->optimiser->iterations = 0; }},
  };
  for (const Breakage& breakage : breakages) {
    Problem problem = sound();
    breakage.apply(problem);
    EXPECT_EQ(verify(problem), std::vector<std::string>{breakage.mistake});
  }
}

}  // namespace
}  // namespace dpde::model
