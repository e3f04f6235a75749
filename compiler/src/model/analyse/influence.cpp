// SPDX-License-Identifier: Apache-2.0
#include "model/analyse/influence.h"

#include "model/build.h"
#include "model/uses.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::model {

namespace {

class InfluenceReader {
 public:
  explicit InfluenceReader(NamesRead& reading) : reading_(reading) {}

  void read(const Expr& e, bool smooth) {
    match(
        e->kind, ignored<Number, Coordinate, Noise>,
        [&](const OneOf<Param, Field> auto& named) { add(named.name, smooth); },
        [&](const Binary& b) {
          const bool is_condition = precedence(b.op) < precedence(BinaryOp::add);
          read(b.left, smooth && !is_condition);
          read(b.right, smooth && !is_condition);
        },
        [&](const Call& c) {
          for (const Expr& argument : c.arguments) read(argument, smooth && c.fn != Fn::sign && c.fn != Fn::floor);
        },
        [&](const Select& s) {
          read(s.condition, false);
          read(s.yes, smooth);
          read(s.no, smooth);
        },
        [&](const OneOf<Neg, Derivative, Advect, Shift, Interpolate, BandPass, Reduce> auto&) {
          read_parts(e, smooth);
        },
        [&](const Sample& s) {
          add(s.field, smooth);
          read_parts(e, smooth);
        },
        [&](const Apply& a) {
          for (const Expr& part : a.function.body) read(part, smooth);
          read_parts(e, smooth);
        },
        [&](const NetworkCall& call) {
          add(call.network, smooth);
          read_parts(e, smooth);
        },
        [&](const Solve& s) { read_parts(without_aids(s, e->origin), smooth); });
  }

 private:
  void add(const std::string& name, bool smooth) {
    reading_.any.insert(name);
    if (smooth) reading_.smooth.insert(name);
  }
  void read_parts(const Expr& e, bool smooth) {
    for_each_child(e, [&](const Expr& part) { read(part, smooth); });
  }

  NamesRead& reading_;
};

void add(Influence::Unknowns& to, const Influence::Unknowns& from) { to.insert(from.begin(), from.end()); }

}  // namespace

NamesRead names_read(const Expr& e) {
  NamesRead reading;
  InfluenceReader(reading).read(e, true);
  return reading;
}

void for_each_formula_of_run(const Problem& problem, const std::function<void(const Formula&)>& f) {
  for_each_formula(problem, [&](const Use& use) {
    switch (use.kind) {
      case UseKind::equation:
      case UseKind::potential:
      case UseKind::constraint:
      case UseKind::correction:
      case UseKind::held_where:
      case UseKind::held_value:
      case UseKind::event:
      case UseKind::initial:
      case UseKind::coefficient:
      case UseKind::boundary_value:
      case UseKind::boundary_weight: return f({use.owner, &use.formula, use.kind});
      case UseKind::courant_rate: return f({"", &use.formula, use.kind, false, true});
      case UseKind::loss: return f({"", &use.formula, use.kind, true});
      case UseKind::observable:  // losses do not depend on them
      case UseKind::output:
      case UseKind::test:
      case UseKind::test_field:
      case UseKind::exact: return;
      case UseKind::control:  // values of intervals: unknowns themselves, or numbers
      case UseKind::control_start:
      case UseKind::unknown_start:
      case UseKind::stretch_map:  // of numbers
      case UseKind::metric:
      case UseKind::stated_operator: return;  // only measured, never run
    }
    unreachable("kind of use");
  });
}

Influence::Influence(const Problem& problem, const NamesRead& program) {
  const std::vector<Unknown>& unknowns = problem.task->unknowns;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    Reach& reach = reached_[unknowns[i].name];
    reach.smooth.insert(i);
    reach.any.insert(i);
  }
  add_edges(problem, program);
  NamesRead losses;
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (formula.is_of_loss) InfluenceReader(losses).read(*formula.value, true);
  });
  spread();
  losses_ = on(losses);
  look_back(losses);
}

void Influence::add_edges(const Problem& problem, const NamesRead& program) {
  for_each_formula_of_run(problem, [&](const Formula& formula) {
    if (formula.is_of_loss) {
      const auto is_it = [&](const Loss& loss) { return &loss.value == formula.value && !loss.average.empty(); };
      const auto average = std::ranges::find_if(problem.task->losses, is_it);
      if (average != problem.task->losses.end()) edges_.push_back({average->average, names_read(*formula.value)});
      return;
    }
    NamesRead reading = names_read(*formula.value);
    if (!formula.is_of_length) return edges_.push_back({formula.makes, std::move(reading)});
    for (const State& state : problem.states) edges_.push_back({state.name, {{}, reading.any}});
  });
  for (const State& state : problem.states) {
    if (!state.velocity_of.empty()) add_edge(state.velocity_of, state.name);
    if (state.history_of.empty()) continue;
    add_edge(state.name, state.history_of);
    add_edge(state.history_of, state.name);
  }
  if (problem.program.empty()) return;
  for (const State& state : problem.states) edges_.push_back({state.name, program});
}

void Influence::spread() {
  bool changes = true;
  while (changes) {
    changes = false;
    for (const Edge& edge : edges_) {
      const Reach from = on(edge.from);
      Reach& to = reached_[edge.to];
      const Reach before = to;
      add(to.smooth, from.smooth);
      add(to.any, from.any);
      changes = changes || !(to == before);
    }
  }
}

void Influence::look_back(const NamesRead& losses) {
  wanted_ = losses.any;
  std::size_t before = 0;
  while (wanted_.size() != before) {
    before = wanted_.size();
    for (const Edge& edge : edges_) {
      if (wanted_.contains(edge.to)) wanted_.insert(edge.from.any.begin(), edge.from.any.end());
    }
  }
}

const Influence::Reach& Influence::on(const std::string& name) const {
  const auto found = reached_.find(name);
  return found == reached_.end() ? none_ : found->second;
}

Influence::Reach Influence::on(const NamesRead& reading) const {
  Reach result;
  for (const std::string& name : reading.smooth) add(result.smooth, on(name).smooth);
  for (const std::string& name : reading.any) add(result.any, on(name).any);
  return result;
}

}  // namespace dpde::model
