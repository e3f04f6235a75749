// SPDX-License-Identifier: Apache-2.0
#include "data_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "dpde/runtime/bytes.h"
#include "files/data_set_cost.h"
#include "files/files.h"
#include "interrupt.h"
#include "netcdf_output.h"
#include "preparing.h"
#include "progress.h"
#include "report/finished.h"
#include "report/training/data_set.h"
#include "scene_output.h"
#include "stability/stability_report.h"
#include "support/names/number_text.h"
#include "syntax/parser.h"
#include "training/data/data_run_file.h"
#include "training/data/data_set_content.h"

namespace dpde::tools {

namespace {

std::unique_ptr<training::DataSetMaker> open(Job& job) {
  DiagnosticSink silent;
  const ast::File file = ast::parse(job.source(), silent);
  std::optional<model::DataSet> set = model::data_set_from_ast(file, job.options().name, job.sink());
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!set || !compile_options) return nullptr;
  const training::DataSetOptions options{compile_options->selection, compile_options->backend,
                                         compile_options->cache,     thread_count(job.options()),
                                         &interrupt_flag(),          stability::judge_of_steps(job.options().force)};
  const Preparing preparing(job);
  return training::DataSetMaker::open(job.source(), std::move(*set), options, job.sink());
}

/// Key of the whole file: the kind and number of runs.
std::uint64_t key_of_all(const training::DataSetMaker& maker) {
  const std::string text = fmt::format("{:016x} {}", maker.key(), maker.set().runs);
  return hash_bytes(text.data(), text.size());
}

/// Checks that all result files can be written, before the runs.
bool can_write(Job& job, const training::DataSetMaker& maker) {
  for (const model::DataSet::Grid& grid : maker.set().grids) {
    for (const std::string& file : {grid.file, files::cost_file_of(grid.file)}) {
      const std::filesystem::path path = std::filesystem::path(job.options().out) / file;
      std::error_code error;
      if (std::filesystem::is_directory(path, error))
        job.sink().report("cannot-write", {}, {path.string(), "it is a folder"});
    }
  }
  return !job.failed();
}

/// The reports of all files, if all of them exist.
std::optional<std::vector<report::Report>> told_of_all(const Job& job, const training::DataSetMaker& maker) {
  std::vector<report::Report> all;
  for (const model::DataSet::Grid& grid : maker.set().grids) {
    std::optional<report::Report> told =
        report::report_of_finished(std::filesystem::path(job.options().out) / grid.file, key_of_all(maker));
    if (!told) return std::nullopt;
    all.push_back(std::move(*told));
  }
  return all;
}

/// The first file's report, with the others by name.
Json data_set_json(const model::DataSet& set, const std::vector<report::Report>& told) {
  Json json = told[0].json;
  for (std::size_t g = 1; g < told.size(); ++g) json["others"][set.grids[g].file] = told[g].json;
  return json;
}

/// For a data set that was completed before.
Json again(Job& job, const model::DataSet& set, const std::vector<report::Report>& told) {
  for (std::size_t g = 0; g < told.size(); ++g)
    job.say(fmt::format("{}: all runs are made already, {} is there\n{}", set.name, set.grids[g].file, told[g].text()));
  Json result = data_set_json(set, told);
  result["finished"] = true;
  result["resumed_runs"] = set.runs;
  result["files"] = job.files();
  return result;
}

/// Reports every file.
std::vector<report::Report> tell_all(Job& job, training::DataSetMaker& maker,
                                     const std::vector<training::DataRun>& runs,
                                     const std::vector<training::OrderEstimate>& estimates) {
  std::vector<report::Report> all;
  for (std::size_t g = 0; g < maker.set().grids.size(); ++g) {
    all.push_back(report::data_set_report({maker, runs, g}, estimates));
    tell(job, all.back());
  }
  return all;
}

/// Writes the data set and its cost files; returns the cost in seconds. Each file states the common cost of all, since
/// the runs are the same.
double write_files(Job& job, training::DataSetMaker& maker, const std::vector<training::DataRun>& runs,
                   const std::vector<training::OrderEstimate>& estimates, const std::vector<report::Report>& told) {
  double cpu_seconds = 0;
  for (const training::DataRun& run : runs) cpu_seconds += run.cpu_seconds;
  guarded(job, [&] {
    for (std::size_t g = 0; g < told.size(); ++g) {
      const training::DataFile file{maker, runs, g};
      NetcdfContent content = training::content_of(file, estimates, job.source(), origin_of(job));
      report::add_report(content, key_of_all(maker), told[g]);
      const std::string bytes = compose_netcdf(std::move(content));
      save_text(job, file.grid().file, bytes);
      save_text(job, files::cost_file_of(file.grid().file),
                files::cost_text(hash_bytes(bytes.data(), bytes.size()), cpu_seconds));
    }
  });
  return cpu_seconds;
}

}  // namespace

bool is_data_set(Job& job) {
  if (job.options().name.empty()) return false;
  DiagnosticSink silent;
  const std::vector<std::string> names = model::data_set_names(ast::parse(job.source(), silent));
  return std::ranges::find(names, job.options().name) != names.end();
}

Json make_data_set(Job& job, bool resume, bool quiet) {
  Json result = Json::object();
  if (job.options().out.empty()) {
    job.sink().report("bad-option", {}, {"a data set needs --out DIR, the folder of its file"});
    return result;
  }
  if (!prepare_out(job)) return result;
  const std::unique_ptr<training::DataSetMaker> maker = open(job);
  if (!maker) return result;
  if (!can_write(job, *maker)) return result;
  const model::DataSet& set = maker->set();
  if (const std::optional<std::vector<report::Report>> told = resume ? told_of_all(job, *maker) : std::nullopt)
    return again(job, set, *told);
  const auto start = std::chrono::steady_clock::now();
  Progress progress(job.options().streams.err, false, quiet);
  int done = 0, there = 0;
  const auto is_done = [&](int run) {
    const bool is_there = resume && training::DataRunFile(job.options().out, *maker, run).load().has_value();
    there += is_there ? 1 : 0;
    return is_there;
  };
  const auto take = [&](int run, const training::DataRun& data) {
    training::DataRunFile(job.options().out, *maker, run).save(data, job.sink());
    ++done;
    progress.show(fmt::format("run {} of {}", done, set.runs - there), done, set.runs - there);
  };
  const bool complete = maker->make(is_done, take, job.sink());
  if (interrupt_flag().load()) {
    job.sink().report("optimiser-interrupted", {},
                      {fmt::format("{} (runs)", done + there), fmt::format("{}", set.runs)},
                      "the same command with --resume makes the others");
  }
  if (!complete || job.failed()) return result;
  std::vector<training::DataRun> runs;
  for (int run = 0; run < set.runs; ++run) {
    std::optional<training::DataRun> data = training::DataRunFile(job.options().out, *maker, run).load();
    if (!data) {
      job.sink().report("run-failed", {}, {fmt::format("run {} of dataset {} is no longer there", run, set.name)});
      return result;
    }
    runs.push_back(std::move(*data));
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<training::OrderEstimate> estimates = maker->estimate_order();
  const std::vector<report::Report> told = tell_all(job, *maker, runs, estimates);
  const double cpu_seconds = write_files(job, *maker, runs, estimates, told);
  if (!job.failed()) {
    for (int run = 0; run < set.runs; ++run) training::DataRunFile(job.options().out, *maker, run).remove();
  }
  job.say(fmt::format("made in {}\n", human_seconds(seconds)));
  result = data_set_json(set, told);
  result["cpu_s"] = cpu_seconds;
  result["finished"] = true;
  result["resumed_runs"] = there;
  result["wall_s"] = seconds;
  result["files"] = job.files();
  return result;
}

}  // namespace dpde::tools
