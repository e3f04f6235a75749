// SPDX-License-Identifier: Apache-2.0
// States of a scene as panels of a picture.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "driver/scene/session.h"
#include "plot/picture.h"

namespace dpde::plot {

/// Scene of the panels, and its axes with the cells of a run.
struct SceneView {
  SceneView(const driver::Session& session)  // NOLINT: a view
      : SceneView(session.problem(), session.axes()) {}
  SceneView(const model::Problem& of, const std::vector<model::Axis>& with)
      : problem(of), axes(with), time(of.t_begin) {}
  const model::Problem& problem;
  const std::vector<model::Axis>& axes;
  double time;  // of moving bodies
};

/// "x [m]"; only the name if the unit is unknown.
std::string label_of(const model::Problem& problem, const std::string& name);
/// "t = 0.5 s"; from two days of seconds on "t = 15 d".
std::string time_text(double t, const std::string& unit);
std::string time_text(const model::Problem& problem, double t);

/// A state without ghost cells (x fastest) with a title for the picture.
struct NamedState {
  std::string title;
  std::vector<double> values;
  model::Placement placement{};
  std::string label;  // of the axis of values
};

/// 1-D: one panel with one curve for each state. 2-D: one map each; 3-D: the three middle planes each. All maps share
/// one colour range, so that states can be compared. Beside two maps stands their difference, on colours of the same
/// scale around 0.
std::vector<Panel> panels_of(const SceneView& scene, const std::string& title, std::vector<NamedState> states);
/// Adds the states one by one, so that only drawn values are kept.
void add_state(std::vector<Panel>& panels, const SceneView& scene, const std::string& title, NamedState state);
/// Appends a name to the label of an axis with several curves.
void add_label(std::string& label, const std::string& more);
/// Curve of a field on one axis.
Curve curve_of(const SceneView& scene, const NamedState& state);

/// The same for a field of the scene, with `label` as name of its values; for a control field the first, middle and
/// last interval.
std::vector<Panel> panels_of_field(driver::Session& session, const std::string& field, const std::string& title,
                                   const std::string& label,
                                   const std::vector<std::pair<std::string, std::vector<double>>>& states);

}  // namespace dpde::plot
