// SPDX-License-Identifier: Apache-2.0
#include "scene_output.h"

#include <fmt/format.h>

#include <cstdio>
#include <set>

#include "codegen/network_table.h"
#include "curve.h"
#include "dpde/runtime/npy.h"
#include "dpde/runtime/weights_file.h"
#include "files/files.h"
#include "model/placement.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

fs::path out_path(const Job& job, const std::string& name) { return fs::path(job.options().out) / name; }

/// None where all cells are of one width.
std::vector<double> faces_of(const model::Axis& axis) {
  std::vector<double> faces;
  for (int i = 0; axis.stretch && i <= axis.cells; ++i) faces.push_back(axis.face(i));
  return faces;
}

MapPanel map_of(const driver::Session& session, const std::string& title, NamedState state) {
  const std::vector<model::Axis> axes = model::axes_at(session.axes(), state.placement);
  std::vector<double>& values = state.values;
  MapPanel panel;
  panel.title = title;
  panel.x_label = axes[0].name;
  panel.y_label = axes[1].name;
  panel.nx = axes[0].cells;
  panel.ny = axes[1].cells;
  panel.x_faces = faces_of(axes[0]);
  panel.y_faces = faces_of(axes[1]);
  panel.x_low = axes[0].face(0);
  panel.x_high = axes[0].face(axes[0].cells);
  panel.y_low = axes[1].face(0);
  panel.y_high = axes[1].face(axes[1].cells);
  const std::size_t plane = std::size_t(panel.nx) * std::size_t(panel.ny);
  std::size_t first = 0;
  if (axes.size() == 3) {
    const int middle = axes[2].cells / 2;
    first = plane * std::size_t(middle);
    panel.title += fmt::format(", {} = {:.4g}", axes[2].name, axes[2].centre(middle));
  }
  if (values.size() > plane) {
    panel.values.assign(values.begin() + std::ptrdiff_t(first), values.begin() + std::ptrdiff_t(first + plane));
  } else {
    panel.values = std::move(values);
  }
  return panel;
}

}  // namespace

Curve curve_of(const driver::Session& session, const NamedState& state) {
  const model::Axis axis = model::axes_at(session.axes(), state.placement)[0];
  return curve_of(state.title, state.values, [&](std::size_t i) { return axis.centre(static_cast<int>(i)); });
}

model::Placement placement_of(const driver::Session& session, const std::string& field) {
  return model::Placements(session.problem()).of(field);
}

void add_state(std::vector<Panel>& panels, const driver::Session& session, const std::string& title, NamedState state) {
  if (session.axes().size() > 1) {
    const std::string of_map = title.empty() ? state.title : state.title + ", " + title;
    panels.push_back(map_of(session, of_map, std::move(state)));
    return;
  }
  if (panels.empty()) {
    LinePanel panel;
    panel.title = title;
    panel.x_label = session.axes()[0].name;
    panels.push_back(std::move(panel));
  }
  std::get<LinePanel>(panels.back()).curves.push_back(curve_of(session, state));
}

std::vector<Panel> panels_of(const driver::Session& session, const std::string& title, std::vector<NamedState> states) {
  std::vector<Panel> panels;
  for (NamedState& state : states) add_state(panels, session, title, std::move(state));
  return panels;
}

std::vector<Panel> panels_of_field(driver::Session& session, const std::string& field, const std::string& title,
                                   const std::vector<std::pair<std::string, std::vector<double>>>& states) {
  const std::size_t size = session.workspace().cell_count(), last = states.front().second.size() / size - 1;
  const model::Coefficient* control = session.problem().find_coefficient(field);
  std::vector<Panel> panels;
  for (const std::size_t interval : std::set<std::size_t>{0, last / 2, last}) {
    std::vector<NamedState> named;
    for (const auto& [name, values] : states) {
      const auto begin = values.begin() + std::ptrdiff_t(interval * size);
      named.push_back({name, {begin, begin + std::ptrdiff_t(size)}, placement_of(session, field)});
    }
    const std::string when = last == 0 || control == nullptr
                                 ? ""
                                 : fmt::format(" from t = {:.6g}", session.time_of(int(interval) * control->every));
    const std::vector<Panel> more = panels_of(session, title + when, std::move(named));
    panels.insert(panels.end(), more.begin(), more.end());
  }
  return panels;
}

bool prepare_out(Job& job) { return job.options().out.empty() || files::make_folder(job.options().out, job.sink()); }

void save_state(Job& job, const std::vector<model::Axis>& axes, const std::string& name,
                const std::vector<double>& values) {
  if (job.options().out.empty()) return;
  const fs::path path = out_path(job, name + ".npy");
  std::vector<std::int64_t> shape;
  std::size_t cells = 1;
  for (const model::Axis& axis : axes) {
    shape.insert(shape.begin(), axis.cells);
    cells *= static_cast<std::size_t>(axis.cells);
  }
  if (values.size() != cells) shape.insert(shape.begin(), static_cast<std::int64_t>(values.size() / cells));
  if (guarded(job, [&] { write_npy(path, shape, values); })) job.wrote(path.string());
}

void save_weights(Job& job, const network::Network& network, const std::vector<double>& values) {
  if (job.options().out.empty()) return;
  const fs::path path = out_path(job, network.name + ".safetensors");
  const codegen::NetworkTable table(network);
  if (guarded(job, [&] { write_weights(path, arrays_of(*table.get(), values), network.real == Precision::f32); }))
    job.wrote(path.string());
}

void save_text(Job& job, const std::string& name, const std::string& text) {
  if (job.options().out.empty()) return;
  const fs::path path = out_path(job, name);
  if (files::write_file(path, text, job.sink())) job.wrote(path.string());
}

void save_picture(Job& job, const std::string& name, const std::vector<Panel>& panels) {
  if (job.options().out.empty()) return;
  if (!have_gnuplot()) {
    std::fputs(fmt::format("dpde: no picture {}: gnuplot is not installed\n", name).c_str(), stderr);
    return;
  }
  for (const std::string& file : draw(out_path(job, name), panels, job.sink())) job.wrote(file);
}

Json json_cells(const driver::Session& session) {
  Json cells = Json::array();
  for (const model::Axis& axis : session.axes()) cells.push_back(axis.cells);
  return cells;
}

std::string cells_text(const driver::Session& session) {
  std::string text;
  for (const model::Axis& axis : session.axes()) text += fmt::format("{}{}", text.empty() ? "" : " x ", axis.cells);
  return text;
}

Json json_of(const std::vector<driver::SolveReport>& solves) {
  Json result = Json::array();
  for (const driver::SolveReport& solve : solves) {
    const SolveNote& note = solve.note;
    result.push_back({{"field", solve.field},
                      {"method", note.method},
                      {"reason", note.reason},
                      {"solves", note.solves},
                      {"iterations", note.iterations},
                      {"most_iterations", note.most_iterations},
                      {"residual", json_number(note.residual)},
                      {"tolerance", note.tolerance},
                      {"incompatible", json_number(note.incompatible)}});
  }
  return result;
}

}  // namespace dpde::tools
