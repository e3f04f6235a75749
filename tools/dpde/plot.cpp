// SPDX-License-Identifier: Apache-2.0
// dpde plot: pictures of an array file, or a picture a stored state.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
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
  std::string field, slice, range = "common";
  std::optional<double> time;
  bool video = false, film = false;

  bool all_states() const { return video || film || time.has_value(); }
};

/// A plane of a field on three axes.
struct Slice {
  std::size_t axis = 2;
  std::int64_t index = 0;
};

std::string title_of(const StoredField& field, std::size_t state) {
  if (field.times.empty()) return field.name;
  return fmt::format("{} at t = {:.6g}{}", field.name, field.times[state], behind_number(field.time_unit));
}

double centre_of(const StoredAxis& axis, std::int64_t i) {
  const auto n = static_cast<std::size_t>(i);
  if (!axis.faces.empty()) return (axis.faces[n] + axis.faces[n + 1]) / 2;
  return axis.low + (static_cast<double>(i) + 0.5) * (axis.high - axis.low) / static_cast<double>(axis.cells);
}

Panel line_of(const StoredField& field, std::size_t state, const std::optional<ValueRange>& range) {
  const StoredAxis& x = field.axes[0];
  LinePanel panel;
  panel.title = title_of(field, state);
  panel.x_label = label_of(x.name, x.unit);
  panel.y_label = label_of(field.name, field.unit);
  panel.range = range;
  panel.curves.push_back(curve_of(panel.title, field.states[state],
                                  [&](std::size_t i) { return centre_of(x, static_cast<std::int64_t>(i)); }));
  return panel;
}

Panel map_of(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
             const std::optional<ValueRange>& range) {
  const StoredAxis &x = field.axes[slice && slice->axis == 0 ? 1 : 0],
                   &y = field.axes[!slice || slice->axis == 2 ? 1 : 2];
  MapPanel panel;
  panel.title = title_of(field, state);
  panel.x_label = label_of(x.name, x.unit);
  panel.y_label = label_of(y.name, y.unit);
  panel.value_label = label_of(field.name, field.unit);
  panel.nx = static_cast<int>(x.cells);
  panel.ny = static_cast<int>(y.cells);
  panel.x_low = x.low;
  panel.x_high = x.high;
  panel.y_low = y.low;
  panel.y_high = y.high;
  panel.x_faces = x.faces;
  panel.y_faces = y.faces;
  panel.range = range;
  panel.values = field.states[state];
  if (!slice) return panel;
  const StoredAxis& across = field.axes[slice->axis];
  panel.title +=
      fmt::format(", {} = {:.4g}{}", across.name, centre_of(across, slice->index), behind_number(across.unit));
  panel.values = plane_of(panel.values, {field.axes[0].cells, field.axes[1].cells, field.axes[2].cells},
                          static_cast<int>(slice->axis), slice->index);
  return panel;
}

/// Of the cell that the place lies in; nullopt after a diagnostic.
std::optional<Slice> slice_at(Job& job, const StoredField& field, const std::string& written) {
  const auto refuse = [&](const std::string& why, const std::string& hint = "write --slice z=0.5") {
    job.sink().report("bad-option", {}, {fmt::format("--slice {}: {}", written, why)}, hint);
    return std::nullopt;
  };
  const std::size_t equals = written.find('=');
  if (field.axes.size() != 3)
    return refuse(fmt::format("{} has no three axes", field.name), "leave out --slice: all of the field is shown");
  double place = 0;
  const char *begin = written.data() + std::min(equals, written.size() - 1) + 1, *end = written.data() + written.size();
  if (equals == std::string::npos || std::from_chars(begin, end, place).ptr != end || begin == end)
    return refuse("it is not AXIS=PLACE");
  for (std::size_t a = 0; a < 3; ++a) {
    const StoredAxis& axis = field.axes[a];
    if (axis.name != written.substr(0, equals)) continue;
    Slice slice{a, 0};
    const auto distance = [&](std::int64_t i) { return std::abs(centre_of(axis, i) - place); };
    for (std::int64_t i = 1; i < axis.cells; ++i) {
      if (distance(i) < distance(slice.index)) slice.index = i;
    }
    return slice;
  }
  return refuse("there is no axis of that name");
}

/// A line for one axis, a map for two, three planes for three: those through the middle, or the one that is meant.
void add_panels(const StoredField& field, std::size_t state, const std::optional<Slice>& slice,
                const std::optional<ValueRange>& range, std::vector<Panel>& panels) {
  if (field.axes.size() == 1) return panels.push_back(line_of(field, state, range));
  if (field.axes.size() == 2 || slice) return panels.push_back(map_of(field, state, slice, range));
  std::vector<Panel> planes;
  for (const std::size_t across : {2, 1, 0})
    planes.push_back(map_of(field, state, Slice{across, field.axes[across].cells / 2}, range));
  if (!range) share_range(planes);
  std::ranges::move(planes, std::back_inserter(panels));
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

/// The state nearest to the time.
std::size_t state_at(const StoredField& field, const std::optional<double>& time) {
  std::size_t nearest = field.states.size() - 1;
  for (std::size_t k = 0; time && k < field.times.size(); ++k) {
    if (std::abs(field.times[k] - *time) < std::abs(field.times[nearest] - *time)) nearest = k;
  }
  return nearest;
}

/// False after a diagnostic.
bool check_time(Job& job, const PlotOptions& options, const StoredField& field) {
  const auto refuse = [&](const std::string& why, const std::string& hint) {
    job.sink().report("bad-option", {}, {why}, hint);
    return false;
  };
  if (!options.time) return true;
  if (options.video || options.film)
    return refuse("--time and a film", "--time is of one picture; a film has all states");
  if (field.times.empty()) return true;
  const auto [first, last] = std::ranges::minmax(field.times);
  const double slack = 1e-6 * std::max(std::abs(first), std::abs(last));
  if (*options.time >= first - slack && *options.time <= last + slack) return true;
  return refuse(
      fmt::format("--time {}: states of {} are from t = {:.6g} to {:.6g}", *options.time, field.name, first, last),
      fmt::format("write --time {:.6g}, or one between: the state nearest to it is shown", last));
}

using Slices = std::vector<std::optional<Slice>>;  // a field

/// Each state on a page.
std::vector<std::vector<Panel>> pages_of(const PlotOptions& options, const std::vector<StoredField>& fields,
                                         const Slices& slices) {
  std::vector<std::optional<ValueRange>> ranges;
  for (const StoredField& field : fields)
    ranges.push_back(options.range == "common" ? common_range(field) : std::nullopt);
  std::vector<std::vector<Panel>> pages(fields[0].states.size());
  for (std::size_t state = 0; state < pages.size(); ++state) {
    for (std::size_t f = 0; f < fields.size(); ++f) add_panels(fields[f], state, slices[f], ranges[f], pages[state]);
  }
  return pages;
}

void draw_states(Job& job, const PlotOptions& options, const fs::path& stem, const std::vector<StoredField>& fields,
                 const Slices& slices) {
  const std::vector<std::vector<Panel>> pages = pages_of(options, fields, slices);
  if (options.film) {
    for (const std::string& file : draw_film(stem, pages, job.sink())) job.wrote(file);
  }
  for (std::size_t state = 0; options.video && state < pages.size(); ++state) {
    const fs::path frame = fmt::format("{}_{:04}", stem.string(), state);
    for (const std::string& file : draw(frame, pages[state], job.sink(), Formats::png)) job.wrote(file);
    if (job.failed() || interrupt_flag().load()) return;
  }
  if (options.video)
    job.say(fmt::format("a film of them: ffmpeg -framerate 20 -i {}_%04d.png {}.mp4, or --film\n", stem.string(),
                        stem.string()));
}

void plot(Job& job, const PlotOptions& options) {
  interrupt_flag();  // before there are temporary folders
  const auto fields = load_fields(job, options.file, options.field, options.all_states());
  if (!fields) return;
  std::vector<Panel> panels;
  Slices slices;
  std::string name = fs::path(options.file).stem().string();
  for (const StoredField& field : *fields) {
    if (!check_time(job, options, field) || !tell_of_values_left_out(job, field)) return;
    slices.push_back(options.slice.empty() ? std::nullopt : slice_at(job, field, options.slice));
    if (job.failed()) return;
    if (field.name != name) name += "_" + field.name;  // beside the picture that run made
    add_panels(field, state_at(field, options.time), slices.back(), std::nullopt, panels);
    if (const LinePanel* line = std::get_if<LinePanel>(&panels.back())) job.say(text_plot(*line, terminal_is_utf8()));
  }
  if (!have_gnuplot()) return job.tell("gnuplot is not installed: no picture is written");
  const fs::path folder = options.out.empty() ? fs::path(options.file).parent_path() : fs::path(options.out);
  if (!options.out.empty() && !files::make_folder(folder, job.sink())) return;
  const fs::path stem = folder / name;
  if (options.video || options.film) return draw_states(job, options, stem, *fields, slices);
  for (const std::string& file : draw(stem, panels, job.sink())) job.wrote(file);
}

}  // namespace

void add_plot(CLI::App& app, Console& console) {
  const auto options = std::make_shared<PlotOptions>();
  CLI::App* verb = app.add_subcommand("plot", "a picture (SVG and PNG) of an array file");
  add_common_options(*verb, *options, console, {.name = false, .compile = false, .seed = false});
  verb->get_option("file")->description("the .nc or .npy file");
  verb->add_option("--field", options->field, "of a .nc file: this field only")->type_name("NAME");
  verb->add_option("--time", options->time, "of a .nc file: the state nearest to it, in place of the last")
      ->type_name("T");
  verb->add_option("--slice", options->slice, "of three axes: this plane, in place of those through the middle")
      ->type_name("AXIS=PLACE");
  verb->add_flag("--film", options->film, "of a .nc file: all stored states as one GIF");
  verb->add_flag("--video", options->video, "of a .nc file: a PNG for each stored state");
  verb->add_option("--range", options->range, "of the colours of films and videos: of all states, or of each")
      ->check(CLI::IsMember({"common", "each"}))
      ->capture_default_str();
  verb->footer(
      "Examples:\n  dpde plot results/wave.nc --field u --out pictures\n  dpde plot results/wave.nc --film\n"
      "  dpde plot results/block.nc --field p --time 0.5 --slice z=0.25\n"
      "  dpde plot results/u.npy");
  on_call(*verb, console, [options] {
    Job job(*options);
    guarded(job, [&] { plot(job, *options); });
    return job.finish({{"files", job.files()}});
  });
}

}  // namespace dpde::tools
