// SPDX-License-Identifier: Apache-2.0
// States of a scene as files and pictures.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "command.h"
#include "driver/session.h"
#include "driver/solve_report.h"
#include "picture.h"

namespace dpde::tools {

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
std::vector<Panel> panels_of(const driver::Session& session, const std::string& title, std::vector<NamedState> states);
/// One after the other, so that no more of each is held than is drawn.
void add_state(std::vector<Panel>& panels, const driver::Session& session, const std::string& title, NamedState state);
/// Adds to what an axis of several curves is called.
void add_label(std::string& label, const std::string& more);
/// Of a field on one axis.
Curve curve_of(const driver::Session& session, const NamedState& state);

/// The same of a field of the scene, the values being called `label`; of a control field its first interval, the one in
/// the middle, and the last.
std::vector<Panel> panels_of_field(driver::Session& session, const std::string& field, const std::string& title,
                                   const std::string& label,
                                   const std::vector<std::pair<std::string, std::vector<double>>>& states);

/// The placement of a state, coefficient or datum.
model::Placement placement_of(const driver::Session& session, const std::string& field);

/// Makes options().out; false and a diagnostic when it cannot. Without --out there are no files: true.
bool prepare_out(Job& job);
/// NAME.npy in the folder of --out, of shape (nz, ny, nx) without the axes that are not there; where there are more
/// values than cells, with their number in front.
void save_state(Job& job, const std::vector<model::Axis>& axes, const std::string& name,
                const std::vector<double>& values);
/// A file in the folder of --out that `write` writes, throwing what is told.
void save_file(Job& job, const std::string& name, const std::function<void(const std::filesystem::path&)>& write);
/// A text file in the folder of --out.
void save_text(Job& job, const std::string& name, const std::string& text);
/// NAME.svg and NAME.png in the folder of --out; says so when there is no gnuplot.
void save_picture(Job& job, const std::string& name, const std::vector<Panel>& panels);

/// Cells an axis, for JSON.
/// NAME.safetensors, in the precision that the network computes with.
void save_weights(Job& job, const network::Network& network, const std::vector<double>& values);

Json json_cells(const driver::Session& session);
/// "128" or "64 x 32".
std::string cells_text(const driver::Session& session);

/// How equations were solved, and why so.
Json json_of(const std::vector<driver::SolveReport>& solves);

}  // namespace dpde::tools
