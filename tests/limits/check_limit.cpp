// SPDX-License-Identifier: Apache-2.0
#include "limits/check_limit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <sstream>

#include "driver/scene/session.h"
#include "limits/steps_by_runs.h"
#include "source/render.h"
#include "stability/stability_report.h"

namespace dpde::testing {

namespace {

using stability::StabilityReport;
using stability::StepLimit;

constexpr double below = 0.97, above = 1.04;  // of a limit

std::string text_of(const StabilityReport& verdict) {
  const char* const kind = verdict.limit.kind == StepLimit::Kind::limit   ? "limit"
                           : verdict.limit.kind == StepLimit::Kind::never ? "never"
                                                                          : "none";
  return fmt::format("{} {:.5g} exact {} grid {} walls {} means {} net {} rate {:.4g} events {:.4g}", kind,
                     verdict.limit.step, verdict.is_exact, verdict.is_of_grid, verdict.is_of_walls, verdict.is_of_means,
                     verdict.is_of_networks, verdict.growth_rate, verdict.growth_by_events);
}

class Check {
 public:
  /// `plain`: without events.
  Check(driver::Session& session, driver::Session* plain, const StabilityReport& verdict)
      : session_(session), plain_(plain), verdict_(verdict), limit_(verdict.limit.step) {}

  LimitCheck run() {
    result_.detail = text_of(verdict_);
    const double step = session_.problem().step;
    const double size = verdict_.limit.kind == StepLimit::Kind::limit ? std::min(limit_, 8 * step) : step;
    std::optional<StepsByRuns> without_events;
    if (plain_ != nullptr) without_events.emplace(*plain_, size);
    const StepsByRuns runs(session_, size, without_events ? &*without_events : nullptr);
    if (!runs.is_finite()) return tell(LimitCheck::Kind::not_analysed, "not finite");
    result_.detail += " | " + runs.text();
    switch (verdict_.limit.kind) {
      case StepLimit::Kind::limit: return of_limit(runs);
      case StepLimit::Kind::none: return of_none(runs, step);
      case StepLimit::Kind::never: break;
    }
    return of_never(runs, step);
  }

 private:
  using Answer = StepsByRuns::Answer;

  LimitCheck tell(LimitCheck::Kind kind, const std::string& what) {
    using enum LimitCheck::Kind;
    result_.kind = kind;
    if (!verdict_.is_exact && kind == agrees) result_.kind = near_estimate;
    if (!verdict_.is_exact && (kind == too_high || kind == too_low)) result_.kind = estimate;
    result_.detail += "; " + what;
    return result_;
  }

  LimitCheck of_limit(const StepsByRuns& runs) {
    const Answer low = runs.answer(below * limit_), high = runs.answer(above * limit_);
    const std::string excess = fmt::format("excess {:.3g} at {}, {:.3g} at {}", runs.excess(below * limit_), below,
                                           runs.excess(above * limit_), above);
    if (low == Answer::grows) {
      for (const double factor : {0.9, 0.8, 0.7, 0.5, 0.25, 0.1, 0.01}) {
        result_.ratio = factor;
        if (runs.answer(factor * limit_) != Answer::grows) break;
      }
      return tell(LimitCheck::Kind::too_high, fmt::format("{}, runs {}", excess, result_.ratio));
    }
    if (high == Answer::stable) {
      for (const double factor : {1.1, 1.2, 1.4, 2.0, 4.0, 16.0}) {
        result_.ratio = factor;
        if (runs.answer(factor * limit_) == Answer::grows) break;
      }
      return tell(LimitCheck::Kind::too_low, fmt::format("{}, runs {}", excess, result_.ratio));
    }
    return tell(high == Answer::grows ? LimitCheck::Kind::agrees : LimitCheck::Kind::unclear, excess);
  }

  /// None was found up to thousands of the scene's step.
  LimitCheck of_none(const StepsByRuns& runs, double step) {
    bool is_clear = true;
    for (const double factor : {1.0, 8.0, 64.0, 512.0}) {
      const Answer found = runs.answer(factor * step);
      is_clear = is_clear && found == Answer::stable;
      if (found != Answer::grows) continue;
      return tell(LimitCheck::Kind::too_high,
                  fmt::format("grows at {} steps, excess {:.3g}", factor, runs.excess(factor * step)));
    }
    return tell(is_clear ? LimitCheck::Kind::agrees : LimitCheck::Kind::unclear, "");
  }

  LimitCheck of_never(const StepsByRuns& runs, double step) {
    bool is_any = false;
    for (const double factor : {1.0, 4.0, 16.0}) {
      const Answer found = runs.answer(factor * step);
      if (found == Answer::grows) return tell(LimitCheck::Kind::agrees, "");
      is_any = is_any || found == Answer::unclear;
    }
    return tell(is_any ? LimitCheck::Kind::unclear : LimitCheck::Kind::too_low,
                fmt::format("excess {:.3g} at the scene's step, {:.3g} at 4, order {:.3g}", runs.excess(step),
                            runs.excess(4 * step), verdict_.limit.order));
  }

  driver::Session& session_;
  driver::Session* plain_;
  const StabilityReport& verdict_;
  double limit_;
  LimitCheck result_;
};

std::string without_events(const std::string& text) {
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("  after step")) result += line + "\n";
  }
  return result;
}

/// null after an error, which `refusal` has.
std::unique_ptr<driver::Session> opened(const SourceFile& source, std::string& refusal) {
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  options.backend = driver::Backend::jit;
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  std::unique_ptr<driver::Session> session;
  if (compiled && !sink.has_errors())
    session = driver::Session::open(source, std::make_shared<driver::Compiled>(std::move(*compiled)), {}, sink);
  for (const Diagnostic& d : sink.all()) {
    if (d.kind->severity == Severity::error) refusal = render_text(source, d);
  }
  return session;
}

}  // namespace

std::string name_of(LimitCheck::Kind kind) {
  switch (kind) {
    case LimitCheck::Kind::agrees: return "agrees";
    case LimitCheck::Kind::near_estimate: return "near_estimate";
    case LimitCheck::Kind::estimate: return "estimate";
    case LimitCheck::Kind::too_high: return "too_high";
    case LimitCheck::Kind::too_low: return "too_low";
    case LimitCheck::Kind::unclear: return "unclear";
    case LimitCheck::Kind::refused: return "refused";
    case LimitCheck::Kind::not_analysed: return "not_analysed";
  }
  return "";
}

LimitCheck check_limit(const std::string& text) try {
  const SourceFile source("random.dpde", text), plain_source("random.dpde", without_events(text));
  std::string refusal;
  const auto session = opened(source, refusal);
  if (!session) return {LimitCheck::Kind::refused, 1, refusal};
  const auto plain = plain_source.text().size() == text.size() ? nullptr : opened(plain_source, refusal);
  const StabilityReport verdict = stability::verdict_of(*session);
  if (!verdict.is_analysed()) return {LimitCheck::Kind::not_analysed, 1, verdict.why};
  return Check(*session, plain.get(), verdict).run();
} catch (const NoSolution& error) {
  return {LimitCheck::Kind::not_analysed, 1, error.what()};
}

}  // namespace dpde::testing
