// SPDX-License-Identifier: Apache-2.0
// The settings of --set. Their texts are not part of the file, so errors in them have no position.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "model/from_ast/scene/cells_setting.h"
#include "syntax/parser.h"

namespace dpde::model {

namespace {

/// Reports the first message of `own` as an error of a setting.
void report_bad_setting(Elaboration& elaboration, const std::string& key, const std::string& text,
                        const DiagnosticSink& own) {
  const Diagnostic& first = own.all().front();
  elaboration.sink.report("bad-setting", {}, {key, text, first.message}, first.hint);
}

/// The value as an expression; nullopt after a diagnostic.
std::optional<ast::Expr> parse_setting(Elaboration& elaboration, const std::string& key, const std::string& text) {
  DiagnosticSink own;
  const ast::Expr e = ast::parse_expression(SourceFile("--set " + key, text), own);
  if (!own.has_errors()) return e;
  report_bad_setting(elaboration, key, text, own);
  return std::nullopt;
}

std::optional<double> number_in(Elaboration& elaboration, const std::string& key, const std::string& text) {
  const auto e = parse_setting(elaboration, key, text);
  if (!e) return std::nullopt;
  DiagnosticSink own;
  Elaboration alone(elaboration.file, elaboration.selection, own);  // has only numbers, pi and functions
  const auto value = evaluate(alone, *e, "the setting");
  if (!value) report_bad_setting(elaboration, key, text, own);
  return value;
}

}  // namespace

std::optional<double> number_setting(Elaboration& elaboration, const std::string& key) {
  const std::string* text = elaboration.settings.find(key);
  return text ? number_in(elaboration, key, *text) : std::nullopt;
}

std::vector<std::optional<double>> cells_setting(Elaboration& elaboration, std::size_t axes) {
  const std::string* text = elaboration.settings.find("cells");
  std::vector<std::optional<double>> counts(axes);
  if (!text) return counts;
  std::vector<std::string> texts(1);
  int depth = 0;  // of parentheses: max(6, 8) is one number
  for (const char c : *text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (c == ',' && depth == 0) {
      texts.emplace_back();
    } else {
      texts.back() += c;
    }
  }
  if (texts.size() > 1 && texts.size() != axes) {
    elaboration.sink.report("bad-setting", {},
                            {"cells", *text, fmt::format("the scene has {} {}", axes, axes == 1 ? "axis" : "axes")},
                            "write --set cells=64 for all axes, or a number for each");
    return counts;
  }
  const auto first = texts.size() > 1 ? std::nullopt : number_in(elaboration, "cells", *text);
  for (std::size_t axis = 0; axis < axes; ++axis)
    counts[axis] = texts.size() > 1 ? number_in(elaboration, "cells", texts[axis]) : first;
  return counts;
}

void apply_scheme_settings(Elaboration& elaboration) {
  for (const std::string& key : scheme_keys()) {
    const Symbol* meaning = elaboration.names.scope.find(key);
    if (meaning && meaning->role == Role::parameter) continue;  // a parameter of this name has precedence
    const std::string* text = elaboration.settings.find(key);
    if (!text) continue;
    const auto value = parse_setting(elaboration, key, *text);
    if (!value) continue;
    const auto refusal = set_scheme_key(elaboration.problem.scheme, key, *value);
    if (!refusal) continue;
    elaboration.sink.report("bad-setting", {}, {key, *text, "there is no such choice"},
                            fmt::format("choose one of: {}", fmt::join(refusal->choices, ", ")));
  }
}

Scheme with_settings(Scheme scheme, const std::map<std::string, std::string>& rows) {
  for (const auto& [key, text] : rows) {
    DiagnosticSink unread;
    set_scheme_key(scheme, key, ast::parse_expression(SourceFile("--set " + key, text), unread));
  }
  return scheme;
}

void check_settings(Elaboration& elaboration) {
  const std::vector<std::string>& known = elaboration.settings.known();
  for (const auto& [key, text] : elaboration.settings.texts()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    elaboration.sink.report("unknown-setting", {}, {key}, [&] { return did_you_mean(key, known); });
  }
}

}  // namespace dpde::model
