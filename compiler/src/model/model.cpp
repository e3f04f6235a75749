// SPDX-License-Identifier: Apache-2.0
#include "model/model.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "model/analyse/formula.h"
#include "model/build.h"
#include "model/uses.h"

template class dpde::ExprOf<dpde::model::Node>;

namespace dpde::model {

std::string side_name(const Axis& axis, bool is_low) {
  return axis.name + (is_low != axis.runs_down() ? ".low" : ".high");
}

double Axis::place(double s) const {
  if (ends) return *ends - s;
  if (!stretch) return s;
  const auto inside = [&](double t) { return value_at(stretch->map, t); };
  const double length = stretch->high - stretch->low;
  if (topology == Topology::periodic) {
    const double turns = std::floor((s - stretch->low) / length);
    return inside(s - turns * length) + turns * length;
  }
  if (s < stretch->low) return 2 * stretch->low - inside(2 * stretch->low - s);
  if (s > stretch->high) return 2 * stretch->high - inside(2 * stretch->high - s);
  return inside(s);
}

double wave_unit(const std::vector<Axis>& axes) {
  double longest = 0;
  for (const Axis& axis : axes) longest = std::max(longest, axis.cells > 1 ? axis.high - axis.low : 0);
  return 2 * std::numbers::pi / (longest > 0 ? longest : 1);
}

const Datum* Task::datum_of_windows() const {
  const auto begins = std::ranges::find_if(data, &Datum::begins_windows);
  const auto found = begins != data.end() ? begins : std::ranges::find_if(data, &Datum::trajectories);
  return found == data.end() ? nullptr : &*found;
}

const State* Problem::find_state(const std::string& name) const {
  const auto found = std::find_if(states.begin(), states.end(), [&](const State& s) { return s.name == name; });
  return found == states.end() ? nullptr : &*found;
}

const OutputField* Problem::find_shown(const std::string& name) const {
  const auto found = std::ranges::find(shown, name, &OutputField::name);
  return found == shown.end() ? nullptr : &*found;
}

bool Problem::has_faces(std::size_t axis) const {
  const auto is_on_faces = [&](const auto& field) { return field.placement[axis]; };
  return std::ranges::any_of(states, is_on_faces) || std::ranges::any_of(shown, is_on_faces);
}

bool radiates(const State& state) {
  return std::ranges::any_of(state.boundary, [](const AxisSides& sides) {
    return condition_of(sides.low.kind).takes_rate() || condition_of(sides.high.kind).takes_rate();
  });
}

const State* Problem::velocity_of(const std::string& name) const {
  const auto found = std::find_if(states.begin(), states.end(), [&](const State& s) { return s.velocity_of == name; });
  return found == states.end() ? nullptr : &*found;
}

const State* Problem::history_of(const std::string& name) const {
  const auto found = std::find_if(states.begin(), states.end(), [&](const State& s) { return s.history_of == name; });
  return found == states.end() ? nullptr : &*found;
}

const Parameter* Problem::find_param(const std::string& name) const {
  const auto found = std::find_if(params.begin(), params.end(), [&](const Parameter& p) { return p.name == name; });
  return found == params.end() ? nullptr : &*found;
}

const Coefficient* Problem::find_coefficient(const std::string& name) const {
  const auto found = std::ranges::find(coefficients, name, &Coefficient::name);
  return found == coefficients.end() ? nullptr : &*found;
}

const Control* Problem::find_control(const std::string& name) const {
  const auto found = std::ranges::find(controls, name, &Control::name);
  return found == controls.end() ? nullptr : &*found;
}

const Projection* Problem::find_projection(const std::string& state) const {
  const auto found = std::ranges::find(projections, state, &Projection::multiplier);
  return found == projections.end() ? nullptr : &*found;
}

bool Problem::is_projected(const std::string& state) const {
  return std::ranges::any_of(projections, [&](const Projection& projection) {
    return std::ranges::find(projection.updates, state, &Event::Update::state) != projection.updates.end();
  });
}

const network::Network* Problem::find_network(const std::string& name) const {
  const auto found = std::ranges::find(networks, name, &network::Network::name);
  return found == networks.end() ? nullptr : &*found;
}

const Unknown* Problem::find_unknown(const Coefficient& coefficient) const {
  if (!task) return nullptr;
  const auto found = std::ranges::find_if(task->unknowns, [&](const Unknown& u) {
    return u.kind == Unknown::Kind::coefficient && u.name == coefficient.name;
  });
  return found == task->unknowns.end() ? nullptr : &*found;
}

std::string Problem::unit_of(const std::string& name) const {
  const auto found = remarks.units.find(name);
  return found == remarks.units.end() ? "" : found->second;
}

std::vector<std::uint64_t> Problem::noises() const {
  std::set<std::uint64_t> seeds;
  for_each_formula(*this, [&](const Use& use) {
    any_part(use.formula, [&](const Expr& part) {
      if (const auto* noise = as<Noise>(part)) seeds.insert(noise->seed);
      return false;
    });
  });
  return {seeds.begin(), seeds.end()};
}

std::string noise_name(std::uint64_t seed) { return "noise_" + std::to_string(seed); }

}  // namespace dpde::model
