// SPDX-License-Identifier: Apache-2.0
#include "scene_output.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>
#include <numeric>

#include "codegen/network_table.h"
#include "dpde/runtime/npy.h"
#include "dpde/runtime/weights_file.h"
#include "files/files.h"
#include "shared_folder.h"
#include "support/match.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

fs::path out_path(const Job& job, const std::string& name) { return fs::path(job.options().out) / name; }

}  // namespace

bool prepare_out(Job& job) {
  const std::string& out = job.options().out;
  std::error_code error;
  if (!out.empty() && !std::filesystem::exists(out, error)) job.makes(out);
  return out.empty() || files::make_folder(out, job.sink());
}

void save_file(Job& job, const std::string& name, const std::function<void(const fs::path&)>& write) {
  if (job.options().out.empty()) return;
  const fs::path path = out_path(job, name);
  keep_file_of_others(job, path);
  if (guarded(job, [&] { write(path); })) job.wrote(path.string());
}

void save_state(Job& job, const std::vector<model::Axis>& axes, const std::string& name,
                const std::vector<double>& values) {
  std::vector<std::int64_t> shape;  // z first, without absent axes
  for (const model::Axis& axis : axes) shape.insert(shape.begin(), axis.cells);
  const std::int64_t cells = std::reduce(shape.begin(), shape.end(), std::int64_t{1}, std::multiplies());
  const auto count = static_cast<std::int64_t>(values.size());
  if (count != cells) shape.insert(shape.begin(), count / cells);
  save_file(job, name + ".npy", [&](const fs::path& path) { write_npy(path, shape, values); });
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
  keep_file_of_others(job, path);
  if (files::write_file(path, text, job.sink())) job.wrote(path.string());
}

void save_picture(Job& job, const std::string& name, const std::vector<plot::Panel>& panels) {
  if (job.options().out.empty()) return;
  if (!plot::have_gnuplot()) return job.tell(fmt::format("no picture {}: gnuplot is not installed", name));
  for (const std::string& file : plot::draw(out_path(job, name), panels, job.sink())) job.wrote(file);
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

void tell(Job& job, const report::Report& report) {
  for (const auto& part : report.parts) {
    match(
        part, [&](const std::string& words) { job.say(words); },
        [&](const report::Detail& detail) { job.say(detail.text); },
        [&](const report::TextFile& file) { save_text(job, file.name, file.text); },
        [&](const report::Picture& picture) { save_picture(job, picture.name, picture.panels); });
  }
}

}  // namespace dpde::tools
