// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/inverse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ranges>
#include <set>

#include "dpde/runtime/error.h"
#include "driver/scene/data.h"
#include "files/array_file.h"
#include "model/analyse/placement.h"

namespace dpde::driver {

namespace {

model::Unknown::Kind kind_of(int32_t kind) {
  switch (kind) {
    case DPDE_UNKNOWN_INITIAL: return model::Unknown::Kind::initial;
    case DPDE_UNKNOWN_COEFFICIENT: return model::Unknown::Kind::coefficient;
    case DPDE_UNKNOWN_CONTROL: return model::Unknown::Kind::control;
    case DPDE_UNKNOWN_NETWORK: return model::Unknown::Kind::network;
    default: return model::Unknown::Kind::parameter;
  }
}

}  // namespace

std::unique_ptr<Inverse> Inverse::open(Session& session, const SourceFile& source, DiagnosticSink& sink) {
  std::unique_ptr<Inverse> inverse(new Inverse(session));
  if (!inverse->make_parts(sink) || !inverse->make_start(source, sink)) return nullptr;
  return inverse;
}

bool Inverse::make_parts(DiagnosticSink& sink) {
  const model::Task& task = *session_.problem().task;
  if (task.unknowns.empty()) sink.report("nothing-to-do", {}, {fmt::format("task {} has no unknown", task.name)});
  if (task.losses.empty())
    sink.report("nothing-to-do", {}, {fmt::format("task {} has nothing to minimise", task.name)});
  const Engine& engine = session_.engine();
  for (const Engine::Unknown& unknown : engine.unknowns()) {
    const int state = unknown.kind == DPDE_UNKNOWN_INITIAL ? engine.state_index(unknown.name) : -1;
    parts_.push_back({unknown.name, kind_of(unknown.kind), state, static_cast<Eigen::Index>(unknown.offset),
                      static_cast<Eigen::Index>(unknown.size)});
  }
  start_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(engine.unknown_count()));
  return !sink.has_errors();
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

/// Values of the fields for which the task has a start formula; the scene's own values are not changed.
std::map<std::string, std::vector<double>> Inverse::start_by_formulas() {
  Workspace& workspace = session_.workspace();
  std::map<std::string, std::vector<double>> values;
  std::map<std::string, Field> fields;
  Workspace::Bound bound;
  for (const Part& part : parts_) {
    if (!part.is_field() || !unknown_of(part).from.formula) continue;
    if (control_field(part) != nullptr) {
      workspace.run_for_intervals(*session_.compiled().program(session_.compiled().names.control_starts.at(part.name)),
                                  part.name);
      values[part.name] = workspace.dense(part.name);
      workspace.set_dense(part.name, own_.at(part.name));
    } else {
      bound[part.name] = fields.emplace(part.name, Field(workspace.layout())).first->second.base();
    }
  }
  const dpde_program* program = session_.compiled().program(session_.compiled().names.start);
  if (program == nullptr) return values;
  workspace.run(*program, session_.problem().t_begin, bound);
  for (const auto& [name, field] : fields) {
    values[name].resize(workspace.cell_count());
    field.copy_out(values[name]);
  }
  return values;
}

/// Start of one part: a number, or the values of a file. nullopt if `sink` has an error afterwards.
std::optional<std::vector<double>> Inverse::start_of(const Part& part, const SourceFile& source, DiagnosticSink& sink) {
  const model::Source& from = unknown_of(part).from;
  if (part.is_network()) return session_.workspace().weights().find(part.name)->second.values;
  if (part.is_control()) return session_.problem().find_control(part.name)->start;
  if (!part.is_field()) {
    const model::Number* number = from.formula ? as<model::Number>(*from.formula) : nullptr;
    return {{number != nullptr ? number->value : session_.workspace().params().find(part.name)->second}};
  }
  if (from.file.empty() || session_.options().made_up) return own_.at(part.name);
  if (const model::Coefficient* control = control_field(part); control != nullptr)
    return load_coefficient(session_, *control, from, source, sink);
  const auto axes = model::axes_at(session_.problem().axes, model::Placements(session_.problem()).of(part.name));
  const std::optional<std::vector<double>> loaded = files::load_array(
      from, session_.problem().unit_of(part.name), source, axes, session_.problem().scheme.real, sink);
  if (!loaded || session_.options().cells.empty()) return loaded;
  return resample(*loaded, session_.problem().axes, session_.axes());
}

bool Inverse::make_start(const SourceFile& source, DiagnosticSink& sink) {
  Engine& engine = session_.engine();
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    if (!parts_[p].is_field()) continue;
    std::vector<double>& own = own_[parts_[p].name];
    own.resize(static_cast<std::size_t>(parts_[p].size));
    engine.values_of(engine.unknowns()[p], own);
  }
  std::map<std::string, std::vector<double>> by_formula = start_by_formulas();
  for (const Part& part : parts_) {
    const auto found = by_formula.find(part.name);
    const bool is_formula = part.is_field() && found != by_formula.end();
    const std::optional<std::vector<double>> values =
        is_formula ? std::move(found->second) : start_of(part, source, sink);
    if (!values || (!session_.options().made_up && !check_bounds(part, *values, sink))) return false;
    std::ranges::copy(*values, start_.data() + part.offset);
  }
  return true;
}

/// Numbers were checked with the model; fields are checked here.
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

Bounds Inverse::bounds() const { return session_.engine().bounds(); }

void Inverse::assign(const Eigen::VectorXd& x) {
  session_.engine().set_unknowns(x);
  session_.engine().begin(session_.rollout());
}

/// Whether the boundary conditions are well-defined for these values of the unknown parameters.
bool Inverse::has_walls(const Eigen::VectorXd& x) {
  model::KnownValues values;
  for (const model::Parameter& parameter : session_.problem().params) values[parameter.name] = parameter.value;
  for (const Part& part : parts_) {
    if (part.kind == model::Unknown::Kind::parameter) values[part.name] = x[part.offset];
  }
  misfit_ = model::misfit_of_walls(session_.problem(), values, ghosts_, model::Walls::with_unknowns);
  return !misfit_;
}

/// NaN instead of an error, so that a line search takes a shorter step.
double Inverse::or_none(const Eigen::VectorXd& x, const std::function<double()>& loss) {
  unsolved_.clear();
  try {
    return loss();
  } catch (const NoSolution& error) {
    if (x == start_) throw;
    unsolved_ = error.what();
    return NAN;
  }
}

double Inverse::value(const Eigen::VectorXd& x) {
  if (!has_walls(x)) return NAN;
  session_.engine().set_unknowns(x);
  return or_none(x, [&] { return session_.engine().loss(); });
}

double Inverse::value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  if (!has_walls(x)) {
    gradient.setConstant(NAN);
    return NAN;
  }
  session_.engine().set_unknowns(x);
  gradient.setConstant(NAN);  // result if there is no solution
  return or_none(x, [&] {
    return session_.engine().gradient({gradient.data(), static_cast<std::size_t>(gradient.size())});
  });
}

double Inverse::value_and_gradient_at_rest(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  Engine& engine = session_.engine();
  const auto back = [&engine](Engine*) { engine.end_at_rest(false); };
  const std::unique_ptr<Engine, decltype(back)> guard(&engine, back);
  engine.end_at_rest(true);
  try {
    return value_and_gradient(x, gradient);
  } catch (const NoSolution&) {
    gradient.setConstant(NAN);
    return NAN;
  }
}

double Inverse::rate_along(const Eigen::VectorXd& x, const Eigen::VectorXd& direction) {
  session_.engine().set_unknowns(x);
  return or_none(x, [&] { return session_.engine().rate_along(direction); });
}

void Inverse::product(const Eigen::VectorXd& x, const Eigen::VectorXd& v, Eigen::VectorXd& result,
                      Curvature curvature) {
  session_.engine().set_unknowns(x);
  result.setConstant(NAN);
  or_none(x, [&] {
    session_.engine().product(v, {result.data(), static_cast<std::size_t>(result.size())}, curvature);
    return 0.0;
  });
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
      if (!wanted[i].contains(snapshot.is_last ? session_.steps() : snapshot.step)) continue;
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
