// SPDX-License-Identifier: Apache-2.0
#include "stencil/space/semi_lagrangian.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "model/analyse/placement.h"
#include "model/build.h"
#include "stencil/build.h"
#include "stencil/space/departure.h"
#include "stencil/time/time_schemes.h"

namespace dpde::stencil {

namespace {

using model::Term;

const model::Advect* as_advect(const model::Expr& e) { return as<model::Advect>(e); }

bool holds_advect(const model::Expr& e) {
  return any_part(e, [](const model::Expr& x) { return as_advect(x) != nullptr; });
}

/// Whether a term is -advect(v, state), with no advect in the velocity.
bool is_transport(const Term& term, const std::string& state) {
  const model::Advect* advect = as_advect(term.value);
  if (!advect || !term.negative) return false;
  const auto* field = as<model::Field>(advect->operand);
  if (!field || field->name != state) return false;
  for (const model::Expr& component : advect->velocity) {
    if (holds_advect(component)) return false;
  }
  return true;
}

/// The equation without its transport; nullopt if there are no other terms. The other terms keep their form.
std::optional<model::Expr> without_transport(const model::Expr& e) {
  if (as_advect(e)) return std::nullopt;
  if (const auto* neg = as<model::Neg>(e)) {
    const auto rest = without_transport(neg->operand);
    return rest ? std::optional(model::Expr(model::Node{model::Neg{*rest}, e->origin})) : std::nullopt;
  }
  const auto* b = as<model::Binary>(e);
  if (!b || (b->op != BinaryOp::add && b->op != BinaryOp::subtract)) return e;
  const auto left = without_transport(b->left);
  const auto right = without_transport(b->right);
  if (left && right) return model::Expr(model::Node{model::Binary{b->op, *left, *right}, e->origin});
  if (!right) return left;
  if (b->op == BinaryOp::add) return right;
  return model::Expr(model::Node{model::Neg{*right}, e->origin});
}

void check_state(const model::State& state, DiagnosticSink& sink) {
  const std::vector<Term> terms = model::terms_of(*state.rhs);
  int transports = 0;
  for (const Term& term : terms) {
    const bool fine = is_transport(term, state.name);
    transports += fine;
    if ((fine && transports == 1) || (!fine && !holds_advect(term.value))) continue;
    const SourceRange range = term.value->origin.range.is_known() ? term.value->origin.range : state.origin.range;
    sink.report("advection-form", range, {state.name, state.name},
                "write dt(" + state.name + ") = -advect(v, " + state.name +
                    ") + other terms, or take advect = central(2) or upwind(1) in the scheme");
    return;
  }
}

bool has_moving_walls(const model::Problem& problem, const model::State& state) {
  const auto moves = [&](const model::Expr& part) {
    const auto* param = as<model::Param>(part);
    return param && (param->name == "t" || problem.find_control(param->name) != nullptr);
  };
  return std::any_of(state.boundary.begin(), state.boundary.end(), [&](const model::AxisSides& sides) {
    return any_part(sides.low.value, moves) || any_part(sides.high.value, moves);
  });
}

/// MacCormack evaluates velocities at both ends of the step from states whose halos are filled for the later time: a
/// velocity computed by differences would read a moving wall at the wrong time.
void check_velocity(const model::Problem& problem, const model::State& state, DiagnosticSink& sink) {
  const model::Advect* transport = find_transport(*state.rhs);
  if (!transport) return;
  const model::Placements placements(problem);
  for (const model::State& read : problem.states) {
    if (!has_moving_walls(problem, read)) continue;
    const auto looks_around = [&](const model::Expr& part) {
      const bool is_difference = is<model::Derivative, model::Interpolate, model::Shift>(part);
      return is_difference && model::reads(part, read.name);
    };
    for (const model::Expr& component : transport->velocity) {
      const bool is_elsewhere = placements.natural(component).value_or(state.placement) != state.placement;
      if (!any_part(component, looks_around) && !(is_elsewhere && model::reads(component, read.name))) continue;
      sink.report(
          "not-allowed-here", component->origin.range.is_known() ? component->origin.range : state.origin.range,
          {"a velocity with differences of " + read.name + ", whose walls move,", "a scene with advect = maccormack"},
          "take advect = semi_lagrangian or upwind(3)");
      return;
    }
  }
}

/// Method of transport of a state.
enum class Method { interpolated, traced, corrected };

/// A state, its transport, and the fields that hold it in the substeps.
struct Moved {
  const Advance* advance;
  const model::State* state;
  const model::Advect* transport;  // nullptr: no transport, or transport by differences
  model::Transport way;
  Method method = Method::interpolated;
  std::string mid = {}, ahead = {};  // after the other terms; after the prediction
  bool is_done = false;              // the prediction is the result

  InterpolationBasis along() const {
    return way.advect == model::Advection::semi_lagrangian && way.order == 3 ? InterpolationBasis::cubic
                                                                             : InterpolationBasis::linear;
  }
};

/// Whether the velocity depends on states.
bool is_of_states(const model::Problem& problem, const model::Advect& advect) {
  return std::ranges::any_of(advect.velocity, [&](const model::Expr& e) {
    return std::ranges::any_of(problem.states, [&](const model::State& state) { return model::reads(e, state.name); });
  });
}

bool is_of_time(const model::Advect& advect) {
  return std::ranges::any_of(advect.velocity, [](const model::Expr& e) {
    return any_part(e, [](const model::Expr& part) {
      const auto* param = as<model::Param>(part);
      return param && param->name == "t";
    });
  });
}

/// Whether the velocity is constant in space and time, so that the displacement is too.
bool is_constant(const model::Advect& advect) {
  return !is_of_time(advect) && std::ranges::all_of(advect.velocity, model::is_uniform);
}

/// Backward displacements with the velocities at the start of the step, as fields; states with the same transport share
/// them.
class Ways {
 public:
  Ways(Lowering& lowering, const std::string& scene)
      : lowering_(lowering), at_point_(lowering.discretiser()), kernel_(lowering.kernel(scene + "_trace")) {}

  const std::vector<std::string>& of(const Moved& moved) {
    for (const Known& known : known_) {
      if (known.velocity == moved.transport->velocity && known.placement == moved.state->placement) return known.fields;
    }
    const std::vector<Expr> back = Departure(lowering_.problem(), *moved.state, at_point_).way(*moved.transport, true);
    std::vector<std::string> fields;
    for (std::size_t axis = 0; axis < back.size(); ++axis) {
      fields.push_back(lowering_.fresh_field_at("way_" + axis_letter(static_cast<int>(axis)), moved.state->placement));
      kernel_.stores.push_back({fields.back(), false, back[axis], moved.state->origin});
    }
    known_.push_back({moved.transport->velocity, moved.state->placement, std::move(fields)});
    return known_.back().fields;
  }
  Stage stage() { return Lowering::stage(std::move(kernel_), at_point_, param("t") + param("dt")); }

 private:
  struct Known {
    std::vector<model::Expr> velocity;
    model::Placement placement;
    std::vector<std::string> fields;
  };
  Lowering& lowering_;
  Discretiser at_point_;
  Kernel kernel_;
  std::vector<Known> known_;
};

class TransportStep {
 public:
  TransportStep(Lowering& lowering, const std::vector<Advance>& advances) : lowering_(lowering) {
    const model::Scheme& scheme = lowering.problem().scheme;
    for (const Advance& advance : advances) {
      const model::Transport& way = scheme.transport_of(advance.state);
      const model::Advect* transport = model::is_semi_lagrangian(way.advect) ? find_transport(advance.rate) : nullptr;
      moved_.push_back({&advance, lowering.problem().find_state(advance.state), transport, way});
      moved_.back().mid = moved_.back().ahead = advance.state;
    }
    choose_methods();
  }

  std::vector<Stage> take() {
    std::vector<Stage> stages = stages_of_terms();
    if (Stage first = prediction(); !first.kernel.stores.empty()) stages.push_back(std::move(first));
    const auto has = [&](Method method) { return std::ranges::find(moved_, method, &Moved::method) != moved_.end(); };
    const auto is_left = [](const Moved& moved) { return moved.method == Method::interpolated && !moved.is_done; };
    if (std::ranges::any_of(moved_, is_left)) stages.push_back(interpolated());
    if (has(Method::traced)) add_traced(stages);
    if (has(Method::corrected)) stages.push_back(corrected());
    return stages;
  }

 private:
  const model::Problem& problem() const { return lowering_.problem(); }

  /// A state without transport takes part in the step of a state with transport.
  void choose_methods() {
    const auto is_traced = [](const Moved& moved) {
      return moved.transport && moved.along() == InterpolationBasis::cubic && !is_constant(*moved.transport);
    };
    const bool traces = std::ranges::any_of(moved_, is_traced);
    std::optional<Method> any;
    for (Moved& moved : moved_) {
      if (model::is_maccormack(moved.way.advect)) {
        moved.method = Method::corrected;
      } else if (traces && moved.along() == InterpolationBasis::cubic) {
        moved.method = Method::traced;
      }
      if (moved.transport) any = moved.method;
    }
    for (Moved& moved : moved_) {
      if (!moved.transport && any && !has_carried(moved.method)) moved.method = *any;
    }
  }

  bool has_carried(Method method) const {
    return std::ranges::any_of(
        moved_, [&](const Moved& moved) { return moved.transport != nullptr && moved.method == method; });
  }

  /// The time integrator's stages for all terms but transport; sets `mid` to the names of the resulting fields.
  std::vector<Stage> stages_of_terms() {
    std::vector<Advance> advances;
    for (Moved& moved : moved_) {
      const std::optional<model::Expr> terms =
          moved.transport ? without_transport(moved.advance->rate) : moved.advance->rate;
      if (!terms || is_literal(*terms, 0)) continue;
      moved.mid = moved.ahead = lowering_.field_beside(moved.state->name, "mid");
      advances.push_back({moved.state->name, *terms, moved.mid, moved.state->origin});
    }
    if (advances.empty()) return {};
    StepPart part;
    part.is_projected = false;  // the projection is at the end of the step
    return time_stages(lowering_, advances, problem().scene + "_terms", problem().scene, part);
  }

  /// Environment at the end of the step, with the fields after the other terms (`mid`) or the prediction (`ahead`).
  Environment reading(std::string Moved::*name) const {
    Environment reading;
    for (const Moved& moved : moved_) {
      if (moved.*name != moved.state->name) reading.fields[moved.state->name] = moved.*name;
    }
    reading.time = param("t") + param("dt");
    return reading;
  }

  /// Whether a velocity at the end of the step is needed, which may depend on all states.
  bool looks_ahead() const {
    return std::ranges::any_of(moved_, [&](const Moved& moved) {
      if (!moved.transport || moved.way.advect == model::Advection::maccormack_steady) return false;
      return moved.method == Method::corrected ||
             (moved.method == Method::traced && is_of_states(problem(), *moved.transport));
    });
  }

  /// Without other terms, the velocities after them are those at the start of the step.
  bool is_predicted(const Moved& moved) const {
    const bool has_terms = std::ranges::any_of(moved_, [](const Moved& m) { return m.mid != m.state->name; });
    return !has_terms && moved.method == Method::interpolated && !is_of_time(*moved.transport);
  }

  /// The forward step with the velocity at its start; sets `ahead` to the names of its results.
  Stage prediction() {
    Discretiser at_point = lowering_.discretiser();
    Kernel kernel = lowering_.kernel(problem().scene + "_advect");
    const bool of_all = looks_ahead();
    for (Moved& moved : moved_) {
      if (!moved.transport || !(of_all || moved.method == Method::corrected)) continue;
      moved.is_done = is_predicted(moved);
      moved.ahead = moved.is_done ? moved.advance->into : lowering_.field_beside(moved.state->name, "ahead");
      Departure departure(problem(), *moved.state, at_point);
      const Expr value = departure.taken(moved.mid, departure.way(*moved.transport, true), moved.along());
      kernel.stores.push_back({moved.ahead, false, value, moved.state->origin});
    }
    return Lowering::stage(std::move(kernel), at_point, param("t") + param("dt"));
  }

  void store(Kernel& kernel, const Moved& moved, const Expr& value) const {
    kernel.stores.push_back({moved.advance->into, false, value, moved.state->origin});
  }

  Stage interpolated() const {
    const Environment at_end = reading(&Moved::mid);
    Discretiser at_point = lowering_.discretiser(at_end);
    Kernel kernel = lowering_.kernel(problem().scene + "_advect");
    for (const Moved& moved : moved_) {
      if (moved.method != Method::interpolated || moved.is_done) continue;
      Departure departure(problem(), *moved.state, at_point);
      store(kernel, moved,
            moved.transport ? departure.taken(moved.mid, departure.way(*moved.transport, true), moved.along())
                            : access(moved.mid));
    }
    return Lowering::stage(std::move(kernel), at_point, at_end.time);
  }

  /// Departure points of second order: the mean of two backward displacements, one with the velocity at the arrival
  /// point at the end of the step, one with the velocity at the start of the step where the former leads to.
  void add_traced(std::vector<Stage>& stages) {
    Ways ways(lowering_, problem().scene);
    const Environment at_end = reading(&Moved::ahead);
    Discretiser at_point = lowering_.discretiser(at_end);
    Kernel kernel = lowering_.kernel(problem().scene + "_carry");
    for (const Moved& moved : moved_) {
      if (moved.method != Method::traced) continue;
      Departure departure(problem(), *moved.state, at_point);
      store(kernel, moved,
            moved.transport ? departure.taken(moved.mid, traced_way(moved, departure, ways), InterpolationBasis::cubic)
                            : access(moved.mid));
    }
    stages.push_back(ways.stage());
    stages.push_back(Lowering::stage(std::move(kernel), at_point, at_end.time));
  }

  std::vector<Expr> traced_way(const Moved& moved, Departure& departure, Ways& ways) const {
    const model::Advect& transport = *moved.transport;
    if (is_constant(transport)) return departure.way(transport, true);
    const std::vector<std::string>& fields = ways.of(moved);
    const bool is_steady = !is_of_time(transport) && !is_of_states(problem(), transport);
    std::vector<Expr> back;
    for (std::size_t axis = 0; axis < fields.size() && is_steady; ++axis) back.push_back(access(fields[axis]));
    if (!is_steady) back = departure.shared_way("back", departure.way(transport, true));
    const std::vector<Expr> first = back;
    for (std::size_t axis = 0; axis < fields.size(); ++axis)
      back[axis] = (first[axis] + departure.taken(fields[axis], first, InterpolationBasis::cubic)) / 2.0;
    return departure.shared_way("mean", back);
  }

  /// The reverse step, and the correction by half of its error.
  Stage corrected() const {
    Discretiser at_point = lowering_.discretiser();
    std::vector<std::vector<Expr>> back, forth(moved_.size());
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      const Moved& moved = moved_[i];
      const bool is_here = moved.method == Method::corrected && moved.transport;
      Departure departure(problem(), *moved.state, at_point);
      back.push_back(is_here ? departure.shared_way("back", departure.way(*moved.transport, true))
                             : std::vector<Expr>{});
      if (is_here && moved.way.advect == model::Advection::maccormack_steady)
        for (const Expr& way : back.back()) forth[i].push_back(-way);
    }
    const Environment at_end = reading(&Moved::ahead);
    at_point.read(at_end);
    Kernel kernel = lowering_.kernel(problem().scene + "_correct");
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      const Moved& moved = moved_[i];
      if (moved.method != Method::corrected) continue;
      Departure departure(problem(), *moved.state, at_point);
      store(kernel, moved, moved.transport ? clamped(moved, departure, back[i], forth[i]) : access(moved.mid));
    }
    return Lowering::stage(std::move(kernel), at_point, at_end.time);
  }

  /// `forth` is empty if the velocity at the end of the step is used.
  static Expr clamped(const Moved& moved, Departure& departure, const std::vector<Expr>& back,
                      std::vector<Expr> forth) {
    const bool is_steady = moved.way.advect == model::Advection::maccormack_steady;
    if (!is_steady) forth = departure.shared_way("forth", departure.way(*moved.transport, false));
    const Expr error = (access(moved.mid) - departure.taken(moved.ahead, forth, InterpolationBasis::linear)) / 2.0;
    const Expr corrected = access(moved.ahead) + (is_steady ? error : departure.within_walls(error, back, forth));
    const Bounds bounds = departure.bounds(moved.mid, back);
    return call(Fn::min, {bounds.greatest, call(Fn::max, {corrected, bounds.least})});
  }

  Lowering& lowering_;
  std::vector<Moved> moved_;
};

}  // namespace

void check_semi_lagrangian(const model::Problem& problem, DiagnosticSink& sink) {
  const std::size_t before = sink.all().size();
  const auto advection_of = [&](const model::State& state) { return problem.scheme.transport_of(state.name).advect; };
  for (const model::State& state : problem.states) {
    if (state.rhs && model::is_semi_lagrangian(advection_of(state))) check_state(state, sink);
  }
  if (sink.all().size() > before) return;
  for (const model::State& state : problem.states) {
    if (state.rhs && advection_of(state) == model::Advection::maccormack) check_velocity(problem, state, sink);
  }
}

std::vector<Stage> semi_lagrangian_stages(Lowering& lowering, const std::vector<Advance>& advances) {
  return TransportStep(lowering, advances).take();
}

}  // namespace dpde::stencil
