// SPDX-License-Identifier: Apache-2.0
#include "stability/report/verdict_cache.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <bit>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <sstream>

#include "model/print/print_model.h"
#include "stencil/text/print_stencil.h"

namespace dpde::stability {

namespace {

constexpr double worth_keeping = 0.05;  // seconds
constexpr const char* last_line = "end of the verdict";

}  // namespace

std::string key_of_fields(driver::Session& session) {
  std::uint64_t fields = 14695981039346656037ull;  // FNV-1a, on numbers instead of bytes
  const auto add = [&](const std::vector<double>& values) {
    for (const double value : values) {
      fields = (fields ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ull;
      fields ^= fields >> 32;
    }
  };
  for (int s = 0; s < session.rollout().state_count(); ++s) add(session.initial(s));
  for (const model::Coefficient& coefficient : session.problem().coefficients)
    add(session.workspace().dense(coefficient.name));
  for (const auto& [name, weights] : session.workspace().weights()) add(weights.values);
  std::string key = fmt::format("fields {:x}\n", fields);
  for (const auto& [name, value] : session.workspace().params()) key += fmt::format("{} = {}\n", name, value);
  for (const auto& [name, control] : session.workspace().controls()) {
    for (const double value : control.values) key += fmt::format("{}: {}\n", name, value);
  }
  return key;
}

std::string key_of(driver::Session& session) {
  return fmt::format("verdict\n{} steps, ", session.steps()) + key_of_fields(session) + print(session.problem()) +
         print(session.compiled().stencil);
}

namespace {

/// Reads numbers back, also those that are not finite.
class Reader {
 public:
  explicit Reader(const std::string& text) : in_(text) {}
  std::string line() {
    std::string result;
    is_good_ = is_good_ && std::getline(in_, result);
    return result;
  }
  std::string word() {
    std::string result;
    is_good_ = is_good_ && in_ >> result;
    return result;
  }
  double number() {
    const std::string text = word();
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    is_good_ = is_good_ && !text.empty() && *end == 0;
    return value;
  }
  void end_line() { is_good_ = is_good_ && line().empty(); }
  bool is_good() const { return is_good_; }

 private:
  std::istringstream in_;
  bool is_good_ = true;
};

FrozenPoint read_point(Reader& reader) {
  FrozenPoint point;
  for (double& place : point.place) place = reader.number();
  for (double& cells : point.cells) cells = reader.number();
  for (double& wave : point.longest_wave) wave = reader.number();
  const double field_count = reader.number(), whole_count = reader.number(), params = reader.number();
  for (const auto& [fields, count] : {std::pair{&point.fields, field_count}, {&point.whole, whole_count}}) {
    for (int i = 0; i < count && reader.is_good(); ++i) {
      FrozenValue& field = (*fields)[reader.word()];
      field.value = reader.number();
      for (double& slope : field.slope) slope = reader.number();
    }
  }
  for (int i = 0; i < params && reader.is_good(); ++i) {
    const std::string name = reader.word();
    point.params[name] = reader.number();
  }
  return point;
}

std::string text_of(const FrozenPoint& point) {
  std::string text;
  for (const double place : point.place) text += fmt::format("{} ", place);
  for (const double cells : point.cells) text += fmt::format("{} ", cells);
  for (const double wave : point.longest_wave) text += fmt::format("{} ", wave);
  text += fmt::format("{} {} {}\n", point.fields.size(), point.whole.size(), point.params.size());
  for (const auto* fields : {&point.fields, &point.whole}) {
    for (const auto& [name, field] : *fields)
      text += fmt::format("{} {} {} {} {}\n", name, field.value, field.slope[0], field.slope[1], field.slope[2]);
  }
  for (const auto& [name, value] : point.params) text += fmt::format("{} {}\n", name, value);
  return text;
}

}  // namespace

namespace {

std::string lines_of(const StabilityReport& v) {
  std::string text = fmt::format("{}\n{}\n{}\n", v.why, v.place, v.field);
  text += fmt::format("{} {} {} {}\n", static_cast<int>(v.limit.kind), v.limit.step, v.limit.order, v.limit.state);
  for (const Angles& wave : {v.limit.wave, v.wave}) text += fmt::format("{} {} {}\n", wave[0], wave[1], wave[2]);
  text += fmt::format("{} {} {} {} {}\n", v.is_exact ? 1 : 0, v.is_of_walls ? 1 : 0, v.limiter_step, v.step, v.parts);
  text += fmt::format("{} {} {} {} {} {}\n", v.is_of_networks ? 1 : 0, v.is_of_grid ? 1 : 0, v.is_of_means ? 1 : 0,
                      static_cast<int>(v.runs), v.places, v.places_between_walls);
  text += fmt::format("{} {} {} {} {}\n", v.growth, v.beyond, v.growth_rate, v.growth_by_events, v.end_growth);
  text += fmt::format("{} {}\n", v.courant.value_or(-1), v.largest_step);
  const ShortWaves waves = v.short_waves.value_or(ShortWaves{});
  text += fmt::format("{} {}\n", waves.rate, waves.cells);
  text += fmt::format("{} {} {} {}\n", v.group_growth_rate, v.group_growth_by_events, v.group.size(),
                      fmt::join(v.group, " "));
  text += fmt::format("{} {}\n", v.solution_cells.size(), fmt::join(v.solution_cells, " "));
  text += text_of(v.worst) + fmt::format("{}\n", v.worse.size());
  for (const StabilityReport& other : v.worse) text += lines_of(other);
  return text;
}

StabilityReport read_verdict(Reader& reader) {
  StabilityReport v;
  v.why = reader.line(), v.place = reader.line(), v.field = reader.line();
  const double kind = reader.number();
  v.limit.kind = kind == 1 ? StepLimit::Kind::none : kind == 2 ? StepLimit::Kind::never : StepLimit::Kind::limit;
  v.limit.step = reader.number(), v.limit.order = reader.number();
  v.limit.state = static_cast<std::size_t>(reader.number());
  for (Angles* wave : {&v.limit.wave, &v.wave}) {
    for (double& angle : *wave) angle = reader.number();
  }
  v.is_exact = reader.number() != 0, v.is_of_walls = reader.number() != 0;
  v.limiter_step = reader.number(), v.step = reader.number(), v.parts = static_cast<int>(reader.number());
  v.is_of_networks = reader.number() != 0, v.is_of_grid = reader.number() != 0;
  v.is_of_means = reader.number() != 0;
  const double runs = reader.number();
  v.runs = runs == 1   ? StabilityReport::Runs::made
           : runs == 2 ? StabilityReport::Runs::left_out
                       : StabilityReport::Runs::none;
  v.places = static_cast<int>(reader.number()), v.places_between_walls = static_cast<int>(reader.number());
  v.growth = reader.number(), v.beyond = reader.number();
  v.growth_rate = reader.number(), v.growth_by_events = reader.number(), v.end_growth = reader.number();
  if (const double courant = reader.number(); courant >= 0) v.courant = courant;
  v.largest_step = reader.number();
  const double rate = reader.number(), cells = reader.number();
  if (rate > 0) v.short_waves = {rate, cells};
  v.group_growth_rate = reader.number(), v.group_growth_by_events = reader.number();
  for (double left = reader.number(); left > 0 && reader.is_good(); --left) v.group.insert(reader.word());
  for (double left = reader.number(); left > 0 && reader.is_good(); --left)
    v.solution_cells.push_back(static_cast<int>(reader.number()));
  v.worst = read_point(reader);
  const bool has_worse = reader.number() > 0;
  reader.end_line();
  if (has_worse && reader.is_good()) v.worse.push_back(read_verdict(reader));
  return v;
}

}  // namespace

std::string text_of(const StabilityReport& v) { return lines_of(v) + last_line; }

std::optional<StabilityReport> verdict_from(const std::string& text) {
  Reader reader(text);
  StabilityReport v = read_verdict(reader);
  const bool is_whole = reader.line() == last_line;
  return is_whole && reader.is_good() ? std::optional(std::move(v)) : std::nullopt;
}

namespace {

/// The cached or new results for a session. The key is made once, as it contains the text of the whole step.
class Kept {
 public:
  Kept(driver::Session& session, const Look& look)
      : session_(session),
        look_(look),
        cache_(session.compiled().options.cache.get()),
        key_(cache_ == nullptr ? "" : key_of(session)) {}

  StabilityReport verdict() const {
    const auto is_text = [](const std::string& text) { return verdict_from(text).has_value(); };
    std::optional<StabilityReport> found;
    const std::string text =
        kept_or_found("", is_text, [&] { return text_of(found.emplace(examine(session_, look_))); });
    return found ? std::move(*found) : verdict_from(text).value();
  }
  bool grows_nothing() const {
    const std::string yes = "nothing grows", no = "something grows";
    const auto is_text = [&](const std::string& text) { return text == yes || text == no; };
    return kept_or_found("growth of a ", is_text, [&] { return look_for_growth(session_, look_) ? yes : no; }) == yes;
  }

 private:
  std::string kept_or_found(const std::string& what, const std::function<bool(const std::string&)>& is_text,
                            const std::function<std::string()>& find) const {
    const std::string of_all_cells = what + "at all cells, ", own = look_.at_all_cells ? of_all_cells : what;
    for (const std::string& before : {of_all_cells, what}) {
      if (cache_ == nullptr || (before != own && before != of_all_cells)) continue;
      const std::optional<std::string> kept = cache_->find(before + key_);
      if (kept && is_text(*kept)) return *kept;
    }
    const auto start = std::chrono::steady_clock::now();
    look_.says("how long a step may be");
    std::string found = find();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (cache_ != nullptr && seconds > worth_keeping) cache_->store(own + key_, found);
    return found;
  }

  driver::Session& session_;
  const Look& look_;
  codegen::CodeCache* cache_;
  std::string key_;
};

}  // namespace

StabilityReport verdict_of(driver::Session& session, const Look& look) { return Kept(session, look).verdict(); }

bool grows_nothing(driver::Session& session, const Look& look) { return Kept(session, look).grows_nothing(); }

std::optional<StabilityReport> verdict_where_it_grows(driver::Session& session, const Look& look) {
  const Kept kept(session, look);
  return kept.grows_nothing() ? std::nullopt : std::optional(kept.verdict());
}

}  // namespace dpde::stability
