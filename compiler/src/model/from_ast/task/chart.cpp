// SPDX-License-Identifier: Apache-2.0
// chart NAME : SCENE { reference exact; vary scheme in a, b; vary cells in 64, 128; error l2(u) at t = 1;
// gradient TASK; tolerance 1e-3 }
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "model/chart_from_ast.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "syntax/expand/arrays.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

constexpr double most_cells = 1e9;

class ChartReader {
 public:
  ChartReader(const ast::Chart& source, Elaboration& elaboration) : source_(source), elaboration_(elaboration) {}

  Chart read() {
    chart_.name = source_.name.name;
    chart_.range = source_.name.range;
    chart_.scene = source_.of.name;
    require<ast::Scene>("scene", source_.of);
    if (source_.scheme) {
      chart_.scheme = source_.scheme->name;
      require<ast::Scheme>("scheme", *source_.scheme);
    }
    for (const auto& [item, range] : items_of<ast::ReferenceItem>(source_.items)) {
      refuse_second("reference", range);
      read_reference(item.value);
    }
    for (const auto& [item, range] : items_of<ast::ChoicesItem>(source_.items)) read_choices(item);
    for (const auto& [item, range] : items_of<ast::ErrorItem>(source_.items)) {
      refuse_second("error", range);
      read_error(item);
    }
    for (const auto& [item, range] : items_of<ast::OptionItem>(source_.items)) {
      refuse_second(item.name.name, range);
      if (item.name.name == "gradient") read_gradient(item.value);
      if (item.name.name == "tolerance") chart_.tolerance = positive(item.value, "tolerance");
    }
    return chart_;
  }

 private:
  void fail(SourceRange where, const std::string& option, const std::string& what, std::string hint = {}) {
    elaboration_.sink.report("bad-optimiser-option", where, {option, "chart " + chart_.name, what}, std::move(hint));
  }

  void refuse_second(const std::string& what, SourceRange range) {
    const auto [first, is_new] = seen_.emplace(what, range);
    if (!is_new) report_duplicate(elaboration_, what, range, first->second);
  }

  template <class Kind>
  void require(const char* what, const ast::Identifier& name) {
    if (find_declaration<Kind>(elaboration_.file, name.name) != nullptr) return;
    elaboration_.sink.report("unknown-block", name.range, {what, name.name},
                             did_you_mean(name.name, names_of<Kind>(elaboration_.file)));
  }

  double positive(const ast::Expr& e, const std::string& what) {
    const double value = evaluate(elaboration_, e, "a number of a chart").value_or(1);
    if (!(value > 0)) fail(e.range(), what, fmt::format("must be positive, not {}", value));
    return value;
  }

  int cells(const ast::Expr& e, const std::string& what, int least) {
    const double value = evaluate(elaboration_, e, "a number of a chart").value_or(least);
    if (value >= least && value <= most_cells && value == std::floor(value)) return static_cast<int>(value);
    fail(e.range(), what, fmt::format("is a whole number from {} on, not {}", least, value));
    return least;
  }

  void read_reference(const ast::Expr& value) {
    chart_.reference_range = value.range();
    const auto* word = std::get_if<ast::Name>(&value->kind);
    const auto* call = std::get_if<ast::Call>(&value->kind);
    const bool is_self = call && call->callee == "self" && call->arguments.size() == 1 &&
                         (call->arguments[0].name.empty() || call->arguments[0].name == "cells");
    if (word && word->name == "exact") {
      chart_.reference = Chart::Reference::exact;
    } else if (word && word->name == "manufactured") {
      chart_.reference = Chart::Reference::manufactured;
    } else if (is_self) {
      chart_.reference = Chart::Reference::self;
      chart_.reference_cells = cells(call->arguments[0].value, "self(cells)", 2);
    } else {
      fail(value.range(), "reference", "is exact, manufactured or self(cells = N), a finer run");
    }
  }

  std::string choice_of(const std::string& key, const ast::Expr& e) {
    if (key == "cells") return fmt::format("{}", cells(e, "vary cells", 1));
    if (key == "step" || key == "fraction") return fmt::format("{}", positive(e, "vary " + key));
    std::string text = ast::print(e);
    if (key == "scheme") {
      require<ast::Scheme>("scheme", {text, e.range()});
      return text;
    }
    Scheme scheme;
    const auto refusal = set_scheme_key(scheme, key, e);
    if (refusal)
      elaboration_.sink.report("bad-scheme-value", e.range(), {key, text},
                               fmt::format("choose one of: {}", fmt::join(refusal->choices, ", ")));
    return text;
  }

  void read_choices(const ast::ChoicesItem& item) {
    const std::string& key = item.key.name;
    refuse_second("vary " + key, item.key.range);
    std::vector<std::string> keys{"scheme", "cells", "step", "fraction"};
    keys.insert(keys.end(), scheme_keys().begin(), scheme_keys().end());
    if (std::ranges::find(keys, key) == keys.end()) {
      elaboration_.sink.report("unknown-scheme-key", item.key.range, {key}, did_you_mean(key, keys));
      return;
    }
    Chart::Choices choices{key, {}};
    for (const ast::Expr& value : item.values) choices.values.push_back(choice_of(key, value));
    chart_.vary.push_back(std::move(choices));
  }

  void read_error(const ast::ErrorItem& item) {
    for (const ast::Expr& e : item.norms) {
      const auto* call = std::get_if<ast::Call>(&e->kind);
      const auto* field =
          call && call->arguments.size() == 1 ? std::get_if<ast::Name>(&call->arguments[0].value->kind) : nullptr;
      bool is_norm = false;
      for (const ErrorNorm norm : {ErrorNorm::l1, ErrorNorm::l2, ErrorNorm::linf}) {
        if (field == nullptr || call->callee != name_of(norm)) continue;
        chart_.errors.push_back({field->name, norm, call->arguments[0].value.range()});
        is_norm = true;
      }
      if (!is_norm) fail(e.range(), "error", "is made of l1(field), l2(field) and linf(field)");
    }
    if (item.at) chart_.end = evaluate(elaboration_, *item.at, "a time");
  }

  void read_gradient(const ast::Expr& e) {
    const auto* name = std::get_if<ast::Name>(&e->kind);
    const auto* task = name ? find_declaration<ast::Task>(elaboration_.file, name->name) : nullptr;
    if (!name) return fail(e.range(), "gradient", "is the name of a task");
    chart_.gradient = name->name;
    require<ast::Task>("task", {name->name, e.range()});
    if (task && task->of.name != chart_.scene)
      fail(e.range(), "gradient", fmt::format("is that of a task of scene {}, not of {}", chart_.scene, task->of.name));
  }

  const ast::Chart& source_;
  Elaboration& elaboration_;
  Chart chart_;
  std::map<std::string, SourceRange> seen_;
};

}  // namespace

std::optional<Chart> chart_from_ast(const ast::File& file, const std::string& name, DiagnosticSink& sink) {
  const std::optional<ast::File> written = ast::with_elements(file, sink);
  if (!written) return std::nullopt;
  const ast::Chart* source = find_declaration<ast::Chart>(*written, name);
  const Selection nothing;
  Elaboration elaboration(*written, nothing, sink);
  Chart chart = ChartReader(*source, elaboration).read();
  return sink.has_errors() ? std::nullopt : std::optional(std::move(chart));
}

std::vector<std::string> chart_names(const ast::File& file) { return names_of<ast::Chart>(file); }

}  // namespace dpde::model
