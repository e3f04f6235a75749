// SPDX-License-Identifier: Apache-2.0
#include "driver/inverse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "driver/array_file.h"
#include "driver/data.h"

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

bool Inverse::make_parts(DiagnosticSink& sink) {
  const model::Task& task = *session_.problem().task;
  if (task.unknowns.empty()) sink.report("nothing-to-do", {}, {fmt::format("task {} has no unknown", task.name)});
  if (task.losses.empty()) sink.report("nothing-to-do", {}, {fmt::format("task {} has nothing to minimise", task.name)});
  const std::vector<std::string>& bars = session_.rollout().param_bar_names();
  const auto& derived = session_.compiled().derived;
  const auto initial = derived.find(session_.problem().scene + "_initial");
  initial_depends_ = initial != derived.end() && initial->second.adjoint.has_value();
  Eigen::Index offset = 0;
  for (const bool want_initial : {true, false}) {
    for (const model::Unknown& unknown : task.unknowns) {
      if (unknown.initial != want_initial) continue;
      const auto bar = std::find(bars.begin(), bars.end(), unknown.name);
      const int param = bar == bars.end() ? -1 : static_cast<int>(bar - bars.begin());
      const Eigen::Index size = want_initial ? static_cast<Eigen::Index>(session_.workspace().cell_count()) : 1;
      parts_.push_back({unknown.name, want_initial, want_initial ? session_.rollout().state_index(unknown.name) : param, offset, size});
      offset += size;
    }
  }
  start_ = Eigen::VectorXd::Zero(offset);
  return !sink.has_errors();
}

bool Inverse::make_start(const SourceFile& source, DiagnosticSink& sink) {
  const model::Task& task = *session_.problem().task;
  Workspace& workspace = session_.workspace();
  // The program keeps the formulas' values under the states' names; put the scene's own values back afterwards.
  std::map<std::string, std::vector<double>> from_formula;
  const dpde_program* program = session_.compiled().program(task.name + "_start");
  if (program != nullptr) {
    workspace.run(*program, session_.problem().t_begin);
    for (const model::Unknown& unknown : task.unknowns) {
      if (unknown.initial && unknown.from.formula) from_formula[unknown.name] = workspace.dense(unknown.name);
    }
  }
  session_.reset_initial();
  for (const Part& part : parts_) {
    const auto unknown = std::find_if(task.unknowns.begin(), task.unknowns.end(),
                                      [&](const model::Unknown& u) { return u.initial == part.initial && u.name == part.name; });
    std::vector<double> values;
    if (!part.initial) {
      const model::Number* from = unknown->from.formula ? std::get_if<model::Number>(&(*unknown->from.formula)->kind) : nullptr;
      values = {from != nullptr ? from->value : workspace.params().at(part.name)};
    } else if (unknown->from.formula) {
      values = from_formula[part.name];
    } else if (!unknown->from.file.empty()) {
      const std::optional<std::vector<double>> loaded = load_array(unknown->from, source, session_.problem().axes, sink);
      if (!loaded) return false;
      values = session_.options().cells.empty() ? *loaded : resample(*loaded, session_.problem().axes, workspace.axes());
    } else {
      values = session_.initial(part.index);
    }
    std::copy(values.begin(), values.end(), start_.data() + part.offset);
  }
  return true;
}

void Inverse::assign(const Eigen::VectorXd& x) {
  bool params_changed = false;
  for (const Part& part : parts_) {
    if (part.initial) continue;
    session_.workspace().set_param(part.name, x[part.offset]);
    session_.rollout().set_param(part.name, x[part.offset]);
    params_changed = true;
  }
  if (initial_depends_ && params_changed) session_.reset_initial();
  for (const Part& part : parts_) {
    if (part.initial) session_.rollout().initial(part.index).copy_in(dense_part(x, part));
  }
}

double Inverse::value(const Eigen::VectorXd& x) {
  assign(x);
  return session_.rollout().loss();
}

double Inverse::value_and_gradient(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) {
  assign(x);
  last_ = &session_.rollout().gradient();
  if (last_->stopped) return NAN;
  for (const Part& part : parts_) {
    if (part.initial) {
      copy_out(session_.workspace().layout(), last_->state_bars[static_cast<std::size_t>(part.index)],
               {gradient.data() + part.offset, static_cast<std::size_t>(part.size)});
    } else {
      gradient[part.offset] = part.index < 0 ? 0.0 : last_->param_bars[static_cast<std::size_t>(part.index)];
    }
  }
  if (initial_depends_) add_gradient_through_initial(gradient);
  return last_->loss;
}

void Inverse::add_gradient_through_initial(Eigen::VectorXd& gradient) {
  const std::string initial = session_.problem().scene + "_initial";
  const adjoint::Derivative& derivative = *session_.compiled().derived.at(initial).adjoint;
  std::map<std::string, double*> bound;
  std::vector<double> seed(session_.workspace().cell_count());
  for (const std::string& state : session_.compiled().stencil.find_program(initial)->keeps) {
    const auto name = derivative.names.find(state);
    if (name == derivative.names.end()) continue;
    const bool is_unknown = std::any_of(parts_.begin(), parts_.end(), [&](const Part& p) { return p.initial && p.name == state; });
    Field& field = session_.workspace().field(name->second);
    if (is_unknown) {
      field.fill(0);  // the formula is not used
    } else {
      copy_out(session_.workspace().layout(), last_->state_bars[static_cast<std::size_t>(session_.rollout().state_index(state))], seed);
      field.copy_in(seed);
    }
  }
  const std::map<std::string, double> sums =
      session_.workspace().run(*session_.compiled().program(derivative.program), session_.problem().t_begin);
  for (const Part& part : parts_) {
    const auto name = derivative.names.find(part.name);
    if (part.initial || name == derivative.names.end()) continue;
    const auto sum = sums.find(name->second);
    if (sum != sums.end()) gradient[part.offset] += sum->second;
  }
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
      const dpde_program* program = session_.compiled().program(task.name + "_test_" + name);
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
