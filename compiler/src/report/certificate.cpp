// SPDX-License-Identifier: Apache-2.0
#include "report/certificate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "analysis/certificate/run_check.h"

namespace dpde::report {

namespace {

/// Values below rounding are not printed, as they were not measured.
std::string quotients_text(const analysis::QuotientEvidence& quotients, const char* of = "",
                           const char* to = "gradient") {
  if (!quotients.is_resolved(analysis::largest_quotient_error)) return "no difference quotient rises above rounding";
  const std::string where = quotients.is_elsewhere ? fmt::format("agree on another number, the {} is off by", to)
                                                   : fmt::format("from both sides come to the {} within", to);
  return fmt::format("difference quotients {}{} {:.1e} (rounding {:.1e})", of, where, *quotients.error,
                     quotients.rounding);
}

std::string jump_text(const analysis::JumpOnLine& jump) {
  return fmt::format("the loss jumps by {:.2e} at {:.2e} from the point, which no derivative tells", jump.size,
                     std::abs(jump.at));
}

/// The error, or the difference of two numbers that are 0 except for rounding.
std::string error_text(const analysis::DotCase& one) {
  if (one.is_zero) return "both are 0";
  if (!one.is_rounding) return fmt::format("{:.2e}", one.relative_error);
  return fmt::format("below rounding: they differ by {:.1e} of {:.1e}", one.difference, one.rounding);
}

Json details_of(const std::vector<analysis::DotCase>& cases) {
  Json details = Json::array();
  for (const analysis::DotCase& one : cases) {
    details.push_back({{"cells", one.grid},
                       {"what", one.what},
                       {"relative_error", one.is_rounding ? Json(nullptr) : json_number(one.relative_error)},
                       {"difference", json_number(one.difference)},
                       {"rounding", json_number(one.rounding)},
                       {"below_rounding", one.is_rounding},
                       {"both_zero", one.is_zero}});
  }
  return details;
}

std::string quotients_of_hessian(const analysis::QuotientEvidence& quotients) {
  return quotients_text(quotients, "of the gradient ", "Hessian");
}

std::string second_order_text(const analysis::Certificate& certificate) {
  if (!certificate.second) return "no second derivatives\n";
  const analysis::SecondOrderCheck& second = *certificate.second;
  std::string text =
      fmt::format("Hessian: v.Hw against w.Hv on {} grids, at most {:.2e}; ", second.cases.size(), second.worst());
  text += second.slope
              ? fmt::format("slope of the remainder {:.4f}", *second.slope)
              : "no slope of the remainder: " + std::string(second.only_rounding ? "it is rounding" : "it shows none");
  if (second.has_kinks) text += " (the programs have kinks, so it is not judged)";
  if (second.quotients) text += "\n  " + quotients_of_hessian(*second.quotients);
  if (certificate.tests_nothing()) return text + "\nHessian: nothing to certify\n";
  if (second.has_kinks && second.passed()) return text + "\n";
  return text + (second.passed() ? "\nHessian: certified\n" : "\nHessian: NOT certified\n");
}

/// Warns of a kink at the start; the certificate is for a nearby point.
std::string kink_text(const analysis::KinkAtStart& kink) {
  return fmt::format(
      "the start lies on a kink of the loss: by {0}{4} it has the slopes {1:.6g} behind and {2:.6g} ahead, the "
      "gradient "
      "says {3:.6g}\n",
      kink.unknown, kink.behind, kink.ahead, kink.gradient,
      kink.is_along_a_line ? ", whose values move by 0.5 to 1.5 each," : "");
}

/// `compiled`: what was certified; in f64 for a scene in f32.
std::string verdict_of(const analysis::Certificate& certificate, const driver::Compiled& compiled) {
  if (!certificate.passed()) return "NOT certified";
  if (certificate.tests_nothing()) return "nothing to certify";
  std::string text;
  std::vector<std::string> exceptions;
  if (!certificate.untested.empty()) {
    exceptions.push_back(fmt::format("{}", fmt::join(certificate.untested, ", ")));
    text = fmt::format("by {} the derivative is 0, or below rounding, and was not tested: {}\n", exceptions.back(),
                       analysis::causes_of_zero(compiled));
  }
  if (!compiled.jumps_left_out.empty()) {
    exceptions.emplace_back("jumps (W0609)");
  } else if (certificate.is_jump_of_scheme) {
    exceptions.emplace_back("jumps at the bounds of maccormack");
  }
  if (certificate.second && !certificate.second->passed()) exceptions.emplace_back("the Hessian");
  if (exceptions.empty()) return "certified";
  return fmt::format("{}certified but for {}", text, fmt::join(exceptions, " and for "));
}

/// For a task that learns from trajectories.
std::string begin_text(const driver::FirstWindow& window) {
  if (window.start) return ", " + driver::text_of(*window.start);
  if (window.missing.empty()) return "";
  return fmt::format(", from the scene's own start: no frame of data is at hand ({})", window.missing);
}

Json begin_json(const driver::FirstWindow& window) {
  if (window.start) {
    const driver::WindowStart& start = *window.start;
    return {{"file", start.path}, {"run", start.run}, {"frame", start.frame}, {"t", json_number(start.t)}};
  }
  return window.missing.empty() ? Json(nullptr) : Json{{"file", nullptr}, {"reason", window.missing}};
}

std::string certificate_text(const std::string& target, const analysis::Certificate& certificate,
                             const driver::Compiled& compiled) {
  std::string text = fmt::format("{}: tangent against adjoint{}\n", target, begin_text(certificate.window));
  for (const analysis::DotCase& one : certificate.cases) {
    text += fmt::format("  {:<16} {:<24} {}\n", one.grid, one.what, error_text(one));
  }
  for (const std::string& skipped : certificate.skipped) text += fmt::format("  {}\n", skipped);
  text += "Taylor remainder of the gradient\n";
  for (std::size_t k = 0; k < certificate.remainders.size(); k += 3) {
    text += fmt::format("  step {:<10.3e} remainder {:.3e}\n", certificate.remainders[k].step,
                        certificate.remainders[k].value);
  }
  text += certificate.slope ? fmt::format("  slope {:.4f} ({})\n", *certificate.slope, certificate.note)
                            : fmt::format("  no slope: {}\n", certificate.note);
  if (certificate.quotients) text += fmt::format("  {}\n", quotients_text(*certificate.quotients));
  if (certificate.jump) text += fmt::format("  {}\n", jump_text(*certificate.jump));
  text += second_order_text(certificate);
  for (const analysis::KinkAtStart& kink : certificate.kinks) text += kink_text(kink);
  if (certificate.single) {
    text += fmt::format(
        "single precision: the above is of the same programs in f64; tangent against adjoint in f32 on {} grids, at "
        "most {:.2e}\n",
        certificate.single->cases.size(), certificate.single->worst());
  }
  return text + fmt::format("{}: {}\n", verdict_of(certificate, compiled), reason_of(certificate));
}

Json certificate_json(const analysis::Certificate& certificate) {
  Json remainders = Json::array();
  for (const analysis::Remainder& r : certificate.remainders)
    remainders.push_back({json_number(r.step), json_number(r.value)});
  const analysis::SecondOrderCheck* second = certificate.second ? &*certificate.second : nullptr;
  Json hessian = nullptr;
  if (second != nullptr) {
    hessian = {{"max_relative_error", json_number(second->worst())},
               {"cases", second->cases.size()},
               {"details", details_of(second->cases)},
               {"has_kinks", second->has_kinks},
               {"quotient_error",
                second->quotients && second->quotients->error ? json_number(*second->quotients->error) : Json(nullptr)},
               {"passed", second->passed()}};
  }
  const analysis::QuotientEvidence* quotients = certificate.quotients ? &*certificate.quotients : nullptr;
  Json single = nullptr;
  if (certificate.single)
    single = {{"max_relative_error", json_number(certificate.single->worst())},
              {"cases", certificate.single->cases.size()}};
  Json kinks = Json::array();
  for (const analysis::KinkAtStart& kink : certificate.kinks) {
    kinks.push_back({{"unknown", kink.unknown},
                     {"behind", json_number(kink.behind)},
                     {"ahead", json_number(kink.ahead)},
                     {"gradient", json_number(kink.gradient)}});
  }
  return {{"hessian", hessian},
          {"single_precision", single},
          {"dot_product",
           {{"max_relative_error", certificate.is_all_rounding() ? Json(nullptr) : json_number(certificate.worst())},
            {"below_rounding", certificate.is_all_rounding()},
            {"cases", certificate.cases.size()},
            {"details", details_of(certificate.cases)},
            {"skipped", certificate.skipped}}},
          {"taylor",
           {{"slope", certificate.slope ? json_number(*certificate.slope) : Json(nullptr)},
            {"slope_second", second && second->slope ? json_number(*second->slope) : Json(nullptr)},
            {"quotient_error", quotients && quotients->error ? json_number(*quotients->error) : Json(nullptr)},
            {"quotient_rounding", quotients && quotients->error ? json_number(quotients->rounding) : Json(nullptr)},
            {"remainders", remainders},
            {"jump", certificate.jump ? json_number(certificate.jump->size) : Json(nullptr)},
            {"note", certificate.note}}},
          {"start_is_finite", certificate.start_is_finite},
          {"start_kinks", kinks},
          {"untested", certificate.untested},
          {"window", begin_json(certificate.window)},
          {"passed", certificate.passed()}};
}

}  // namespace

std::string reason_of(const analysis::Certificate& certificate) {
  if (certificate.is_all_zero()) return "all derivatives are 0: nothing was tested";
  if (certificate.passed() && certificate.tests_nothing())
    return "all derivatives are 0 but for rounding: nothing was tested";
  std::string reason = certificate.is_all_rounding()
                           ? "all derivatives are 0 but for rounding"
                           : fmt::format("largest dot-product error {:.2e}", certificate.worst());
  if (certificate.jump) reason = jump_text(*certificate.jump) + "; " + reason;
  if (!certificate.jump_at_start.empty()) reason = certificate.jump_at_start + ", where it jumps; " + reason;
  if (!certificate.start_is_finite) reason = "at the start itself the loss or its gradient is not finite; " + reason;
  if (certificate.second && certificate.second->is_wrong()) {
    reason += fmt::format(", Hessian unsymmetric by {:.2e}", certificate.second->worst());
    if (certificate.second->quotients) reason += ", " + quotients_of_hessian(*certificate.second->quotients);
  }
  if (certificate.single && !certificate.single->passed())
    reason += fmt::format(", in single precision {:.2e}", certificate.single->worst());
  if (certificate.quotients) return reason + ", " + quotients_text(*certificate.quotients);
  if (certificate.slope) return reason + fmt::format(", Taylor slope {:.3f}", *certificate.slope);
  return reason + (certificate.note.empty() ? "" : ", " + certificate.note);
}

Report report_of_certificate(const std::string& target, const analysis::Certificate& certificate,
                             const driver::Compiled& compiled) {
  Report report;
  report.say(certificate_text(target, certificate, compiled));
  report.json = certificate_json(certificate);
  return report;
}

Report report_of_tolerance(const analysis::ToleranceEffect& effect, bool is_tighter) {
  Report report;
  const Json reference = effect.reference > 0 ? Json(effect.reference) : Json(nullptr);
  report.json["solves"] = {{"tolerance", effect.tolerance},
                           {"gradient_error", nullptr},
                           {"gradient_bound", nullptr},
                           {"stopped_early", effect.left > 0 ? json_number(effect.left) : Json(nullptr)},
                           {"measured_against", reference}};
  if (!effect.is_by_steps) {
    report.say("solves: by factors or transforms, to rounding\n");
    return report;
  }
  report.json["solves"]["gradient_error"] = json_number(effect.error);
  report.json["solves"]["gradient_bound"] = json_number(effect.bound);
  const std::string how =
      effect.reference > 0 ? fmt::format("{:.1e} (measured against solves to {:.0e})", effect.error, effect.reference)
                           : fmt::format("about {:.1e} (an estimate)", effect.error);
  const std::string to = effect.left > 0
                             ? fmt::format("stopped early, with up to {:.3g} of the right side left", effect.left)
                             : fmt::format("to {:.0e} of the right side", effect.tolerance);
  report.say(fmt::format("solves: {}, which leaves an error of {} in the gradient, at most {:.1e}{}\n", to, how,
                         effect.bound, is_tighter ? "; the certificate is of solves to 1e-12" : ""));
  return report;
}

}  // namespace dpde::report
