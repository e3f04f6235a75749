// SPDX-License-Identifier: Apache-2.0
#include "chart/points_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/files.h"

namespace dpde::chart {

namespace {

Json variant_json(const Variant& variant) {
  Json json = Json::object();
  for (const auto& [key, value] : variant.method) json[key] = value;
  for (const auto& [key, value] : variant.resolution) json[key] = value;
  return json;
}

Json errors_json(const std::map<std::string, double>& errors) {
  Json json = Json::object();
  for (const auto& [name, error] : errors) json[name] = json_number(error);
  return json;
}

double number_from(const Json& json) { return json.is_number() ? json.get<double>() : NAN; }

void read_measured(const Json& json, const std::string& prefix, Measured& measured) {
  measured.error = number_from(json.at(prefix + "error"));
  measured.seconds = json.at(prefix + "wall_s").is_null() ? 0 : json.at(prefix + "wall_s").get<double>();
  measured.low_quartile = json.at(prefix + "wall_s_quartiles")[0];
  measured.high_quartile = json.at(prefix + "wall_s_quartiles")[1];
  measured.samples = json.at(prefix + "wall_s_samples").get<std::vector<double>>();
  measured.memory_bytes = json.at(prefix + "memory_bytes");
}

void write_measured(const Measured& measured, const std::string& prefix, bool has_error, Json& json) {
  json[prefix + "error"] = has_error ? json_number(measured.error) : Json(nullptr);
  json[prefix + "wall_s"] = measured.seconds > 0 ? Json(measured.seconds) : Json(nullptr);
  json[prefix + "wall_s_quartiles"] = {measured.low_quartile, measured.high_quartile};
  json[prefix + "wall_s_samples"] = measured.samples;
  json[prefix + "memory_bytes"] = measured.memory_bytes;
  json[prefix + "pareto"] = measured.is_pareto;
}

Json part_json(const Budget::Part& part) {
  return {{"error", json_number(part.error)}, {"order", part.order > 0 ? Json(part.order) : Json(nullptr)}};
}

Json budget_json(const Budget& budget) {
  if (!budget.failure.empty()) return {{"failure", budget.failure}};
  return {{"measure", budget.measure},
          {"space", part_json(budget.space)},
          {"time", part_json(budget.time)},
          {"rounding", budget.rounding ? json_number(*budget.rounding) : Json(nullptr)},
          {"solves", budget.solves ? json_number(*budget.solves) : Json(nullptr)},
          {"sum", json_number(budget.sum)},
          {"largest", budget.largest()},
          {"failure", nullptr}};
}

Budget::Part part_from(const Json& json) {
  return {number_from(json.at("error")), json.at("order").is_null() ? 0 : json.at("order").get<double>()};
}

Budget budget_from(const Json& json) {
  Budget budget;
  if (!json.at("failure").is_null()) {
    budget.failure = json.at("failure");
    return budget;
  }
  budget.measure = json.at("measure");
  budget.space = part_from(json.at("space"));
  budget.time = part_from(json.at("time"));
  if (!json.at("rounding").is_null()) budget.rounding = number_from(json.at("rounding"));
  if (!json.at("solves").is_null()) budget.solves = number_from(json.at("solves"));
  budget.sum = number_from(json.at("sum"));
  return budget;
}

constexpr std::pair<Outcome, const char*> outcomes[] = {
    {Outcome::ran, "ran"},
    {Outcome::does_not_fit, "does not fit"},
    {Outcome::above_limit, "step above the limit"},
    {Outcome::never_stable, "unstable at every step"},
    {Outcome::blew_up, "blew up"},
    {Outcome::failed, "failed"},
};
const char* word_of(Outcome outcome) {
  return std::ranges::find(outcomes, outcome, &std::pair<Outcome, const char*>::first)->second;
}
/// @throws JsonError for an unknown word.
Outcome outcome_from(const std::string& word) {
  for (const auto& [outcome, known] : outcomes) {
    if (word == known) return outcome;
  }
  throw JsonError("no outcome " + word);
}

Point point_from(const Json& json) {
  Point point;
  point.failure = json.at("failure").is_null() ? "" : json.at("failure").get<std::string>();
  point.outcome = outcome_from(json.at("outcome").get<std::string>());
  point.cells = json.at("cells").get<std::vector<int>>();
  point.step = json.at("step");
  point.steps = json.at("steps");
  point.is_above_limit = point.outcome == Outcome::ran && !json.at("stable").get<bool>();
  point.largest_step = json.at("max_step").is_null() ? 0 : json.at("max_step").get<double>();
  for (const auto& [name, error] : json.at("errors").items()) point.errors[name] = number_from(error);
  read_measured(json, "", point);
  point.compile_seconds = json.at("compile_s");
  point.cost = {json.at("bytes_per_point"), json.at("flops_per_point")};
  if (json.contains("budget")) point.budget = budget_from(json.at("budget"));
  if (!json.contains("gradient_failure")) return point;
  for (const auto& [name, error] : json.at("gradient_errors").items()) point.gradient_errors[name] = number_from(error);
  point.gradient_failure = json.at("gradient_failure").is_null() ? "" : json.at("gradient_failure").get<std::string>();
  if (!json.at("gradient_wall_s").is_null()) read_measured(json, "gradient_", point.gradient.emplace());
  return point;
}

}  // namespace

Json point_json(const Point& point) {
  Json json = {{"variant", variant_json(point.variant)},
               {"cells", point.cells},
               {"step", point.step},
               {"steps", point.steps},
               {"errors", errors_json(point.errors)},
               {"compile_s", point.compile_seconds},
               {"bytes_per_point", point.cost.bytes},
               {"flops_per_point", point.cost.flops},
               {"max_step", point.largest_step > 0 ? Json(point.largest_step) : Json(nullptr)},
               {"outcome", word_of(point.outcome)},
               {"stable", !point.is_unstable() && !point.is_above_limit},
               {"fits", !point.does_not_fit()},
               {"failure", point.failure.empty() ? Json(nullptr) : Json(point.failure)}};
  write_measured(point, "", point.failure.empty(), json);
  if (point.budget) json["budget"] = budget_json(*point.budget);
  if (!point.gradient && point.gradient_failure.empty()) return json;
  write_measured(point.gradient.value_or(Measured{}), "gradient_", point.gradient.has_value(), json);
  json["gradient_errors"] = errors_json(point.gradient_errors);
  json["gradient_failure"] = point.gradient_failure.empty() ? Json(nullptr) : Json(point.gradient_failure);
  return json;
}

bool PointsFile::open(const std::string& folder, const std::string& chart, bool resume, DiagnosticSink& sink) {
  path_ = std::filesystem::path(folder) / (chart + "_points.json");
  if (!resume || !std::filesystem::exists(path_)) return true;
  const std::optional<std::string> text = files::read_file(path_, {}, sink);
  if (!text) return false;
  const std::optional<Json> json = parse_json(*text);
  try {
    if (!json) throw JsonError("no JSON");
    for (const auto& [key, point] : json->items()) {
      point_from(point);
      known_[key] = point;
    }
    return true;
  } catch (const JsonError&) {  // reported below
  }
  known_.clear();
  sink.report("cannot-read", {}, {path_.string(), "it holds no points of a chart"}, "leave out --resume to begin anew");
  return false;
}

std::string PointsFile::key_of(const std::string& run, const Entry& entry) {
  return fmt::format("{} {} {}", run, entry.fraction, variant_json(entry.variant).dump());
}

std::optional<Point> PointsFile::find(const std::string& key, const Entry& entry) const {
  const auto known = known_.find(key);
  if (known == known_.end()) return std::nullopt;
  Point point = point_from(known->second);
  point.variant = entry.variant;
  if (point.step > 0) point.variant.resolution["step"] = fmt::format("{}", point.step);
  return point;
}

void PointsFile::add(const std::string& key, const Point& point) { known_[key] = point_json(point); }

bool PointsFile::save(DiagnosticSink& sink) const {
  Json json = Json::object();
  for (const auto& [key, point] : known_) json[key] = point;
  return files::write_file(path_, json.dump(1) + "\n", sink);
}

}  // namespace dpde::chart
