// SPDX-License-Identifier: Apache-2.0
// Detects axes along which nothing varies.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "analysis/unused.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/walk.h"

namespace dpde::analysis {

namespace {

/// Order of values: x fastest; states of a control field one after the other.
bool is_same_along(const std::vector<double>& values, const std::vector<model::Axis>& axes, std::size_t axis) {
  std::size_t stride = 1;
  for (std::size_t a = 0; a < axis; ++a) stride *= static_cast<std::size_t>(axes[a].cells);
  const std::size_t length = stride * static_cast<std::size_t>(axes[axis].cells);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i % length >= stride && !(values[i] == values[i - stride])) return false;
  }
  return true;
}

/// Whether the condition continues constant values beyond the wall.
bool continues(const stencil::Side& side) {
  return condition_of(side.kind).keeps_constants() && is_literal(side.value, 0) && !side.on_wall;
}

bool asks_for_the_wall(const stencil::Module& module, const stencil::Program& program, std::size_t axis) {
  return std::ranges::any_of(stencil::kernels_run(module, program), [&](const stencil::Kernel* kernel) {
    return any_part(*kernel, [&](const stencil::Expr& e) {
      const auto* inside = as<stencil::Inside>(e);
      return inside != nullptr && inside->offset[axis] != 0;
    });
  });
}

/// Whether a step keeps values constant along the axis that are so before.
bool commutes_with_shifts(const driver::Compiled& compiled, const std::string& name, std::size_t axis) {
  const stencil::Program* program = compiled.stencil.find_program(name);
  if (program == nullptr) return true;
  if (program->axes[axis] == Topology::periodic) return true;
  if (!stencil::interface_of(compiled.stencil, *program).networks.empty()) return false;  // they pad at walls
  bool continues_all = true;
  for_each_kind<stencil::Fill>(program->body, [&](const stencil::Fill& fill) {
    continues_all = continues_all && continues(fill.axes[axis].low) && continues(fill.axes[axis].high);
  });
  return continues_all && !asks_for_the_wall(compiled.stencil, *program, axis);
}

bool may_vary_by_task(const model::Problem& problem) {
  if (!problem.task) return false;
  return !problem.task->data.empty() || problem.task->training ||
         std::ranges::any_of(problem.task->unknowns, [](const model::Unknown& u) {
           return u.is_field() || u.kind == model::Unknown::Kind::network;
         });
}

/// Values of the fields that programs read.
class Fields {
 public:
  Fields(const driver::Compiled& compiled, driver::Session& session) : compiled_(compiled), session_(session) {}

  bool are_same_along(const std::string& program, std::size_t axis) {
    const stencil::Program* found = compiled_.stencil.find_program(program);
    if (found == nullptr) return true;
    for (const std::string& input : stencil::interface_of(compiled_.stencil, *found).inputs) {
      if (stencil::is_coordinate(input)) {
        if (input == session_.axes()[axis].name) return false;
      } else if (!is_known(input) || !is_same_along(values_of(input), session_.axes(), axis)) {
        return false;
      }
    }
    return true;
  }

 private:
  /// A task may read fields that its scene omits: terms with a parameter that is 0 there.
  bool is_known(const std::string& field) const {
    return session_.engine().state_index(field) >= 0 || session_.problem().find_coefficient(field) != nullptr;
  }

  std::vector<double> values_of(const std::string& field) {
    const int state = session_.engine().state_index(field);
    return state < 0 ? session_.workspace().dense(field) : session_.initial(state);
  }

  const driver::Compiled& compiled_;
  driver::Session& session_;
};

/// Programs of steps, of outputs, and of exact solutions. Fields computed before the run are checked by their values.
std::vector<std::string> programs_of_a_run(const driver::Compiled& compiled) {
  const stencil::ProgramNames& names = compiled.names;
  std::vector<std::string> programs{compiled.step_name(), names.rate, names.observe, names.shown, names.exact};
  programs.insert(programs.end(), names.losses.begin(), names.losses.end());
  for (const auto& [test, program] : names.tests) programs.push_back(program);
  return programs;
}

}  // namespace

std::vector<Unused> idle_axes(const driver::Compiled& compiled, driver::Session& session) {
  std::vector<Unused> result;
  const std::size_t rank = session.axes().size();
  if (rank < 2 || may_vary_by_task(*compiled.problem)) return result;
  Fields fields(compiled, session);
  for (std::size_t axis = 0; axis < rank; ++axis) {
    bool is_idle = session.axes()[axis].cells > 1;
    for (const std::string& program : programs_of_a_run(compiled))
      is_idle = is_idle && commutes_with_shifts(compiled, program, axis) && fields.are_same_along(program, axis);
    for (std::size_t s = 0; s < session.engine().states().size(); ++s)
      is_idle = is_idle && is_same_along(session.initial(static_cast<int>(s)), session.axes(), axis);
    if (!is_idle) continue;
    std::vector<std::string> others;
    for (std::size_t a = 0; a < rank; ++a) {
      if (a != axis) others.push_back(session.axes()[a].name);
    }
    result.push_back(
        {Unused::Kind::axis, session.axes()[axis].name,
         fmt::format("nothing varies along it, at the start, in coefficients, at walls or by forcing: a grid of {} "
                     "alone is {} times less work",
                     fmt::join(others, " and "), session.axes()[axis].cells)});
  }
  return result;
}

}  // namespace dpde::analysis
