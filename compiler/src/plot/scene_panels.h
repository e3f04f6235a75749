// SPDX-License-Identifier: Apache-2.0
// States of a scene as panels of a picture.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "driver/scene/session.h"
#include "plot/picture.h"

namespace dpde::plot {

/// What panels are of: a scene, and its axes with the cells of a run.
struct SceneView {
  SceneView(const driver::Session& session) : problem(session.problem()), axes(session.axes()) {}  // NOLINT: a view
  SceneView(const model::Problem& of, const std::vector<model::Axis>& with) : problem(of), axes(with) {}
  const model::Problem& problem;
  const std::vector<model::Axis>& axes;
};

/// "x [m]"; the name alone where no unit is known.
std::string label_of(const model::Problem& problem, const std::string& name);
/// "t = 0.5 s"
std::string time_text(const model::Problem& problem, double t);

/// A dense state (x fastest) with a name for the picture.
struct NamedState {
  std::string title;
  std::vector<double> values;
  model::Placement placement{};
  std::string label;  // of the axis of its values
};

/// 1-D: one panel with a curve each. 2-D: a map each, 3-D three, of the planes through the middle; all of them in the
/// colours of one range, so that states can be compared.
std::vector<Panel> panels_of(const SceneView& scene, const std::string& title, std::vector<NamedState> states);
/// One after the other, so that no more of each is held than is drawn.
void add_state(std::vector<Panel>& panels, const SceneView& scene, const std::string& title, NamedState state);
/// Adds to what an axis of several curves is called.
void add_label(std::string& label, const std::string& more);
/// Of a field on one axis.
Curve curve_of(const SceneView& scene, const NamedState& state);

/// The same of a field of the scene, the values being called `label`; of a control field its first interval, the one in
/// the middle, and the last.
std::vector<Panel> panels_of_field(driver::Session& session, const std::string& field, const std::string& title,
                                   const std::string& label,
                                   const std::vector<std::pair<std::string, std::vector<double>>>& states);

}  // namespace dpde::plot
