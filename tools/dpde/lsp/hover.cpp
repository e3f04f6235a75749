// SPDX-License-Identifier: Apache-2.0
#include "lsp/hover.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "lsp/cursor_place.h"
#include "lsp/word_texts.h"
#include "model/analyse/placement.h"
#include "model/print/words.h"

namespace dpde::lsp {

namespace {

constexpr std::size_t most_scenes = 3;

/// A row of a scheme as it is written in a source.
std::string row_of(const model::Scheme& scheme, std::string_view key) {
  const int order = key == "lap" ? scheme.laplacian_order : scheme.derivative_order;
  if (key == "advect") {
    return scheme.transport.order == model::spectral ? "advect by Fourier series"
                                                     : fmt::format("advect of order {}", scheme.transport.order);
  }
  if (order == model::spectral) return fmt::format("{} = spectral", key);
  return fmt::format("{0} = central({1}), of order {1}", key, order);
}

std::string cells_of(const model::Problem& problem) {
  if (!problem.has_grid) return "no grid";
  std::vector<int> cells;
  for (const model::Axis& axis : problem.axes) cells.push_back(axis.cells);
  return fmt::format("{} cells", fmt::join(cells, " x "));
}

std::string place_of(const model::Problem& problem, const model::Placement& placement) {
  const bool is_at_centres = placement == model::Placement{};
  return (is_at_centres ? "at " : "on ") + model::describe(placement, static_cast<int>(problem.axes.size()));
}

/// Whether `full` is the name, one of its components, or the first element of an array.
bool is_called(const std::string& full, const DeclaredName& name) {
  return full == name.name || full.starts_with(name.name + ".") ||
         (name.is_array && full.starts_with(name.name + "_1"));
}

/// The unit of the name, or of its first component or element.
std::string unit_of(const model::Problem& problem, const DeclaredName& name) {
  for (const auto& [full, unit] : problem.remarks.units) {
    if (is_called(full, name)) return unit;
  }
  return "";
}

/// Description of the name in the scene, without its unit; "" if the scene does not use it.
std::string fact(const model::Problem& problem, const DeclaredName& name, const OrderText& order) {
  for (const model::State& state : problem.states) {
    if (!state.history_of.empty() || !is_called(state.name, name)) continue;
    return fmt::format("{}, {}; {}", place_of(problem, state.placement), cells_of(problem), order(problem));
  }
  for (const model::Coefficient& given : problem.coefficients) {
    if (is_called(given.name, name))
      return fmt::format("{}, {}", place_of(problem, given.placement), cells_of(problem));
  }
  for (const model::Parameter& parameter : problem.params) {
    if (is_called(parameter.name, name))
      return fmt::format("{} = {}{}", parameter.name, parameter.value, parameter.unknown ? ", sought" : "");
  }
  return "";
}

std::string facts_of_block(const model::Problem& problem, const OrderText& order) {
  return fmt::format("{}, {} steps of {:.6g}; {}", cells_of(problem), problem.steps, problem.step, order(problem));
}

/// Descriptions in the scenes and tasks that use the block of the declaration.
std::string facts_of(const Document& document, const DeclaredName& name, const OrderText& order) {
  std::string text;
  std::size_t told = 0;
  for (const auto& [block, problem] : document.problems()) {
    const std::set<int> known = blocks_known_to(document.file(), {block});
    const bool is_block = name.block < 0 && block == name.name;
    if (told == most_scenes || (!is_block && !known.contains(name.block))) continue;
    std::string found = is_block ? facts_of_block(problem, order) : fact(problem, name, order);
    const std::string unit = is_block ? "" : unit_of(problem, name);
    if (!unit.empty()) found += (found.empty() ? "in " : "; in ") + unit;
    if (found.empty()) continue;
    text += fmt::format("\n- `{}`: {}", block, found);
    ++told;
  }
  return text;
}

std::string block_of(const Document& document, const DeclaredName& name) {
  if (name.block < 0) return "";
  const ast::Declaration& declaration = document.file().declarations[static_cast<std::size_t>(name.block)];
  const ast::Identifier* block = name_of(declaration);
  return fmt::format(" of {} {}", word_of(declaration), block == nullptr ? "" : block->name);
}

std::string told(const Document& document, const DeclaredName& name, const OrderText& order) {
  const std::string_view all = document.whole().text();
  const auto begin = static_cast<std::size_t>(name.line.begin);
  std::string line(all.substr(begin, static_cast<std::size_t>(std::max(0, name.line.end - name.line.begin))));
  while (line.ends_with(' ') || line.ends_with('\n')) line.pop_back();
  return fmt::format("```dpde\n{}\n```\n{}{}{}", line, name.word, block_of(document, name),
                     facts_of(document, name, order));
}

std::string told(const WordText& text) { return fmt::format("```dpde\n{}\n```\n{}", text.usage, text.text); }

/// Description of a word of the language in its context.
std::string told_of_word(const Document& document, const ast::Token& word, const CursorPlace& place) {
  const std::string_view block = place.blocks.empty() ? std::string_view() : place.blocks.front();
  if (place.begins_line() && place.blocks.empty()) {
    if (const WordText* text = text_of_block(word.spelling)) return told(*text);
  }
  if (place.begins_line() && block == "scheme") {
    const WordText* text = text_of_key(word.spelling);
    return text == nullptr ? ""
                           : fmt::format("{}\n\none of: {}", told(*text),
                                         fmt::join(model::choices_of(std::string(word.spelling)), ", "));
  }
  if (place.begins_line()) {
    if (const WordText* text = text_of_line(block, word.spelling)) return told(*text);
  }
  const WordText* text = text_of_function(word.spelling);
  if (text == nullptr) return "";
  std::string result = told(*text);
  const std::string_view key = key_of_function(word.spelling);
  std::size_t count = 0;
  for (const auto& [name, problem] : document.problems()) {
    if (!key.empty() && count++ < most_scenes) result += fmt::format("\n- `{}`: {}", name, row_of(problem.scheme, key));
  }
  return result;
}

}  // namespace

Json hover(const Document& document, int offset, const OrderText& order) {
  const ast::Token word = word_at(document.source(), offset);
  if (word.kind != ast::TokenKind::identifier) return nullptr;
  const DeclaredName* name = document.find(offset);
  const std::string text = name != nullptr
                               ? told(document, *name, order)
                               : told_of_word(document, word, cursor_place(document.source(), word.range.begin));
  if (text.empty()) return nullptr;
  return {{"contents", {{"kind", "markdown"}, {"value", text}}}, {"range", document.places().range(word.range)}};
}

Json inlay_hints(const Document& document, const OrderText& order) {
  const TextPlaces places = document.places();
  Json hints = Json::array();
  const auto add = [&](int offset, const std::string& label) {
    hints.push_back(Json{{"position", places.position(offset)}, {"label", label}, {"paddingLeft", true}});
  };
  for (const DeclaredName& name : document.names()) {
    if (document.whole().is_imported(name.range.begin)) continue;
    const auto problem = document.problems().find(name.name);
    const bool is_scene = name.block < 0 && name.word == "scene" && problem != document.problems().end();
    if (is_scene) add(name.line.end, order(problem->second));
    if (name.word != "let" && name.word != "observable") continue;
    for (const auto& [block, scene] : document.problems()) {
      const std::string unit =
          blocks_known_to(document.file(), {block}).contains(name.block) ? unit_of(scene, name) : "";
      if (unit.empty()) continue;
      add(name.range.end, "in " + unit);
      break;
    }
  }
  return hints;
}

}  // namespace dpde::lsp
