// SPDX-License-Identifier: Apache-2.0
// dpde plot: pictures of an array file, or a picture a stored state.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "command.h"
#include "curve.h"
#include "files/files.h"
#include "interrupt.h"
#include "picture.h"
#include "stored_fields.h"
#include "text_plot.h"
#include "verbs.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

struct PlotOptions : CommonOptions {
  std::string field;
  bool video = false;
};

std::string title_of(const StoredField& field, std::size_t state) {
  return field.times.empty() ? field.name : fmt::format("{} at t = {:.6g}", field.name, field.times[state]);
}

/// A line for one axis, a map for two, the plane in the middle of the slowest of three.
Panel panel_of(const StoredField& field, std::size_t state, const std::optional<ValueRange>& range) {
  const std::vector<double>& values = field.states[state];
  const StoredAxis& x = field.axes[0];
  if (field.axes.size() == 1) {
    LinePanel panel;
    panel.title = title_of(field, state);
    panel.x_label = x.label;
    panel.range = range;
    const double spacing = (x.high - x.low) / static_cast<double>(x.cells);
    panel.curves.push_back(curve_of(panel.title, values, [&](std::size_t i) {
      const bool is_uniform = x.faces.empty();
      return is_uniform ? x.low + (static_cast<double>(i) + 0.5) * spacing : (x.faces[i] + x.faces[i + 1]) / 2;
    }));
    return panel;
  }
  const StoredAxis& y = field.axes[1];
  MapPanel panel;
  panel.title = title_of(field, state);
  panel.x_label = x.label;
  panel.y_label = y.label;
  panel.nx = static_cast<int>(x.cells);
  panel.ny = static_cast<int>(y.cells);
  panel.x_low = x.low;
  panel.x_high = x.high;
  panel.y_low = y.low;
  panel.y_high = y.high;
  panel.x_faces = x.faces;
  panel.y_faces = y.faces;
  panel.range = range;
  const std::int64_t plane = x.cells * y.cells;
  const std::int64_t first = field.axes.size() == 3 ? plane * (field.axes[2].cells / 2) : 0;
  panel.values.assign(values.begin() + first, values.begin() + first + plane);
  return panel;
}

/// False, and an error, when nothing is left to draw.
bool tell_of_values_left_out(Job& job, const StoredField& field) {
  std::size_t all = 0, bad = 0;
  for (const std::vector<double>& state : field.states) {
    all += state.size();
    bad +=
        static_cast<std::size_t>(std::count_if(state.begin(), state.end(), [](double v) { return !std::isfinite(v); }));
  }
  if (bad == all) {
    job.sink().report("bad-array-file", {},
                      {job.options().file, fmt::format("none of the {} values of {} is finite", all, field.name)});
  } else if (bad > 0) {
    job.sink().report("not-finite-in-plot", {}, {fmt::format("{}", bad), fmt::format("{}", all), field.name});
  }
  return bad < all;
}

/// Over all states, so that the frames of a video share it.
std::optional<ValueRange> common_range(const StoredField& field) {
  std::vector<double> ends;
  for (const std::vector<double>& state : field.states) {
    if (const std::optional<ValueRange> range = range_of(state)) ends.insert(ends.end(), {range->low, range->high});
  }
  return range_of(ends);
}

void draw_frames(Job& job, const fs::path& stem, const std::vector<StoredField>& fields) {
  std::vector<std::optional<ValueRange>> ranges;
  for (const StoredField& field : fields) ranges.push_back(common_range(field));
  for (std::size_t state = 0; state < fields[0].states.size(); ++state) {
    std::vector<Panel> panels;
    for (std::size_t f = 0; f < fields.size(); ++f) panels.push_back(panel_of(fields[f], state, ranges[f]));
    const fs::path frame = fmt::format("{}_{:04}", stem.string(), state);
    for (const std::string& file : draw(frame, panels, job.sink(), Formats::png)) job.wrote(file);
    if (job.failed() || interrupt_flag().load()) return;
  }
  job.say(fmt::format("a film of them: ffmpeg -framerate 20 -i {}_%04d.png {}.mp4\n", stem.string(), stem.string()));
}

void plot(Job& job, const PlotOptions& options) {
  interrupt_flag();  // before there are temporary folders
  const std::optional<std::vector<StoredField>> fields = load_fields(job, options.file, options.field, options.video);
  if (!fields) return;
  std::vector<Panel> panels;
  std::string name = fs::path(options.file).stem().string();
  for (const StoredField& field : *fields) {
    if (!tell_of_values_left_out(job, field)) return;
    if (field.name != name) name += "_" + field.name;  // beside the picture that run made
    panels.push_back(panel_of(field, field.states.size() - 1, std::nullopt));
    if (const LinePanel* line = std::get_if<LinePanel>(&panels.back())) job.say(text_plot(*line, terminal_is_utf8()));
  }
  if (!have_gnuplot()) {
    std::fputs("dpde: gnuplot is not installed: no picture is written\n", stderr);
    return;
  }
  const fs::path folder = options.out.empty() ? fs::path(options.file).parent_path() : fs::path(options.out);
  if (!options.out.empty() && !files::make_folder(folder, job.sink())) return;
  const fs::path stem = folder / name;
  if (options.video) {
    draw_frames(job, stem, *fields);
  } else {
    for (const std::string& file : draw(stem, panels, job.sink())) job.wrote(file);
  }
}

}  // namespace

void add_plot(CLI::App& app, int& status) {
  const auto options = std::make_shared<PlotOptions>();
  CLI::App* verb = app.add_subcommand("plot", "a picture (SVG and PNG) of an array file");
  add_common_options(*verb, *options, {.name = false, .compile = false, .seed = false});
  verb->get_option("file")->description("the .nc or .npy file");
  verb->add_option("--field", options->field, "of a .nc file: this field only")->type_name("NAME");
  verb->add_flag("--video", options->video, "of a .nc file: a PNG for each stored state");
  verb->footer(
      "Examples:\n  dpde plot results/wave.nc --field u --out pictures\n  dpde plot results/wave.nc --video\n"
      "  dpde plot results/u.npy");
  on_call(*verb, status, [options] {
    Job job(*options);
    guarded(job, [&] { plot(job, *options); });
    return job.finish({{"files", job.files()}});
  });
}

}  // namespace dpde::tools
