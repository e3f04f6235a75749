// SPDX-License-Identifier: Apache-2.0
#include "model/from_ast/names/names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "source/diagnostic.h"
#include "support/assert.h"
#include "support/names/bound_names.h"
#include "support/names/wave_names.h"
#include "support/side_conditions.h"

namespace dpde::model {

namespace {

constexpr std::string_view axis_letters[] = {"x", "y", "z"};
constexpr std::size_t longest_list = 20;

constexpr std::string_view reserved_words[] = {
    "pi",     "if", "and", "or",  "not",   "let",  "loss", "courant_rate", "inside",
    "interp", "in", "out", "sum", "inout", "grow", "all",  "param",
};

}  // namespace

std::string_view word_for(Role role) {
  switch (role) {
    case Role::state: return "field";
    case Role::coefficient: return "coefficient";
    case Role::parameter: return "parameter";
    case Role::datum: return "datum";
    case Role::let: return "let";
    case Role::coordinate: return "coordinate";
    case Role::time: return "time";
    case Role::constant: return "constant";
  }
  unreachable("role");
}

Scope::Scope() {
  for (int axis = 0; axis < 3; ++axis) declare(axis_name(axis), {Role::coordinate, {}, axis});
  declare("t", {Role::time, {}});
  declare("pi", {Role::constant, {}});
}

const Symbol* Scope::find(const std::string& name) const {
  const auto found = meanings_.find(name);
  return found == meanings_.end() ? nullptr : &found->second;
}

bool Scope::is_refused(const std::string& name) const {
  return refused_.contains(name) || refused_.contains(vector_of(name));
}

std::vector<std::string> Scope::names() const {
  std::vector<std::string> result;
  for (const auto& [name, meaning] : meanings_) result.push_back(name);
  return result;
}

std::vector<std::string> Scope::names(Role role) const {
  std::vector<std::string> result;
  for (const auto& [name, meaning] : meanings_) {
    if (meaning.role == role) result.push_back(name);
  }
  return result;
}

bool is_reserved(const std::string& name) {
  if (name.ends_with("_bar") || name.ends_with("_dot")) return true;  // names of derivatives
  constexpr std::string_view noise = "noise_";                        // names of noise fields
  if (name.starts_with(noise) && name.find_first_not_of("0123456789", noise.size()) == std::string::npos) return true;
  return find_bound_name(name) || is_side_word(name) ||
         std::find(std::begin(wave_names), std::end(wave_names), name) != std::end(wave_names) ||
         std::find(std::begin(reserved_words), std::end(reserved_words), name) != std::end(reserved_words);
}

std::string vector_of(const std::string& name) {
  const std::size_t dot = name.find('.');
  return dot == std::string::npos ? "" : name.substr(0, dot);
}

int axis_of(std::string_view name) {
  const auto* found = std::find(std::begin(axis_letters), std::end(axis_letters), name);
  return found == std::end(axis_letters) ? -1 : static_cast<int>(found - std::begin(axis_letters));
}

std::string axis_name(int axis) { return std::string(axis_letters[axis]); }

std::string rated_field(std::string_view written) {
  const bool is_rate = written.starts_with("dt(") && written.ends_with(")");
  return is_rate ? std::string(written.substr(3, written.size() - 4)) : "";
}

std::string name_beside(const std::string& field, const std::string& suffix) {
  const std::string vector = vector_of(field);
  return vector.empty() ? field + suffix : vector + suffix + field.substr(vector.size());
}

std::string velocity_name(const std::string& field) { return name_beside(field, "_t"); }

std::string state_name(const std::string& written) {
  const std::string field = rated_field(written);
  return field.empty() ? written : velocity_name(field);
}

std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string near = nearest_name(name, candidates);
  if (!near.empty()) return fmt::format("did you mean {}?", near);
  if (candidates.empty()) return "";
  const auto end = candidates.begin() + static_cast<long>(std::min(candidates.size(), longest_list));
  return fmt::format("known here: {}{}", fmt::join(candidates.begin(), end, ", "),
                     candidates.size() > longest_list ? ", ..." : "");
}

std::string counted(int count, std::string_view what) {
  if (count != 1 && what == "axis") return fmt::format("{} axes", count);
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace dpde::model
