// SPDX-License-Identifier: Apache-2.0
// dpde plot: pictures of an array file, or one for each stored state.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>

#include "command.h"
#include "files/files.h"
#include "interrupt.h"
#include "plot/field_panels.h"
#include "plot/text_plot.h"
#include "verbs.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

struct PlotOptions : CommonOptions {
  std::string field, slice, range = "common";
  std::optional<double> time;
  bool video = false, film = false, space_time = false;

  bool all_states() const { return video || film || space_time || time.has_value(); }
};

/// The slice through the cell that contains the position; nullopt after a diagnostic.
std::optional<plot::Slice> slice_at(Job& job, const plot::StoredField& field, const std::string& written) {
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
    const plot::StoredAxis& axis = field.axes[a];
    if (axis.name != written.substr(0, equals)) continue;
    const auto [low, high] = std::minmax(axis.low, axis.high);
    if (!(place >= low && place <= high))
      return refuse(fmt::format("{} is from {:.6g} to {:.6g}", axis.name, low, high), "write a place between");
    plot::Slice slice{a, 0};
    const auto distance = [&](std::int64_t i) { return std::abs(plot::centre_of(axis, i) - place); };
    for (std::int64_t i = 1; i < axis.cells; ++i) {
      if (distance(i) < distance(slice.index)) slice.index = i;
    }
    return slice;
  }
  return refuse("there is no axis of that name",
                fmt::format("the axes are {}, {} and {}", field.axes[0].name, field.axes[1].name, field.axes[2].name));
}

/// Reports values that cannot be drawn; returns false with an error if none remain.
bool tell_of_values_left_out(Job& job, const plot::StoredField& field) {
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

/// False after a diagnostic.
bool check_space_time(Job& job, const PlotOptions& options, const plot::StoredField& field) {
  const auto refuse = [&](const std::string& why, const std::string& hint) {
    job.sink().report("bad-option", {}, {"--space-time" + why}, hint);
    return false;
  };
  if (!options.space_time) return true;
  if (options.video || options.film || options.time)
    return refuse(" with --time or a film", "a map over space and time has all states");
  if (field.axes.size() != 1)
    return refuse(fmt::format(": {} has {} axes", field.name, field.axes.size()), "fields on one axis have such a map");
  if (field.times.size() > 1) return true;
  return refuse(fmt::format(": {} has one state", field.name),
                "write output " + field.name + " every ... in the scene");
}

/// False after a diagnostic.
bool check_time(Job& job, const PlotOptions& options, const plot::StoredField& field) {
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

void draw_states(Job& job, const PlotOptions& options, const fs::path& stem,
                 const std::vector<plot::StoredField>& fields, const std::vector<std::optional<plot::Slice>>& slices) {
  const std::vector<std::vector<plot::Panel>> pages = plot::pages_of(fields, slices, options.range == "common");
  if (options.film) {
    for (const std::string& file : plot::draw_film(stem, pages, job.sink())) job.wrote(file);
  }
  for (std::size_t state = 0; options.video && state < pages.size(); ++state) {
    const fs::path frame = fmt::format("{}_{:04}", stem.string(), state);
    for (const std::string& file : plot::draw(frame, pages[state], job.sink(), plot::Formats::png)) job.wrote(file);
    if (job.failed() || interrupt_flag().load()) return;
  }
  if (options.video)
    job.say(fmt::format("a film of them: ffmpeg -framerate 20 -i {}_%04d.png {}.mp4, or --film\n", stem.string(),
                        stem.string()));
}

void plot(Job& job, const PlotOptions& options) {
  interrupt_flag();  // before temporary folders exist
  const auto fields = plot::load_fields(options.file, options.field, options.all_states(), job.sink());
  if (!fields) return;
  std::vector<plot::Panel> panels;
  std::vector<std::optional<plot::Slice>> slices;
  std::string name = fs::path(options.file).stem().string();
  for (const plot::StoredField& field : *fields) {
    if (!check_time(job, options, field) || !check_space_time(job, options, field) ||
        !tell_of_values_left_out(job, field))
      return;
    slices.push_back(options.slice.empty() ? std::nullopt : slice_at(job, field, options.slice));
    if (job.failed()) return;
    if (field.name != name) name += "_" + field.name;  // does not overwrite the picture of dpde run
    if (options.space_time) {
      panels.push_back(plot::space_time_map(field));
      continue;
    }
    plot::add_panels(field, plot::state_at(field, options.time), slices.back(), std::nullopt, panels);
    if (const plot::LinePanel* line = std::get_if<plot::LinePanel>(&panels.back()))
      job.say(plot::text_plot(*line, plot::terminal_is_utf8()));
  }
  if (!plot::have_gnuplot()) return job.tell("gnuplot is not installed: no picture is written");
  const fs::path folder = options.out.empty() ? fs::path(options.file).parent_path() : fs::path(options.out);
  if (!options.out.empty() && !files::make_folder(folder, job.sink())) return;
  const fs::path stem = folder / name;
  if (options.video || options.film) return draw_states(job, options, stem, *fields, slices);
  for (const std::string& file : plot::draw(stem, panels, job.sink())) job.wrote(file);
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
  verb->add_flag("--space-time", options->space_time, "of one axis and a .nc file: a map of all states over x and t");
  verb->add_option("--slice", options->slice, "of three axes: this plane, in place of those through the middle")
      ->type_name("AXIS=PLACE");
  verb->add_flag("--film", options->film, "of a .nc file: all stored states as one film (MP4 by ffmpeg, else GIF)");
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
