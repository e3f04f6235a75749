// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/exponential.h"

#include <map>
#include <span>
#include <utility>

#include "model/build.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/space/waves.h"

namespace dpde::stencil {

namespace {

/// The term weight*h*phi_number(part*h*L)*N, with N at `stage`.
struct PhiTerm {
  int stage, number;
  double weight;
};
/// A value of the state at `time` (in steps): exp(part*h*L) times the value at stage `from`, plus terms in N.
struct Row {
  double part, time;
  int from;
  std::vector<PhiTerm> shares;
};

/// Stage 0 is the state itself; each row gives the next stage, the last row the result.
const std::vector<Row> etdrk2{{1, 1, 0, {{0, 1, 1}}}, {1, 1, 0, {{0, 1, 1}, {1, 2, 1}, {0, 2, -1}}}};
const std::vector<Row> etdrk4{
    {0.5, 0.5, 0, {{0, 1, 1}}},
    {0.5, 0.5, 0, {{1, 1, 1}}},
    {0.5, 1, 1, {{2, 1, 2}, {0, 1, -1}}},
    {1, 1, 0, {{0, 1, 1}, {0, 2, -3}, {0, 3, 4}, {1, 2, 2}, {1, 3, -4}, {2, 2, 2}, {2, 3, -4}, {3, 2, -1}, {3, 3, 4}}}};

bool depends_on_time(const model::Expr& e) {
  return any_part(e, [](const model::Expr& part) {
    const model::Param* p = as<model::Param>(part);
    return p && p->name == "t";
  });
}

/// The two parts of an equation: L is `linear`, and N is the sum of the operands of `rest` times their symbols.
struct LinearAndRest {
  Expr linear = 0.0;  // a symbol
  std::vector<WavePart> rest;
};

class Exponential {
 public:
  Exponential(Lowering& lowering, const std::vector<Advance>& advances, const std::string& prefix)
      : lowering_(lowering), advances_(advances), prefix_(prefix) {
    for (const Advance& advance : advances) splits_.push_back(split(advance));
  }

  std::vector<Stage> stages(std::span<const Row> rows) {
    std::vector<Stage> result{rates(0, 0)};
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const bool is_last = i + 1 == rows.size();
      std::vector<Prerequisite> values = values_of(rows[i], is_last);
      const int number = static_cast<int>(i) + 1;
      Stage stage = is_last ? Stage{lowering_.kernel(prefix_), Environment().time, {}} : rates(number, rows[i].time);
      stage.before.insert(stage.before.begin(), values.begin(), values.end());
      result.push_back(std::move(stage));
    }
    if (result.front().kernel.stores.empty()) result.erase(result.begin());
    return result;
  }

 private:
  /// Splits the equation into sums of derivatives of the state itself and the rest.
  LinearAndRest split(const Advance& advance) {
    Discretiser numbers = lowering_.discretiser();
    const WaveReading reading{[](const model::Expr&) { return true; },
                              [&](const model::Expr& uniform) { return numbers(uniform); }};
    const WaveReading of_scheme = waves_of(lowering_.problem().scheme, reading.value);
    LinearAndRest result;
    model::Expr pointwise = 0.0;
    for (const model::Term& term : model::terms_of(advance.rate)) {
      const bool is_constant = !depends_on_time(term.value);
      const auto add = [&](Expr& sum, const Expr& symbol) { sum = term.negative ? sum - symbol : sum + symbol; };
      const std::vector<WavePart> parts = is_constant ? wave_parts(term.value, reading) : std::vector<WavePart>{};
      if (parts.size() == 1 && parts[0].operand == model::field(advance.state)) {
        add(result.linear, parts[0].symbol);
      } else if (is_constant && is_of_waves(term.value, of_scheme)) {
        for (const WavePart& part : wave_parts(term.value, of_scheme))
          add(result.rest.emplace_back(part.operand, 0.0).symbol, part.symbol);
      } else {
        pointwise = model::binary(term.negative ? BinaryOp::subtract : BinaryOp::add, pointwise, term.value);
      }
    }
    if (!is_literal(pointwise, 0)) result.rest.push_back({pointwise, 1.0});
    if (!holds_odd_powers(result.linear)) return result;  // means over k and -k then agree with the derivatives
    result.linear = with_slopes(result.linear);
    for (WavePart& part : result.rest) part.symbol = with_slopes(part.symbol);
    return result;
  }

  /// The stage that computes N of all states.
  Stage rates(int number, double time) {
    Environment reading;
    if (number > 0) reading.fields = fields_.at(number);
    reading.time = StepPart{}.time_at(time);
    Discretiser at_point = lowering_.discretiser(reading);
    Kernel kernel = lowering_.kernel(prefix_ + "_stage" + std::to_string(number + 1));
    for (std::size_t i = 0; i < advances_.size(); ++i) {
      const std::string& state = advances_[i].state;
      for (const WavePart& part : splits_[i].rest) {
        const std::string field = lowering_.fresh_field(state + "_rate" + std::to_string(number + 1));
        rates_[number][state].push_back(field);
        kernel.stores.push_back({field, false, at_point(part.operand), advances_[i].origin});
      }
    }
    return Lowering::stage(std::move(kernel), at_point, reading.time);
  }

  /// Transforms that compute the states of a row.
  std::vector<Prerequisite> values_of(const Row& row, bool is_last) {
    std::vector<Prerequisite> values;
    std::map<std::string, std::string> fields;
    const int number = static_cast<int>(fields_.size()) + 1;
    for (std::size_t i = 0; i < advances_.size(); ++i) {
      const Advance& advance = advances_[i];
      const std::string into = is_last ? advance.into : lowering_.field_beside(advance.state, std::to_string(number));
      fields[advance.state] = into;
      const Expr h = param("dt"), argument = row.part == 1 ? h * splits_[i].linear : h * splits_[i].linear * row.part;
      const std::string from = row.from == 0 ? advance.state : fields_.at(row.from).at(advance.state);
      const bool cuts = lowering_.problem().scheme.dealias;
      Transform value{{{from, {{WaveFunction::Kind::phi, 0}, argument, 1.0, cuts}}}, into};
      for (const PhiTerm& share : row.shares) {
        const std::vector<std::string>& rates = rates_[share.stage][advance.state];
        for (std::size_t k = 0; k < rates.size(); ++k) {
          const Expr factor = share.weight * row.part * h * splits_[i].rest[k].symbol;
          value.terms.push_back({rates[k], {{WaveFunction::Kind::phi, share.number}, argument, factor, cuts}});
        }
      }
      values.emplace_back(std::move(value));
    }
    fields_[number] = std::move(fields);
    return values;
  }

  Lowering& lowering_;
  const std::vector<Advance>& advances_;
  std::string prefix_;
  std::vector<LinearAndRest> splits_;
  std::map<int, std::map<std::string, std::string>> fields_;              // values of the states at a stage
  std::map<int, std::map<std::string, std::vector<std::string>>> rates_;  // parts of N at a stage, by state
};

}  // namespace

std::vector<Stage> exponential_stages(Lowering& lowering, const std::vector<Advance>& advances,
                                      const std::string& prefix) {
  const bool is_second = lowering.problem().scheme.time->order == 2;
  return Exponential(lowering, advances, prefix).stages(is_second ? etdrk2 : etdrk4);
}

std::vector<Stage> cut_to_two_thirds(Lowering& lowering, std::vector<Stage> stages) {
  std::vector<Prerequisite> cuts;
  std::vector<Stage> result;
  for (Stage& stage : stages) {
    stage.before.insert(stage.before.begin(), cuts.begin(), cuts.end());
    cuts.clear();
    for (Store& store : stage.kernel.stores) {
      if (!lowering.stands_for_state(store.field)) continue;
      const std::string whole = lowering.fresh_field(store.field + "_whole");
      cuts.emplace_back(Transform{{{whole, {{}, 0.0, 1.0, true}}}, store.field});
      store.field = whole;
    }
    result.push_back(std::move(stage));
  }
  if (!cuts.empty()) result.push_back({lowering.kernel(lowering.problem().scene + "_cut"), Environment().time, cuts});
  return result;
}

}  // namespace dpde::stencil
