// SPDX-License-Identifier: Apache-2.0
// Certificates of compiled derivatives: created, cached, renewed, refused.
#include "analysis/certificate/quick_certificate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "analysis/certificate/certificate.h"
#include "codegen/llvm/jit.h"
#include "driver_support.h"
#include "loop/from_stencil.h"
#include "stencil/build.h"
#include "stencil/text/print_stencil.h"

namespace dpde::testing {
namespace {

using analysis::Certifying;

const char* const text = R"(model burgers {
  field u
  param nu
  coefficient k
  dt(u) = -advect(u, u) + nu*div(k*grad(u))
}
scheme plain { advect = central(2); time = rk2 }
scene wave : burgers with plain {
  grid x = 0 .. 1, cells 20
  boundary u: x.low = 0.2, x.high = zero_gradient
  nu = 0.01
  k = 1 + nu*x
  initial u = sin(3*x)
  time 0 .. 0.2, step 0.02
}
task find : wave {
  unknown nu from 0.02
  unknown initial u
  minimise mean(u^2) at t = 0.2
}
)";

struct MapCache : codegen::CodeCache {
  std::map<std::string, std::string, std::less<>> entries;
  std::optional<std::string> find(std::string_view key) override {
    const auto found = entries.find(key);
    return found == entries.end() ? std::nullopt : std::optional(found->second);
  }
  void store(std::string_view key, std::string_view code) override { entries[std::string(key)] = code; }
};

struct QuickCertificates : ::testing::Test {
  const SourceFile source{"wave.dpde", text};
  const std::shared_ptr<MapCache> cache = std::make_shared<MapCache>();
  DiagnosticSink sink;

  std::shared_ptr<driver::Compiled> compile(const std::string& scheme = "", double runs = driver::any_number_of_runs) {
    driver::CompileOptions options;
    options.selection.name = "find";
    if (!scheme.empty()) options.selection.overrides = {{"real", scheme}};
    options.backend = driver::Backend::jit;
    options.adjoint = true;
    options.cache = cache;
    options.runs = runs;
    return compiled(source, options);
  }
  /// The certificates in the cache, which also contains code.
  std::vector<std::string*> kept() {
    std::vector<std::string*> found;
    for (auto& [key, value] : cache->entries) {
      if (key.find("\ncertificate\n") != std::string::npos) found.push_back(&value);
    }
    return found;
  }
};

TEST_F(QuickCertificates, AreMadeAndKeptAndFound) {
  const auto first = analysis::certify_quickly(source, compile(), Certifying::always, sink);
  ASSERT_TRUE(first.has_value());
  EXPECT_LT(first->dot_product, 1e-12);
  EXPECT_GT(first->dot_product, 0);
  EXPECT_FALSE(first->from_cache);
  EXPECT_EQ(kept().size(), 1u);
  const auto scene = compile();
  scene->cached.is_from_cache = false;
  scene->seconds = 0;  // everything is expensive compared with that
  const auto again = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(again->from_cache);
  EXPECT_EQ(again->dot_product, first->dot_product);
  EXPECT_EQ(again->program, first->program);
  EXPECT_EQ(again->grid, first->grid);
  const auto forced = analysis::certify_quickly(source, scene, Certifying::always, sink);
  ASSERT_TRUE(forced.has_value());
  EXPECT_FALSE(forced->from_cache);
  EXPECT_FALSE(sink.has_errors());
}

/// Unoptimised code of a short run compiles faster; its certificate has the same time.
TEST_F(QuickCertificates, OfCodeThatIsNotOptimisedHaveTheTimeOfCodeThatIs) {
  const auto scene = compile("", 1);
  scene->seconds = 6 * analysis::expected_seconds(*scene);
  const auto some = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(some.has_value());
  EXPECT_NE(some->program, "");
  scene->seconds = analysis::expected_seconds(*scene);
  cache->entries.clear();
  const auto none = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(none->program, "");
}

TEST_F(QuickCertificates, AreLeftOutWhereTheyCostMoreThanATenthOrAreNotWanted) {
  const auto scene = compile();
  EXPECT_FALSE(analysis::certify_quickly(source, scene, Certifying::never, sink).has_value());
  scene->seconds = 9 * analysis::expected_seconds(*scene);
  const auto none = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(none.has_value());
  EXPECT_EQ(none->left_out, std::vector<std::string>{
                                "everything: it would take more than a tenth of the compilation; --certify does it"});
  EXPECT_EQ(none->program, "");
  EXPECT_TRUE(kept().empty());
  scene->seconds = 11 * analysis::expected_seconds(*scene);
  const auto some = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(some.has_value());
  EXPECT_NE(some->program, "");
  EXPECT_FALSE(sink.has_errors());
}

/// Code from the cache needs no compilation: the certificate's time is based on its original compilation time.
TEST_F(QuickCertificates, MayTakeATenthOfTheCompilationOfCodeFromTheCacheToo) {
  const auto first = compile();
  EXPECT_FALSE(first->cached.is_from_cache);
  first->seconds = 1e3;
  for (const Certifying how : {Certifying::never, Certifying::always}) {
    cache->entries.erase(first->cached.key + "\nseconds\n");
    analysis::certify_quickly(source, first, how, sink);
    EXPECT_TRUE(cache->entries.contains(first->cached.key + "\nseconds\n"));
  }
  for (std::string* certificate : kept()) *certificate = "none";
  const auto second = compile();
  EXPECT_TRUE(second->cached.is_from_cache);
  second->seconds = 0;
  const auto certificate = analysis::certify_quickly(source, second, Certifying::when_cheap, sink);
  ASSERT_TRUE(certificate.has_value());
  EXPECT_NE(certificate->program, "");
}

/// A loss at another time is another run.
TEST_F(QuickCertificates, AreOfTheTaskToo) {
  ASSERT_TRUE(analysis::certify_quickly(source, compile(), Certifying::always, sink).has_value());
  std::string changed = text;
  changed.replace(changed.find("at t = 0.2"), 10, "at t = 0.1");
  const SourceFile other("wave.dpde", changed);
  driver::CompileOptions options;
  options.selection.name = "find";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  options.cache = cache;
  options.runs = driver::any_number_of_runs;
  const auto scene = compiled(other, options);
  EXPECT_TRUE(scene->cached.is_from_cache);
  scene->seconds = 1e3;
  const auto again = analysis::certify_quickly(other, scene, Certifying::when_cheap, sink);
  ASSERT_TRUE(again.has_value());
  EXPECT_FALSE(again->from_cache);
}

/// log(u - 3) is finite nowhere: its adjoint cannot be compared, which is reported.
TEST_F(QuickCertificates, NameTheProgramsThatWereNotCompared) {
  const SourceFile log("log.dpde", R"(model m { field u; param k; dt(u) = k*log(u - 3)*u }
scene s : m { grid x = 0 .. 1, cells 8, periodic; k = 0.1; initial u = 5 + sin(6*x); time 0 .. 1, step 0.1 }
task t : s { unknown k; minimise mean(u^2) at t = 1 }
)");
  driver::CompileOptions options;
  options.selection.name = "t";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  const auto certificate = analysis::certify_quickly(log, compiled(log, options), Certifying::always, sink);
  ASSERT_TRUE(certificate.has_value());
  EXPECT_TRUE(
      std::ranges::find(certificate->left_out, "program s_step: its derivatives are not finite on a few cells") !=
      certificate->left_out.end())
      << (certificate->left_out.empty() ? "" : certificate->left_out[0]);
}

TEST_F(QuickCertificates, OfWhatIsNotFiniteAreNone) {
  EXPECT_TRUE(std::isnan(analysis::relative_difference(NAN, 1, 1)));
  EXPECT_TRUE(std::isnan(analysis::relative_difference(1, INFINITY, 1)));
  EXPECT_FALSE(analysis::Certificate().is_all_rounding());
}

TEST_F(QuickCertificates, DamagedOnesAreMadeAgain) {
  const auto scene = compile();
  scene->seconds = 1e3;
  ASSERT_TRUE(analysis::certify_quickly(source, scene, Certifying::when_cheap, sink).has_value());
  const std::string good = *kept()[0];
  for (const std::string& bad :
       {std::string(), std::string("nan\na\nb\n"), std::string("1e-3") + good.substr(good.find('\n')),
        std::string("-") + good, good.substr(0, good.size() - 1), good + "x\n"}) {
    *kept()[0] = bad;
    const auto again = analysis::certify_quickly(source, scene, Certifying::when_cheap, sink);
    ASSERT_TRUE(again.has_value());
    EXPECT_FALSE(again->from_cache) << bad;
    EXPECT_EQ(*kept()[0], good);
  }
}

TEST_F(QuickCertificates, AreOfTheBoundariesToo) {
  const auto scene = compile();
  ASSERT_TRUE(analysis::certify_quickly(source, scene, Certifying::always, sink).has_value());
  const auto other = std::make_shared<driver::Compiled>(*scene);  // under the key of the same code
  for (loop::Program& program : other->loop.programs) program.name += "x";
  other->seconds = 0;
  const auto certificate = analysis::certify_quickly(source, other, Certifying::when_cheap, sink);
  ASSERT_TRUE(certificate.has_value());
  EXPECT_FALSE(certificate->from_cache);
}

TEST_F(QuickCertificates, OfSinglePrecisionAllowForItsRounding) {
  const auto certificate = analysis::certify_quickly(source, compile("f32"), Certifying::always, sink);
  ASSERT_TRUE(certificate.has_value());
  EXPECT_GT(certificate->dot_product, 1e-11);
  EXPECT_LT(certificate->dot_product, 1e-5);
}

/// The scene recompiled after `change` was applied to its adjoints.
std::shared_ptr<driver::Compiled> with_changed(std::shared_ptr<driver::Compiled> scene,
                                               const std::function<void(stencil::Module&)>& change) {
  const stencil::Module before = scene->stencil;
  change(scene->stencil);
  EXPECT_NE(print(scene->stencil), print(before));
  compile_stencil_again(*scene);
  return scene;
}

stencil::Program& program_of(stencil::Module& module, const std::string& name) {
  return *std::ranges::find(module.programs, name, &stencil::Program::name);
}

/// Calls `change` for each kernel that the program runs.
void change_kernels(stencil::Module& module, const std::string& program,
                    const std::function<void(stencil::Kernel&)>& change) {
  for (const stencil::Statement& statement : program_of(module, program).body) {
    const stencil::Run* run = std::get_if<stencil::Run>(&statement);
    if (run != nullptr) change(*std::ranges::find(module.kernels, run->kernel, &stencil::Kernel::name));
  }
}

struct WholeRuns : QuickCertificates {
  analysis::RunCheck check(const std::shared_ptr<driver::Compiled>& scene) const {
    return analysis::check_run(source, scene, INFINITY);
  }
  /// Gradient and losses of the whole run disagree, and nothing is certified.
  void expect_caught(const std::shared_ptr<driver::Compiled>& scene) {
    EXPECT_NE(check(scene).wrong, "");
    EXPECT_FALSE(analysis::certify_quickly(source, scene, Certifying::always, sink).has_value());
    ASSERT_EQ(sink.all().size(), 1u);
    EXPECT_EQ(sink.all()[0].kind->code, "E0804");
    EXPECT_TRUE(kept().empty());
  }
};

TEST_F(WholeRuns, ProveTheGradientByEachUnknown) {
  const analysis::RunCheck result = check(compile());
  EXPECT_EQ(result.wrong, "");
  EXPECT_EQ(result.directions, 2);
  EXPECT_TRUE(result.left_out.empty()) << result.left_out[0];
  EXPECT_EQ(result.grid, "6");
  EXPECT_EQ(result.steps, 3);
  EXPECT_LT(result.error, 1e-6);
  EXPECT_GT(result.error, 0);
  const analysis::RunCheck single = check(compile("f32"));
  EXPECT_EQ(single.wrong, "");
  EXPECT_GE(single.directions, 1);  // floats may not resolve the effect of nu in three steps, which is then reported
  EXPECT_EQ(static_cast<std::size_t>(single.directions) + single.left_out.size(), 2U);
  EXPECT_GT(single.rounding, 100 * result.rounding);
}

TEST_F(WholeRuns, FindAParameterThatIsDropped) {
  expect_caught(with_changed(compile(), [](stencil::Module& module) {
    change_kernels(module, "wave_step_adjoint", [](stencil::Kernel& kernel) {
      for (stencil::Sum& sum : kernel.sums) sum.value = stencil::Expr(0.0);
    });
  }));
}

TEST_F(WholeRuns, FindAHaloThatIsSpoiled) {
  expect_caught(with_changed(compile(), [](stencil::Module& module) {
    std::erase_if(program_of(module, "wave_step_adjoint").body,
                  [](const stencil::Statement& s) { return std::holds_alternative<stencil::Fold>(s); });
  }));
}

TEST_F(WholeRuns, FindALossWithAWrongAdjoint) {
  expect_caught(with_changed(compile(), [](stencil::Module& module) {
    change_kernels(module, "find_loss_1_adjoint", [](stencil::Kernel& kernel) {
      for (stencil::Store& store : kernel.stores) store.value = stencil::Expr(1.001) * store.value;
    });
  }));
}

/// k = 1 + nu*x: each program and its adjoint are right, but the one of the formula is not run. No check of single
/// programs detects this.
TEST_F(WholeRuns, FindAFormulaThatIsLeftOut) {
  const auto scene = compile();
  ASSERT_EQ(scene->derived.erase("wave_coefficients"), 1u);
  expect_caught(scene);
}

/// A program, its tangent and its adjoint that all ignore the same unknown.
TEST_F(WholeRuns, FindWhatTangentAndAdjointOverlookAlike) {
  const auto scene = compile();
  ASSERT_EQ(scene->activity.params.erase("nu"), 1u);
  adjoint::Derivative& step = *scene->derived.at("wave_step").adjoint;
  const auto wrong = with_changed(scene, [&](stencil::Module& module) {
    change_kernels(module, step.program, [](stencil::Kernel& kernel) {
      for (stencil::Sum& sum : kernel.sums) sum.value = stencil::Expr(0.0);
    });
  });
  wrong->derived.erase("wave_coefficients");
  std::erase_if(step.links, [](const adjoint::Link& link) { return link.primal == "nu"; });
  expect_caught(wrong);
}

TEST_F(WholeRuns, SayWhatThereWasNoTimeFor) {
  const auto scene = compile();
  const analysis::RunCheck none = analysis::check_run(source, scene, 0);
  EXPECT_EQ(none.directions, 0);
  EXPECT_TRUE(none.lacked_time);
  EXPECT_EQ(none.left_out, std::vector<std::string>{"the whole run: no time"});
}

/// The derivative of the steady state, by runs that end there: three steps would give another number.
TEST(SteadyRuns, AreCheckedAtTheSteadyState) {
  const SourceFile source("rest.dpde", R"(model m { field u; param k, f; dt(u) = k*lap(u) - u^3 + f }
scene wave : m {
  grid x = 0 .. 1, cells 9
  k = 0.05
  f = 0.7
  boundary u: x = 0
  initial u = 0.1
  time 0 .. 100, step 0.05, until steady 1e-11
}
task find : wave { unknown k; unknown f; minimise mean(u^2) }
)");
  driver::CompileOptions options;
  options.selection.name = "find";
  options.backend = driver::Backend::jit;
  options.adjoint = true;
  const auto scene = compiled(source, options);
  const analysis::RunCheck right = analysis::check_run(source, scene, INFINITY);
  EXPECT_TRUE(right.is_steady);
  EXPECT_EQ(right.wrong, "");
  EXPECT_EQ(right.directions, 2);
  EXPECT_TRUE(right.left_out.empty()) << right.left_out[0];
  const auto broken = with_changed(scene, [](stencil::Module& module) {
    change_kernels(module, "wave_step_adjoint", [](stencil::Kernel& kernel) {
      for (stencil::Sum& sum : kernel.sums) sum.value = stencil::Expr(1.001) * sum.value;
    });
  });
  const analysis::RunCheck wrong = analysis::check_run(source, broken, INFINITY);
  EXPECT_NE(wrong.wrong.find("runs until steady on 6 cells"), std::string::npos) << wrong.wrong;
  const analysis::RunCheck none = analysis::check_run(source, broken, 0);
  EXPECT_EQ(none.left_out, (std::vector<std::string>{"the steady state: no time", "the whole run: no time"}));
}

TEST_F(QuickCertificates, AWrongAdjointIsAnErrorAndNotKept) {
  const auto scene = compile();
  stencil::Module wrong = scene->stencil;
  for (stencil::Kernel& kernel : wrong.kernels) {
    if (kernel.name.find("adjoint") == std::string::npos || kernel.name.find("loss") != std::string::npos) continue;
    for (stencil::Store& store : kernel.stores) store.value = stencil::Expr(1 + 1e-8) * store.value;
  }
  std::vector<std::string> names;
  for (const stencil::Program& program : wrong.programs) names.push_back(program.name);
  driver::replace_loop(*scene, loop::from_stencil(wrong, names));
  scene->code = codegen::jit(scene->loop).module;
  EXPECT_FALSE(analysis::certify_quickly(source, scene, Certifying::always, sink).has_value());
  ASSERT_EQ(sink.all().size(), 1u);
  EXPECT_EQ(sink.all()[0].kind->code, "E0804");
  EXPECT_NE(sink.all()[0].message.find("wave_step not certified: tangent and adjoint differ by"), std::string::npos)
      << sink.all()[0].message;
  EXPECT_TRUE(kept().empty());
}

}  // namespace
}  // namespace dpde::testing
