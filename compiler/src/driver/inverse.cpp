// SPDX-License-Identifier: Apache-2.0
#include "driver/inverse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "dpde/runtime/through_formula.h"
#include "driver/array_file.h"
#include "driver/data.h"
#include "driver/links.h"
#include "model/placement.h"

namespace dpde::driver {

namespace {

std::span<const double> dense_part(const Eigen::VectorXd& x, const Inverse::Part& part) {
  return {x.data() + part.offset, static_cast<std::size_t>(part.size)};
}

}  // namespace

std::unique_ptr<Inverse> Inverse::open(Session& session, const SourceFile& source, DiagnosticSink& sink) {
  std::unique_ptr<Inverse> inverse(new Inverse(session));
  if (!inverse->make_parts(sink) || !inverse->make_start(source, sink)) return nullptr;
  return inverse;
}

Eigen::Index Inverse::size_of(const model::Unknown& unknown) const {
  const model::Coefficient* coefficient =
      unknown.kind == model::Unknown::Kind::coefficient ? session_.problem().find_coefficient(unknown.name) : nullptr;
  const int intervals =
      coefficient != nullptr && coefficient->is_control() ? session_.problem().intervals(coefficient->every) : 1;
  if (unknown.kind == model::Unknown::Kind::network)
    return static_cast<Eigen::Index>(session_.workspace().weights().at(unknown.name).values.size());
  if (unknown.is_field()) return intervals * static_cast<Eigen::Index>(session_.workspace().cell_count());
  const auto control = session_.workspace().controls().find(unknown.name);
  return control == session_.workspace().controls().end() ? 1
                                                          : static_cast<Eigen::Index>(control->second.values.size());
}

bool Inverse::make_parts(DiagnosticSink& sink) {
  const model::Task& task = *session_.problem().task;
  if (task.unknowns.empty()) sink.report("nothing-to-do", {}, {fmt::format("task {} has no unknown", task.name)});
  if (task.losses.empty())
    sink.report("nothing-to-do", {}, {fmt::format("task {} has nothing to minimise", task.name)});
  for (const std::string& name : session_.compiled().formula_programs()) {
    const auto derived = session_.compiled().derived.find(name);
    if (derived != session_.compiled().derived.end() && derived->second.adjoint) formulas_.push_back(name);
  }
  Eigen::Index offset = 0;
  for (const model::Unknown::Kind kind : unknown_kinds) {
    for (const model::Unknown& unknown : task.unknowns) {
      if (unknown.kind != kind) continue;
      const Eigen::Index size = size_of(unknown);
      parts_.push_back({unknown.name, kind, session_.rollout().state_index(unknown.name), offset, size});
      offset += size;
    }
  }
  start_ = Eigen::VectorXd::Zero(offset);
  for (const std::string& name : session_.compiled().formula_programs()) {
    const dpde_program* program = session_.compiled().program(name);
    formulas_vary_ = formulas_vary_ || (program != nullptr && reads_unknown(*program));
  }
  return !sink.has_errors();
}

bool Inverse::reads_unknown(const dpde_program& program) const {
  return std::ranges::any_of(parts_, [&](const Part& part) {
    const auto is_it = [&](const char* name) { return part.name == name; };
    const auto is_network = [&](const dpde_network* network) { return part.name == network->name; };
    return !part.is_field() && (std::any_of(program.params, program.params + program.param_count, is_it) ||
                                std::any_of(program.networks, program.networks + program.network_count, is_network));
  });
}

const model::Unknown& Inverse::unknown_of(const Part& part) const {
  const std::vector<model::Unknown>& unknowns = session_.problem().task->unknowns;
  return *std::ranges::find_if(unknowns,
                               [&](const model::Unknown& u) { return u.kind == part.kind && u.name == part.name; });
}

const model::Coefficient* Inverse::control_field(const Part& part) const {
  if (part.kind != model::Unknown::Kind::coefficient) return nullptr;
  const model::Coefficient* coefficient = session_.problem().find_coefficient(part.name);
  return coefficient != nullptr && coefficient->is_control() ? coefficient : nullptr;
}

bool Inverse::make_start(const SourceFile& source, DiagnosticSink& sink) {
  Workspace& workspace = session_.workspace();
  // The program keeps the formulas' values under the fields' names; put the scene's own values back afterwards.
  std::map<std::string, std::vector<double>> from_formula;
  for (const Part& part : parts_) {
    if (part.is_field())
      own_[part.name] = part.is_initial() ? session_.initial(part.index) : workspace.dense(part.name);
  }
  const dpde_program* program = session_.compiled().program(session_.compiled().names.start);
  if (program != nullptr) {
    workspace.run(*program, session_.problem().t_begin);
    for (const Part& part : parts_) {
      if (part.is_field() && unknown_of(part).from.formula) from_formula[part.name] = workspace.dense(part.name);
    }
  }
  for (const Part& part : parts_) {
    const model::Coefficient* control = control_field(part);
    if (control == nullptr || !unknown_of(part).from.formula) continue;
    workspace.run_for_intervals(*session_.compiled().program(session_.compiled().names.control_starts.at(part.name)),
                                part.name);
    from_formula[part.name] = workspace.dense(part.name);
  }
  for (const Part& part : parts_) {
    if (part.is_field()) workspace.set_dense(part.name, own_.at(part.name));
  }
  session_.reset_initial();
  for (const Part& part : parts_) {
    const model::Source& from = unknown_of(part).from;
    std::vector<double> values;
    if (part.is_network()) {
      values = workspace.weights().at(part.name).values;
    } else if (part.is_control()) {
      values = session_.problem().find_control(part.name)->start;
    } else if (!part.is_field()) {
      const model::Number* number = from.formula ? std::get_if<model::Number>(&(*from.formula)->kind) : nullptr;
      values = {number != nullptr ? number->value : workspace.params().at(part.name)};
    } else if (from.formula) {
      values = from_formula[part.name];
    } else if (from.file.empty() || session_.options().made_up) {
      values = own_.at(part.name);
    } else if (const model::Coefficient* control = control_field(part); control != nullptr) {
      const std::optional<std::vector<double>> loaded = load_coefficient(session_, *control, from, source, sink);
      if (!loaded) return false;
      values = *loaded;
    } else {
      const auto axes = model::axes_at(session_.problem().axes, model::Placements(session_.problem()).of(part.name));
      const std::optional<std::vector<double>> loaded =
          load_array(from, source, axes, session_.problem().scheme.real, sink);
      if (!loaded) return false;
      values =
          session_.options().cells.empty() ? *loaded : resample(*loaded, session_.problem().axes, workspace.axes());
    }
    if (!session_.options().made_up && !check_bounds(part, values, sink)) return false;
    std::copy(values.begin(), values.end(), start_.data() + part.offset);
  }
  return true;
}

/// Numbers were checked with the model; fields are known now.
bool Inverse::check_bounds(const Part& part, const std::vector<double>& values, DiagnosticSink& sink) const {
  const model::Unknown& unknown = unknown_of(part);
  const Precision real = session_.problem().scheme.real;
  const double low = rounded(unknown.low, real), high = rounded(unknown.high, real);
  for (std::size_t i = 0; part.is_field() && i < values.size(); ++i) {
    if (values[i] >= low && values[i] <= high) continue;
    sink.report("start-out-of-bounds",
                unknown.from.origin.range.is_known() ? unknown.from.origin.range : unknown.origin.range,
                {unknown.name, fmt::format("at {} at index {}", values[i], i), fmt::format("{}", unknown.low),
                 fmt::format("{}", unknown.high)},
                "begin within the bounds, as with min(max(..., low), high), or widen them");
    return false;
  }
  return true;
}

Bounds Inverse::bounds() const {
  const std::vector<model::Unknown>& unknowns = session_.problem().task->unknowns;
  if (std::ranges::none_of(unknowns, &model::Unknown::is_bounded)) return {};
  Bounds bounds{Eigen::VectorXd(size()), Eigen::VectorXd(size())};
  for (const Part& part : parts_) {
    bounds.low.segment(part.offset, part.size).setConstant(unknown_of(part).low);
    bounds.high.segment(part.offset, part.size).setConstant(unknown_of(part).high);
  }
  return bounds;
}

void Inverse::set_values(const std::string& name, const Part& part, const Eigen::VectorXd& x) {
  Workspace& workspace = session_.workspace();
  const std::span<const double> values = dense_part(x, part);
  if (part.is_network()) {
    Workspace::Weights& weights = workspace.weights().at(part.name);
    std::ranges::copy(values, (name == part.name ? weights.values : weights.rates).begin());
    return;
  }
  if (!part.is_control()) return workspace.set_param(name, values[0]);
  workspace.set_control(name, session_.problem().find_control(part.name)->every, {values.begin(), values.end()});
}

void Inverse::assign(const Eigen::VectorXd& x) {
  for (const Part& part : parts_) {
    if (!part.is_field()) set_values(part.name, part, x);
  }
  session_.set_values(session_.rollout());
  if (formulas_vary_) {
    session_.reset_coefficients();
    session_.reset_initial();
  }
  for (const Part& part : parts_) {
    if (part.is_initial()) session_.rollout().initial(part.index).copy_in(dense_part(x, part));
    if (part.is_field() && !part.is_initial()) session_.workspace().set_dense(part.name, dense_part(x, part));
  }
}

/// Whether the conditions at walls are ones with these values of the parameters that are sought.
bool Inverse::has_walls(const Eigen::VectorXd& x) {
  model::KnownValues values;
  for (const model::Parameter& parameter : session_.problem().params) values[parameter.name] = parameter.value;
  for (const Part& part : parts_) {
    if (part.kind == model::Unknown::Kind::parameter) values[part.name] = x[part.offset];
  }
  misfit_ = model::misfit_of_walls(session_.problem(), values);
  return !misfit_;
}

double Inverse::value(const Eigen::VectorXd& x) {
  if (!has_walls(x)) return NAN;
  assign(x);
  return session_.rollout().loss();
}

double Inverse::value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  if (!has_walls(x)) {
    gradient.setConstant(NAN);
    return NAN;
  }
  assign(x);
  last_ = &session_.rollout().gradient();
  if (last_->stopped) return NAN;
  copy_bars(session_.rollout(), false, gradient);
  for (const std::string& program : formulas_) {
    add_through_formula(session_.rollout(), *session_.compiled().adjoint_of(program), false, gradient);
  }
  return last_->loss;
}

/// As tangents call it; "" where none varies by it.
std::string Inverse::rate_of(const Part& part) const {
  return driver::rate_of(session_.compiled(), part.is_field() ? adjoint::Link::Kind::field : adjoint::Link::Kind::param,
                         part.name);
}

/// Of states and coefficients.
std::set<std::string, std::less<>> Inverse::rates_of_fields() const {
  std::set<std::string, std::less<>> rates;
  for (const auto& [program, derived] : session_.compiled().derived) {
    for (std::size_t i = 0; derived.tangent && i < derived.tangent->links.size(); ++i) {
      const adjoint::Link& link = derived.tangent->links[i];
      if (link.kind == adjoint::Link::Kind::field) rates.insert(link.derived);
    }
  }
  return rates;
}

void Inverse::copy_bars(const Rollout& rollout, bool of_rates, Eigen::VectorXd& to) const {
  for (const Part& part : parts_) {
    const std::span<double> values(to.data() + part.offset, static_cast<std::size_t>(part.size));
    const std::string variable = of_rates ? rate_of(part) : part.name;
    if (variable.empty()) {
      std::ranges::fill(values, 0.0);  // nothing varies by its rate
    } else if (part.is_field()) {
      rollout.copy_field_bar(variable, values);
    } else {
      rollout.copy_param_bar(variable, values);
    }
  }
}

void Inverse::add_through_formula(const Rollout& rollout, const dpde_program& adjoint, bool of_rates,
                                  Eigen::VectorXd& to) {
  const std::set<std::string, std::less<>> rates = rates_of_fields();
  const auto counts = [&](std::string_view field) {  // where the field is sought its formula is not used
    if (of_rates && !rates.contains(field)) return false;
    return std::ranges::none_of(
        parts_, [&](const Part& p) { return p.is_field() && (p.name == field || rate_of(p) == field); });
  };
  const auto add = [&](std::string_view param, double value) {
    for (const Part& part : parts_) {
      const std::string variable = of_rates ? rate_of(part) : part.name;
      if (part.kind == model::Unknown::Kind::parameter && variable == param) to[part.offset] += value;
    }
  };
  const auto add_network = [&](std::string_view network) {
    const auto learned = [&](const Part& part) {
      return part.is_network() && network == (of_rates ? rate_of(part) : part.name);
    };
    const auto part = std::ranges::find_if(parts_, learned);
    if (part == parts_.end()) return;
    const std::vector<double>& bars = session_.workspace().weights().at(std::string(network)).bars;
    for (std::size_t i = 0; i < bars.size(); ++i) to[part->offset + static_cast<Eigen::Index>(i)] += bars[i];
  };
  dpde::add_through_formula(session_.workspace(), adjoint, rollout, counts, add, add_network);
}

std::vector<std::pair<std::string, double>> Inverse::tests(const Eigen::VectorXd& x) {
  const model::Task& task = *session_.problem().task;
  std::vector<std::pair<std::string, double>> values;
  if (task.tests.empty()) return values;
  assign(x);
  std::vector<std::set<int>> wanted;
  for (const model::Test& test : task.tests) {
    const std::vector<int> steps = session_.steps_of(test.when);
    wanted.emplace_back(steps.begin(), steps.end());
    values.emplace_back(test.quantity.name, 0.0);
  }
  const auto add = [&](const Snapshot& snapshot) {
    for (std::size_t i = 0; i < task.tests.size(); ++i) {
      if (!wanted[i].contains(snapshot.step)) continue;
      const std::string& name = task.tests[i].quantity.name;
      const dpde_program* program = session_.compiled().program(session_.compiled().names.tests.at(name));
      values[i].second += session_.evaluate(*program, name, snapshot.t, snapshot.states);
    }
  };
  const RunResult result = session_.rollout().run({1, add});
  if (result.blow_up || result.stopped) {
    for (auto& [name, value] : values) value = NAN;
  }
  return values;
}

}  // namespace dpde::driver
