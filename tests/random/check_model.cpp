// SPDX-License-Identifier: Apache-2.0
#include "random/check_model.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>
#include <memory>
#include <vector>

#include "analysis/certificate/certificate.h"
#include "analysis/certificate/quick_certificate.h"
#include "codegen/llvm/jit.h"
#include "driver/compile/interpreter_backend.h"
#include "driver/compile/links.h"
#include "driver/compile/pipeline.h"
#include "driver/scene/inverse.h"
#include "driver/scene/scene_text.h"
#include "driver/scene/session.h"
#include "fuzz/targets.h"
#include "loop/from_stencil.h"
#include "random/isolated.h"
#include "random/swapped_axes.h"
#include "random/torn_corners.h"
#include "source/render.h"
#include "stencil/interpret/with_rounding.h"
#include "stencil/text/from_ast.h"
#include "stencil/text/print_stencil.h"
#include "support/split_mix.h"
#include "syntax/parser.h"

namespace dpde::testing {

using driver::Backend;

namespace {

constexpr rlim_t longest_seconds = 400;                                     // of a processor
constexpr double largest_double_error = 1e-11, largest_float_error = 3e-4;  // of back ends, on numbers of order one

/// Final states, loss and gradient near the task's start, one after the other.
using RunNumbers = std::vector<double>;

class ModelCheck {
 public:
  ModelCheck(const std::string& text, const ModelChecks& checks) : source_("random.dpde", text), checks_(checks) {}

  ModelVerdict run() {
    const std::string wrong = fuzz_parser(source_.text());
    if (!wrong.empty()) fail("text", wrong);
    if (verdict_.kind == ModelVerdict::Kind::failed || !compile() || !reads_back()) return verdict_;
    RunNumbers wanted;
    if (!evaluate(jit_, wanted, "jit")) return verdict_;
    const bool agrees = back_end_agrees(Backend::interpreter, "interpreter", wanted) && read_back_agrees() &&
                        (!checks_.cpp || back_end_agrees(Backend::cpp, "cpp", wanted));
    if (agrees && (!checks_.symmetries || (memory_changes_nothing() && axes_are_alike()))) certify();
    return verdict_;
  }

 private:
  bool fail(const std::string& check, const std::string& detail) {
    verdict_ = {ModelVerdict::Kind::failed, check, detail};
    return false;
  }

  /// The verdict on a refusal: it must have a source position and must not be an internal error.
  bool refuse(const DiagnosticSink& sink) {
    for (const Diagnostic& d : sink.all()) {
      if (d.kind->severity != Severity::error) continue;
      const std::string text = render_text(source_, d), code(d.kind->code);
      const bool points =
          d.range.is_known() && d.range.begin <= d.range.end && d.range.end <= static_cast<int>(source_.text().size());
      if (code == "E0910" || code == "E0911" || code == "E0903" || !points) return fail("refusal", text);
      verdict_ = {ModelVerdict::Kind::refused, code, text};
      return false;
    }
    return fail("refusal", "nothing came out, and no error");
  }

  std::shared_ptr<const driver::Compiled> compiled(Backend backend, std::optional<Precision> real = std::nullopt) {
    driver::CompileOptions options;
    options.selection.name = "t";
    options.backend = backend;
    options.adjoint = options.verify = true;
    options.takes_jumps = true;  // as of if(@ < @, @, @): back ends and adjoints have to agree all the same
    options.tangent = backend == Backend::jit;
    options.second = options.tangent && checks_.second;
    options.real = real;
    DiagnosticSink sink;
    std::optional<driver::Compiled> result = driver::compile(source_, options, sink);
    if (!result || sink.has_errors()) return refuse(sink), nullptr;
    return std::make_shared<const driver::Compiled>(std::move(*result));
  }

  bool compile() { return (jit_ = compiled(Backend::jit)) != nullptr; }

  bool reads_back() {
    const std::string text = stencil::print(jit_->stencil);
    const SourceFile again("stencil.dpde", text);
    DiagnosticSink sink;
    const std::string twice = stencil::print(stencil::from_ast(parse(again, sink), sink));
    if (sink.has_errors()) return fail("stencil text", render_text(again, sink.all()[0]) + text);
    return twice == text || fail("stencil text", text + "\nreads back as\n" + twice);
  }

  bool unstable(const std::string& why) {
    verdict_ = {ModelVerdict::Kind::unstable, "", why};
    return false;
  }

  bool evaluate(const std::shared_ptr<const driver::Compiled>& code, RunNumbers& numbers, const std::string& check,
                const driver::SessionOptions& options = {}) {
    DiagnosticSink sink;
    const auto session = driver::Session::open(source_, code, options, sink);
    if (!session) return refuse(sink);
    if (session->rollout().run().blow_up)
      return check == "jit" ? unstable("blow-up") : fail(check, "only here the run is not finite");
    for (std::size_t s = 0; s < session->problem().states.size(); ++s) {
      const std::vector<double> state = session->final_state(static_cast<int>(s));
      numbers.insert(numbers.end(), state.begin(), state.end());
    }
    const auto inverse = driver::Inverse::open(*session, source_, sink);
    if (!inverse) return refuse(sink);
    SplitMix random(7);
    Eigen::VectorXd x = inverse->start(), gradient(inverse->size());
    for (Eigen::Index i = 0; i < x.size(); ++i) x[i] += random.uniform(-0.05, 0.05);
    numbers.push_back(inverse->value_and_gradient(x, gradient));
    numbers.insert(numbers.end(), gradient.data(), gradient.data() + gradient.size());
    for (const double value : numbers) {
      if (!std::isfinite(value))
        return check == "jit" ? unstable("not finite") : fail(check, "only here the result is not finite");
    }
    return true;
  }

  bool back_end_agrees(Backend backend, const std::string& check, const RunNumbers& wanted) {
    const auto code = compiled(backend);
    RunNumbers got;
    if (!code || !evaluate(code, got, check)) return false;
    const double error = distance(got, wanted);
    double scale = 1;
    for (const double value : wanted) scale = std::max(scale, std::abs(value));
    const double most = code->real() == Precision::f32 ? largest_float_error : largest_double_error;
    if (error <= most * scale || error <= 10 * rounding_of(wanted)) return true;
    return fail(check, fmt::format("differs from the JIT by {:.3e} of {:.3e}", error, scale));
  }

  /// What is printed runs when it is read back, and gives the same bits: the programs of the task, with its gradient,
  /// and the scene with its step where its text has words for all of it.
  bool read_back_agrees() {
    const auto code = compiled(Backend::interpreter);
    RunNumbers wanted, got;
    if (!code || !evaluate(code, wanted, "interpreter")) return false;
    auto read = std::make_shared<driver::Compiled>(*code);
    const SourceFile text("stencil.dpde", stencil::print(code->stencil));
    DiagnosticSink sink;
    read->stencil = stencil::from_ast(parse(text, sink), sink);
    std::vector<std::string> names;
    for (const stencil::Program& program : read->stencil.programs) names.push_back(program.name);
    read->code = driver::interpreted(read->stencil, loop::from_stencil(read->stencil, names, read->real()));
    for (const driver::LinkedProgram& linked : driver::linked_programs(*read))
      read->code->set_links(linked.program, linked.links);
    if (!evaluate(read, got, "read back")) return false;
    if (distance(got, wanted) != 0) return fail("read back", "the programs differ");
    return scene_read_back_agrees(*code);
  }

  bool scene_read_back_agrees(const driver::Compiled& code) {
    driver::CompileOptions options;
    options.selection.name = code.problem->scene;
    options.backend = Backend::interpreter;
    DiagnosticSink sink;
    auto scene = driver::compile(source_, options, sink);
    if (!scene) return refuse(sink);
    const std::string rest = driver::scene_text(*scene);
    if (rest.starts_with("# scene")) return true;
    const SourceFile text("scene.dpde",
                          stencil::print(driver::extract(scene->stencil, scene->primal_programs)) + "\n" + rest);
    auto again = driver::compile(text, options, sink);
    if (!again) return fail("scene text", render_text(text, sink.all()[0]) + std::string(text.text()));
    const RunNumbers wanted = states_of(source_, std::move(*scene)), got = states_of(text, std::move(*again));
    return distance(got, wanted) == 0 || fail("scene text", std::string(text.text()));
  }

  /// Few checkpoints and two threads give the same bits.
  bool memory_changes_nothing() {
    RunNumbers wanted, got;
    driver::SessionOptions little;
    little.slots = 1;
    little.threads = 2;
    if (!evaluate(jit_, wanted, "jit") || !evaluate(jit_, got, "one checkpoint", little)) return false;
    return distance(got, wanted) == 0 || fail("one checkpoint", "the gradient differs");
  }

  /// Of the same with its first two axes swapped: what no order of cells and of fills changes, but for rounding.
  bool axes_are_alike() {
    if (has_torn_corners(driver::extract(jit_->stencil, jit_->primal_programs))) return true;
    const std::optional<std::string> text = with_swapped_axes(std::string(source_.text()));
    if (!text) return true;
    ModelCheck other(*text, checks_);
    if (!other.compile()) return fail("axes", other.verdict_.detail + *text);
    const RunNumbers wanted = sums_of(source_, jit_), got = sums_of(other.source_, other.jit_);
    if (got.size() != wanted.size()) return fail("axes", "one of them fails\n" + *text);
    double error = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      error = std::max(error, std::abs(got[i] - wanted[i]) / std::max(1.0, std::abs(wanted[i])));
    const double most = jit_->real() == Precision::f32 ? largest_float_error : largest_double_error;
    return error <= most || fail("axes", fmt::format("differ by {:.3e}\n{}", error, *text));
  }

  /// Sums of squares of the states and of the gradient, and the loss. Of histories, values on walls are never read.
  static RunNumbers sums_of(const SourceFile& source, const std::shared_ptr<const driver::Compiled>& compiled) {
    DiagnosticSink sink;
    const auto session = driver::Session::open(source, compiled, {}, sink);
    if (!session) return {};
    session->rollout().run();
    double states = 0;
    for (std::size_t s = 0; s < session->problem().states.size(); ++s) {
      if (!session->problem().states[s].history_of.empty()) continue;
      for (const double value : session->final_state(static_cast<int>(s))) states += value * value;
    }
    const auto inverse = driver::Inverse::open(*session, source, sink);
    if (!inverse) return {};
    Eigen::VectorXd gradient(inverse->size());
    const double loss = inverse->value_and_gradient(inverse->start(), gradient);
    return {states, loss, gradient.squaredNorm()};
  }

  static RunNumbers states_of(const SourceFile& source, driver::Compiled compiled) {
    DiagnosticSink sink;
    const auto session =
        driver::Session::open(source, std::make_shared<const driver::Compiled>(std::move(compiled)), {}, sink);
    RunNumbers numbers;
    if (!session) return numbers;
    session->rollout().run();
    for (std::size_t s = 0; s < session->problem().states.size(); ++s) {
      const std::vector<double> state = session->final_state(static_cast<int>(s));
      numbers.insert(numbers.end(), state.begin(), state.end());
    }
    return numbers;
  }

  static double distance(const RunNumbers& one, const RunNumbers& other) {
    if (one.size() != other.size()) return INFINITY;
    double result = 0;
    for (std::size_t i = 0; i < one.size(); ++i) result = std::max(result, std::abs(one[i] - other[i]));
    return result;
  }

  /// What roundings in all operations change. The limits of MacCormack are those of the cell that the flow leads to:
  /// where it stands still but for rounding, that is one cell or its neighbour.
  double rounding_of(const RunNumbers& wanted) {
    double result = 0;
    for (const double phase : {1.7, 2.3, 3.9, 5.1}) {
      auto moved = std::make_shared<driver::Compiled>(*jit_);
      moved->stencil = stencil::with_rounding(jit_->stencil, phase);
      std::vector<std::string> names;
      for (const stencil::Program& program : moved->stencil.programs) names.push_back(program.name);
      driver::replace_loop(*moved, loop::from_stencil(moved->stencil, names, moved->real()));
      moved->code = codegen::jit(moved->loop).module;
      for (const driver::LinkedProgram& linked : driver::linked_programs(*moved))
        moved->code->set_links(linked.program, linked.links);
      RunNumbers got;
      if (!evaluate(moved, got, "with roundings")) return 0;
      result = std::max(result, distance(got, wanted));
    }
    return result;
  }

  /// The gradient passes the certificate that is computed before a gradient is used.
  bool certify_before_use() {
    DiagnosticSink sink;
    analysis::certify_quickly(source_, jit_, analysis::Certifying::always, sink);
    return !sink.has_errors() || fail("certificate before use", render_text(source_, sink.all()[0]));
  }

  bool certify() {
    const bool is_single = jit_->real() == Precision::f32;
    const auto code = is_single ? compiled(Backend::jit, Precision::f64) : jit_;
    if (!code) return false;
    DiagnosticSink sink;
    std::optional<analysis::Certificate> certificate = analysis::certify(source_, code, {}, sink);
    if (!certificate || (is_single && !analysis::certify_single_precision(source_, jit_, {}, *certificate, sink)))
      return refuse(sink);
    if (certificate->cases.empty() || certificate->note.find("not stable") != std::string::npos)
      return unstable(certificate->note);
    if (certificate->passed()) return certify_before_use();
    if (!(certificate->worst() <= largest_double_error))
      return fail("dot product", fmt::format("{:.3e}", certificate->worst()));
    if (certificate->jump) return certify_before_use();
    if (certificate->second && !certificate->second->passed()) {
      return fail("second order", fmt::format("asymmetry {:.3e}, slope {}", certificate->second->worst(),
                                              certificate->second->slope.value_or(0)));
    }
    if (certificate->single && !certificate->single->passed())
      return fail("single precision", fmt::format("{:.3e}", certificate->single->worst()));
    return fail("slope", fmt::format("{} {}", certificate->slope.value_or(0), certificate->note));
  }

  const SourceFile source_;
  const ModelChecks checks_;
  std::shared_ptr<const driver::Compiled> jit_;
  ModelVerdict verdict_;
};

ModelVerdict check_here(const std::string& text, const ModelChecks& checks) {
  try {
    return ModelCheck(text, checks).run();
  } catch (const std::exception& error) {
    return {ModelVerdict::Kind::failed, "exception", error.what()};
  }
}

}  // namespace

ModelVerdict check_model(const std::string& text, const ModelChecks& checks) {
  const Answer answer = isolated(
      [&] {
        const rlimit limit{longest_seconds, longest_seconds};
        setrlimit(RLIMIT_CPU, &limit);
        const ModelVerdict verdict = check_here(text, checks);
        return std::string(1, static_cast<char>('0' + static_cast<int>(verdict.kind))) + verdict.check + "\n" +
               verdict.detail;
      },
      checks.seconds);
  if (answer.kind == Answer::Kind::late)
    return {ModelVerdict::Kind::failed, "time", fmt::format("more than {} s", checks.seconds)};
  if (answer.kind == Answer::Kind::crashed) return {ModelVerdict::Kind::failed, "crash", answer.text};
  const std::size_t line = answer.text.find('\n');
  return {static_cast<ModelVerdict::Kind>(answer.text[0] - '0'), answer.text.substr(1, line - 1),
          answer.text.substr(line + 1)};
}

}  // namespace dpde::testing
