// SPDX-License-Identifier: Apache-2.0
// Scenes with implicit steps, written as programs and read back: they run to the same bits, and are as stable. Implicit
// schemes x what is solved for x ends of the axis.
#include <stdexcept>
#include <variant>

#include "driver/driver_support.h"
#include "driver/scene/scene_text.h"
#include "driver/scene/session.h"
#include "stability/stability_report.h"
#include "stencil/text/print_stencil.h"

namespace dpde::stability {
namespace {

struct Implicitly {
  const char *name, *scheme;
  bool is_all;  // no term stays explicit
};
constexpr Implicitly implicit_schemes[] = {
    {"backward_euler", "backward_euler", false},
    {"backward_euler_all", "backward_euler; implicit = all", true},
    {"crank_nicolson", "crank_nicolson", false},
    {"crank_nicolson_all", "crank_nicolson; implicit = all", true},
    {"imex_euler", "imex_euler", false},
    {"ars222", "ars222", false},
    {"ars222_all", "ars222; implicit = all", true},
    {"ars443", "ars443", false},
    {"ars443_all", "ars443; implicit = all", true},
};
enum class Solved { one_field, two_coupled, array };
struct ImplicitScene {
  Implicitly scheme;
  Solved solved;
  bool is_ring;
};

/// A fully implicit step of diffusion.
bool is_of_diffusion_alone(const ImplicitScene& one) { return std::string(one.scheme.scheme) == "crank_nicolson"; }

std::string equations_of(const ImplicitScene& one) {
  switch (one.solved) {
    case Solved::one_field:
      return std::string("model m { field u\ndt(u) = 0.1*lap(u)") +
             (is_of_diffusion_alone(one) ? " }\n" : " - u*u }\n");
    case Solved::two_coupled: return "model m { field u, v\ndt(u) = 0.1*lap(u) - u*v; dt(v) = u - v + 0.05*lap(v) }\n";
    case Solved::array:
      return "model m { field u, c[2]\n"
             "dt(u) = 0.1*lap(u) - u*sum(c[i], i); dt(c[i]) = 0.1*i*u - c[i] + 0.05*i*lap(c[i]) }\n";
  }
  return "";
}

std::string scene_of(const ImplicitScene& one) {
  const char *walls = "", *initial = "initial u = 1 + 0.1*sin(2*pi*x)\n";
  switch (one.solved) {
    case Solved::one_field: walls = "boundary u: x = 1\n"; break;
    case Solved::two_coupled:
      walls = "boundary u: x = 1; boundary v: x.low = 0, x.high = zero_gradient\n";
      initial = "initial u = 1; initial v = x\n";
      break;
    case Solved::array:
      walls = "boundary u: x = 1; boundary c[i]: x.low = 0.1*i, x.high = zero_gradient\n";
      initial = "initial u = 1; initial c[i] = i*x\n";
      break;
  }
  return equations_of(one) + "scheme p { time = " + one.scheme.scheme +
         " }\nscene s : m with p { grid x = 0 .. 1, cells 6" + (one.is_ring ? ", periodic\n" : "\n") +
         (one.is_ring ? "" : walls) + initial + "time 0 .. 0.3, step 1/10\nobserve o = mean(u)*2 }\n";
}

/// The final states, bit by bit, and the verdict.
struct SeenOfRun {
  std::string text;  // of its programs and its scene
  std::vector<double> states;
  StabilityReport verdict;
};

SeenOfRun seen_of(const std::string& text) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "s";
  options.backend = driver::Backend::interpreter;
  const auto compiled = testing::compiled(source, options);
  DiagnosticSink sink;
  const auto session = compiled ? driver::Session::open(source, compiled, {}, sink) : nullptr;
  SeenOfRun seen;
  if (session == nullptr) {
    ADD_FAILURE() << testing::all_messages(source, sink) << text;
    return seen;
  }
  seen.verdict = verdict_of(*session);
  session->rollout().run();
  for (std::size_t s = 0; s < compiled->problem->states.size(); ++s) {
    const std::vector<double> state = session->final_state(static_cast<int>(s));
    seen.states.insert(seen.states.end(), state.begin(), state.end());
  }
  seen.text = stencil::print(driver::extract(compiled->stencil, compiled->primal_programs)) + "\n" +
              driver::scene_text(*compiled);
  return seen;
}

std::vector<ImplicitScene> implicit_scenes() {
  std::vector<ImplicitScene> all;
  for (const Implicitly& scheme : implicit_schemes)
    for (const Solved solved : {Solved::one_field, Solved::two_coupled, Solved::array})
      for (const bool is_ring : {false, true}) {
        const ImplicitScene one{scheme, solved, is_ring};
        if (solved == Solved::one_field || !is_of_diffusion_alone(one)) all.push_back(one);
      }
  return all;
}

std::string name_of_scene(const ::testing::TestParamInfo<ImplicitScene>& info) {
  const char* solved[] = {"one", "two", "array"};
  return std::string(info.param.scheme.name) + "_" + solved[static_cast<int>(info.param.solved)] +
         (info.param.is_ring ? "_ring" : "_walls");
}

class ImplicitPrograms : public ::testing::TestWithParam<ImplicitScene> {};

TEST_P(ImplicitPrograms, RunAndAreStableAsTheirScene) {
  const std::string text = scene_of(GetParam());
  const SeenOfRun scene = seen_of(text), programs = seen_of(scene.text);
  SCOPED_TRACE(text + scene.text);
  ASSERT_FALSE(scene.states.empty());
  EXPECT_EQ(programs.states, scene.states);
  EXPECT_EQ(programs.verdict.is_analysed(), scene.verdict.is_analysed()) << programs.verdict.why << scene.verdict.why;
  EXPECT_EQ(programs.verdict.limit.kind, scene.verdict.limit.kind);
  // An estimate between walls: of programs what solves give there is as the run begins, of scenes as the step makes it.
  EXPECT_NEAR(programs.verdict.limit.step, scene.verdict.limit.step, 0.1 * scene.verdict.limit.step);
}

INSTANTIATE_TEST_SUITE_P(Table, ImplicitPrograms, ::testing::ValuesIn(implicit_scenes()), name_of_scene);

/// A solution of a coupled solve is a coefficient later in the step: p is about 1, and u - 100*dt*p*u is stable up to
/// dt = 0.02.
TEST(CoupledSolves, AreKnownWhereTheyAreCoefficients) {
  const std::string kernels = R"(
kernel make(u: field, out b: field, out c: field) {
  b = 1 + 0*u
  c = 2 + 0*u
}
kernel together(p: field halo 1, q: field, out left: field, out other: field) {
  left = p - 0.1*(p[-1] - 2*p + p[+1]) + 0.01*q
  other = q - 0.1*p
}
kernel move(u: field, p: field, dt: param, out u_next: field) { u_next = u - 100*dt*p*u }
)";
  for (const bool is_ring : {false, true}) {
    const SeenOfRun seen =
        seen_of(kernels + "program step {\n run make\n solve left, other = b, c for p, q {\n fill p x = " +
                (is_ring ? "periodic" : "zero_gradient") +
                "\n run together\n }\n run move\n swap u, u_next\n}\nscene s : step { grid x = 0 .. 1, cells 8" +
                (is_ring ? ", periodic" : "") + "\n initial u = 1\n time 0 .. 0.03, step 0.01 }\n");
    EXPECT_EQ(seen.verdict.why, "");
    EXPECT_NEAR(seen.verdict.limit.step, 0.0204, 0.0004) << (is_ring ? "on a ring" : "between walls");
  }
}

/// None is the machine's failure, and each has the place of what runs.
TEST(ExceptionsOfTheLibrary, AreBugsOfDpdeAtAPlace) {
  const auto code_of = [](const std::exception& error) {
    DiagnosticSink sink;
    driver::report_error(error, sink, {3, 4});
    EXPECT_TRUE(sink.all().front().range.is_known());
    return std::string(sink.all().front().kind->code);
  };
  EXPECT_EQ(code_of(std::out_of_range("unordered_map::at")), "E0910");
  EXPECT_EQ(code_of(std::invalid_argument("stod")), "E0910");
  EXPECT_EQ(code_of(std::bad_variant_access()), "E0910");
  EXPECT_EQ(code_of(std::bad_optional_access()), "E0910");
  EXPECT_EQ(code_of(std::bad_alloc()), "E0903");
  EXPECT_EQ(code_of(std::length_error("vector::reserve")), "E0903");
  EXPECT_EQ(code_of(std::runtime_error("the disk is full")), "E0903");
}

}  // namespace
}  // namespace dpde::stability
