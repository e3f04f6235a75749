// SPDX-License-Identifier: Apache-2.0
// dpde plot: a picture of an array file.
#include <fmt/format.h>

#include <cstdio>
#include <fmt/ranges.h>

#include <cmath>
#include <filesystem>
#include <memory>

#include "command.h"
#include "driver/files.h"
#include "dpde/runtime/npy.h"
#include "picture.h"
#include "text_plot.h"
#include "verbs.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {


/// A line for one axis, a map for two, the plane in the middle of the first of three.
std::optional<Panel> panel_of(const NpyArray& array, const std::string& title, Job& job) {
  const std::vector<std::int64_t>& shape = array.shape;
  if (shape.empty() || shape.size() > 3 || array.values.empty()) {
    job.sink().report("bad-array-file", {}, {title, fmt::format("it has {} axes and {} values; 1 to 3 axes can be drawn",
                                                                 shape.size(), array.values.size())});
    return std::nullopt;
  }
  if (shape.size() == 1) {
    LinePanel panel;
    panel.title = title;
    panel.x_label = "cell";
    Curve curve{title, {}, array.values};
    for (std::size_t i = 0; i < array.values.size(); ++i) curve.x.push_back(double(i));
    panel.curves.push_back(std::move(curve));
    return panel;
  }
  MapPanel panel;
  panel.title = title;
  panel.x_label = "cell along x";
  panel.y_label = "cell along y";
  panel.nx = int(shape[shape.size() - 1]);
  panel.ny = int(shape[shape.size() - 2]);
  panel.x_high = panel.nx;
  panel.y_high = panel.ny;
  const std::size_t plane = std::size_t(panel.nx) * std::size_t(panel.ny);
  const std::size_t first = shape.size() == 3 ? plane * std::size_t(shape[0] / 2) : 0;
  panel.values.assign(array.values.begin() + std::ptrdiff_t(first), array.values.begin() + std::ptrdiff_t(first + plane));
  return panel;
}

void plot(Job& job, const CommonOptions& options) {
  const fs::path path = options.file;
  if (path.extension() == ".nc") {
    job.sink().report("bad-array-file", {}, {path.string(), "NetCDF files are not read yet; use .npy"});
    return;
  }
  const std::optional<std::string> bytes = driver::read_file(path, {}, job.sink());
  if (!bytes) return;
  std::optional<NpyArray> array;
  try {
    array = parse_npy(*bytes, path.string());
  } catch (const std::exception& error) {
    job.sink().report("bad-array-file", {}, {path.string(), error.what()});
    return;
  }
  const std::optional<Panel> panel = panel_of(*array, path.stem().string(), job);
  if (!panel) return;
  if (const LinePanel* line = std::get_if<LinePanel>(&*panel)) job.say(text_plot(*line, terminal_is_utf8()));
  if (!have_gnuplot()) {
    std::fputs("dpde: gnuplot is not installed: no picture is written\n", stderr);
    return;
  }
  const fs::path folder = options.out.empty() ? path.parent_path() : fs::path(options.out);
  if (!options.out.empty() && !driver::make_folder(folder, job.sink())) return;
  for (const std::string& file : draw(folder / path.stem(), {*panel}, job.sink())) job.wrote(file);
}

}  // namespace

void add_plot(CLI::App& app, int& status) {
  const auto options = std::make_shared<CommonOptions>();
  CLI::App* verb = app.add_subcommand("plot", "a picture (SVG and PNG) of an array file");
  add_common_options(*verb, *options, {.name = false, .compile = false, .seed = false});
  verb->footer("Example:  dpde plot results/u.npy --out pictures");
  on_call(*verb, status, [options] {
    Job job(*options);
    guarded(job, [&] { plot(job, *options); });
    return job.finish({{"files", job.files()}});
  });
}

}  // namespace dpde::tools
