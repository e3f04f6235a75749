// SPDX-License-Identifier: Apache-2.0
// dt(u) + c*du/dn = 0 at a side: waves of dt(dt(u)) = c^2*lap(u) at normal incidence are not reflected (Engquist and
// Majda 1977, their first condition). The slope there is -dt(u)/c, which requires a field dt(u).
#include <fmt/format.h>

#include "model/from_ast/names/known_values.h"
#include "model/from_ast/parts.h"
#include "model/print/print_model.h"

namespace dpde::model {

namespace {

class RadiatingSide {
 public:
  RadiatingSide(Elaboration& elaboration, const State& state, std::size_t axis, bool is_low)
      : elaboration_(elaboration), state_(state), axis_(elaboration.problem.axes[axis]), index_(axis) {
    const AxisSides& sides = state.boundary[axis];
    speed_ = is_low ? sides.low.value : sides.high.value;
    range_ = boundary_of_side(elaboration, state.name, axis_.name + (is_low ? ".low" : ".high"))
                 .value_or(state.origin.range);
  }

  void check() {
    const std::string& name = state_.name;
    if (!elaboration_.problem.velocity_of(name)) {
      refuse(fmt::format("the boundary of {0}, which has no equation dt(dt({0})) = ...", name),
             "a field that the flow carries out of the grid leaves by linear, the flow of a constraint by outflow");
    } else if (state_.placement[index_]) {
      refuse(fmt::format("the boundary of {}, which lies on this wall", name), "declare field " + name);
    } else if (axis_.stretch) {
      elaboration_.sink.report("on-stretched-axis", range_, {"radiating", axis_.name}, "leave out stretched");
    } else {
      check_scheme();
      check_speed();
    }
  }

 private:
  void refuse(std::string where, std::string hint) {
    elaboration_.sink.report("not-allowed-here", range_, {"radiating", std::move(where)}, std::move(hint));
  }

  /// Requires dt(u) of the same time wherever u is read.
  void check_scheme() {
    const Scheme& scheme = elaboration_.problem.scheme;
    if (is_leapfrog(scheme.time) || is_implicit(scheme.time) || is_exponential(scheme.time))
      elaboration_.sink.report("schemes-do-not-fit", range_, {print(scheme.time), "radiating"},
                               "take time = verlet or rk4");
    else if (scheme.is_split())
      refuse("a scene whose steps are split", "leave out split");
    else if (state_.parts > 1)
      refuse("a scene with subcycle", "make all steps shorter");
  }

  void check_speed() {
    std::optional<double> bad;
    const auto look = [&](KnownValues known) {
      for (const double t :
           holds_time(speed_) ? times_of_run(elaboration_.problem) : std::vector{elaboration_.problem.t_begin}) {
        known["t"] = t;
        const std::optional<double> speed = known_value(speed_, known);
        if (speed && !(*speed > 0)) bad = speed;
      }
    };
    look(elaboration_.params.values);
    if (elaboration_.problem.task) look(values_at_start(elaboration_));
    if (bad)
      elaboration_.sink.report("bad-setting", range_,
                               {"the speed of radiating(c)", fmt::format("{}", *bad), "c > 0 goes outwards"},
                               "write radiating(c) with the speed of the wave at both sides");
  }

  Elaboration& elaboration_;
  const State& state_;
  const Axis& axis_;
  std::size_t index_;
  Expr speed_ = 0.0;
  SourceRange range_;
};

}  // namespace

void check_radiating(Elaboration& elaboration, const State& state) {
  for (std::size_t axis = 0; axis < state.boundary.size(); ++axis) {
    if (elaboration.problem.axes[axis].topology == Topology::periodic) continue;
    for (const bool is_low : {true, false}) {
      const AxisSides& sides = state.boundary[axis];
      if (condition_of((is_low ? sides.low : sides.high).kind).takes_rate())
        RadiatingSide(elaboration, state, axis, is_low).check();
    }
  }
}

void check_radiating(Elaboration& elaboration) {
  for (const State& state : elaboration.problem.states) {
    if (state.history_of.empty()) check_radiating(elaboration, state);  // others copy these sides
  }
}

}  // namespace dpde::model
