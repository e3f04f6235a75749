// SPDX-License-Identifier: Apache-2.0
#include "data_set.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "dpde/runtime/bytes.h"
#include "driver/restart_file.h"
#include "driver/run_description.h"
#include "files/data_set_cost.h"
#include "files/files.h"
#include "files/trajectories.h"
#include "interrupt.h"
#include "netcdf_output.h"
#include "preparing.h"
#include "progress.h"
#include "scene_output.h"
#include "stability/verdict.h"
#include "support/evaluate.h"
#include "support/number_text.h"
#include "syntax/parser.h"
#include "syntax/print_ast.h"
#include "training/data_set.h"

namespace dpde::tools {

namespace {

/// A run on disk: what it is of, its numbers, then a checksum of all before it.
class Part {
 public:
  Part(const Job& job, const training::DataSetMaker& maker, int run)
      : path_(std::filesystem::path(job.options().out) / fmt::format("{}.{}", maker.set().grids[0].file, run)),
        key_(static_cast<std::int64_t>(maker.key())) {}

  bool save(const training::DataRun& data, DiagnosticSink& sink) const {
    ByteWriter out;
    out.number(key_);
    out.values(data.params);
    out.number(static_cast<std::int64_t>(data.integrals.size()));
    for (const analysis::Integrals& integrals : data.integrals) {
      out.values(integrals.values);
      out.values({integrals.magnitude});
    }
    out.number(static_cast<std::int64_t>(data.grids.size()));
    for (const training::GridFrames& grid : data.grids) {
      out.number(static_cast<std::int64_t>(grid.frames.size()));
      for (const std::vector<double>& frames : grid.frames) out.values(frames);
      out.number(static_cast<std::int64_t>(grid.residuals.size()));
      for (const analysis::Residual& residual : grid.residuals) out.values({residual.rate, residual.relative});
    }
    out.values({data.cpu_seconds});
    return files::write_file(path_, driver::sealed(out.bytes()), sink);
  }
  /// nullopt where it is not there, damaged or of another data set.
  std::optional<training::DataRun> load() const {
    DiagnosticSink silent;
    std::error_code error;
    if (!std::filesystem::exists(path_, error)) return std::nullopt;
    const std::optional<std::string> bytes = files::read_file(path_, {}, silent);
    const std::optional<std::string_view> content = bytes ? driver::unsealed(*bytes) : std::nullopt;
    if (!content) return std::nullopt;
    ByteReader in(*content);
    if (in.number() != key_) return std::nullopt;
    training::DataRun data;
    data.params = in.values();
    for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
      analysis::Integrals integrals{in.values(), 0};
      const std::vector<double> magnitude = in.values();
      if (magnitude.size() != 1) return std::nullopt;
      integrals.magnitude = magnitude[0];
      data.integrals.push_back(std::move(integrals));
    }
    for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
      if (!read_grid(in, data.grids.emplace_back())) return std::nullopt;
    }
    const std::vector<double> seconds = in.values();
    if (seconds.size() != 1) return std::nullopt;
    data.cpu_seconds = seconds[0];
    return in.is_done() ? std::optional(std::move(data)) : std::nullopt;
  }
  void remove() const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

 private:
  static bool read_grid(ByteReader& in, training::GridFrames& grid) {
    for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) grid.frames.push_back(in.values());
    for (std::int64_t n = in.number(); n > 0 && in.is_fine(); --n) {
      const std::vector<double> residual = in.values();
      if (residual.size() != 2) return false;
      grid.residuals.push_back({residual[0], residual[1]});
    }
    return true;
  }

  std::filesystem::path path_;
  std::int64_t key_;
};

/// One file of a data set: the frames of its runs on one grid.
struct DataFile {
  training::DataSetMaker& maker;
  const std::vector<training::DataRun>& runs;
  std::size_t number;

  const model::DataSet::Grid& grid() const { return maker.set().grids[number]; }
  const training::GridFrames& of(const training::DataRun& run) const { return run.grids[number]; }
};

std::vector<model::Axis> axes_of(const DataFile& file) {
  std::vector<model::Axis> axes = file.maker.session().axes();
  const std::vector<int> cells = file.maker.cells(file.grid());
  for (std::size_t a = 0; a < axes.size(); ++a) axes[a].cells = cells[a];
  return axes;
}

/// The block as it stands in the file.
std::string file_text(const Job& job, const std::string& name) {
  DiagnosticSink silent;
  ast::File file = ast::parse(job.source(), silent);
  std::erase_if(file.declarations, [&](const ast::Declaration& declaration) {
    const auto* set = std::get_if<ast::DataSet>(&declaration.kind);
    return set == nullptr || set->name.name != name;
  });
  return print(file);
}

/// The integral of a variable at each frame, and how far it drifts in each run.
void add_integrals(NetcdfContent& content, const std::string& name, std::size_t v, const std::string& time,
                   const std::vector<training::DataRun>& runs, NetcdfNames& names) {
  NetcdfVariable integral{
      names.free(name + "_integral"), {"run", time}, described("integral of " + name + " over the domain"), {}};
  NetcdfVariable drift{names.free(name + "_drift"),
                       {"run"},
                       described("largest distance of the integral of " + name + " from that of the first frame"),
                       {}};
  NetcdfVariable relative{names.free(name + "_relative_drift"),
                          {"run"},
                          described("the same in parts of the integral of its magnitude, a mean over the frames"),
                          {}};
  for (const training::DataRun& run : runs) {
    const analysis::Integrals& own = run.integrals[v];
    integral.values.insert(integral.values.end(), own.values.begin(), own.values.end());
    drift.values.push_back(own.drift());
    relative.values.push_back(own.relative_drift());
  }
  content.variables.insert(content.variables.end(), {std::move(integral), std::move(drift), std::move(relative)});
}

/// How well the frames satisfy the scene, in each run; nothing where that is not known.
void add_residuals(NetcdfContent& content, const std::string& state, std::size_t s, const DataFile& file,
                   NetcdfNames& names) {
  const auto is_unknown = [&](const training::DataRun& run) { return std::isnan(file.of(run).residuals[s].rate); };
  if (std::ranges::any_of(file.runs, is_unknown)) return;
  NetcdfVariable rate{names.free(state + "_residual"),
                      {"run"},
                      described("root of the mean square of what the scene's steps from a frame, on the grid of the "
                                "frames, miss the next one by, in a unit of time"),
                      {}};
  NetcdfVariable relative{names.free(state + "_relative_residual"),
                          {"run"},
                          described("the same in parts of the change from frame to frame"),
                          {}};
  for (const training::DataRun& run : file.runs) {
    rate.values.push_back(file.of(run).residuals[s].rate);
    relative.values.push_back(file.of(run).residuals[s].relative);
  }
  content.variables.insert(content.variables.end(), {std::move(rate), std::move(relative)});
}

NetcdfAttributes attributes_of(const training::OrderEstimate& estimate) {
  if (!estimate.is_known()) return {{files::attribute_of_no_error, estimate.why_not}};
  return {{"order_estimate", estimate.order},
          {"difference_to_twice_the_spacing", estimate.difference},
          {files::attribute_of_error, estimate.error()}};
}

/// The frames of a field or formula, and what is known of them.
void add_variable(NetcdfContent& content, const DataFile& file, std::size_t v, const AxisNames& axes,
                  const std::string& time, const std::vector<training::OrderEstimate>& estimates, NetcdfNames& names) {
  const model::Problem& problem = file.maker.session().problem();
  const training::FrameVariable& frames = file.maker.variables()[v];
  NetcdfVariable variable{
      frames.name,
      {"run", time},
      described((frames.is_state ? "field " : "formula ") + frames.name, problem.unit_of(frames.name)),
      {},
      problem.scheme.real == Precision::f32};
  for (std::size_t a = axes.size(); a-- > 0;) variable.dimensions.push_back(axes[a][frames.placement[a] ? 1 : 0]);
  for (const training::DataRun& run : file.runs) {
    const std::vector<double>& values = file.of(run).frames[v];
    variable.values.insert(variable.values.end(), values.begin(), values.end());
  }
  const auto estimate = std::ranges::find(estimates, frames.name, &training::OrderEstimate::variable);
  const NetcdfAttributes told = attributes_of(*estimate);
  variable.attributes.insert(variable.attributes.end(), told.begin(), told.end());
  content.variables.push_back(std::move(variable));
  add_integrals(content, frames.name, v, time, file.runs, names);
  if (frames.is_state) add_residuals(content, frames.name, v, file, names);
}

NetcdfContent content_of(const Job& job, const DataFile& file, const std::vector<training::OrderEstimate>& estimates) {
  NetcdfContent content;
  training::DataSetMaker& maker = file.maker;
  const std::vector<training::DataRun>& runs = file.runs;
  driver::Session& session = maker.session();
  const model::DataSet& set = maker.set();
  NetcdfNames names = free_names(session);
  content.attributes = attributes_of(job, session);
  content.attributes.insert(content.attributes.end(), {{"dpde_dataset", file_text(job, set.name)},
                                                       {"dpde_dataset_seed", static_cast<double>(set.seed)}});
  const AxisNames axes = add_axes(content, driver::run_axes(session.problem(), axes_of(file)), names);
  const std::string time = names.free("time");
  content.dimensions.insert(content.dimensions.end(), {{"run", static_cast<std::int64_t>(runs.size())},
                                                       {time, static_cast<std::int64_t>(maker.times().size())}});
  content.variables.push_back(time_variable(time, session.problem().unit_of("t"), maker.times()));
  for (std::size_t v = 0; v < maker.variables().size(); ++v) {
    if (maker.variables()[v].is_kept) add_variable(content, file, v, axes, time, estimates, names);
  }
  for (std::size_t v = 0; v < set.vary.size(); ++v) {
    NetcdfVariable variable{set.vary[v].param, {"run"}, described("parameter " + set.vary[v].param), {}};
    if (set.vary[v].counts) variable.attributes.emplace_back(files::attribute_of_counts, "yes");
    for (const training::DataRun& run : runs) variable.values.push_back(run.params[v]);
    content.variables.push_back(std::move(variable));
  }
  for (const RunNumber& param : driver::run_params(session.problem())) {
    const bool varies = std::ranges::find(set.vary, param.name, &model::DataSet::Vary::param) != set.vary.end();
    if (!varies) content.variables.push_back(parameter_variable(param));
  }
  return content;
}

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

/// What a time scheme or a solve keeps of the last step: nobody declared it.
bool is_memory(training::DataSetMaker& maker, const std::string& name) {
  const model::State* state = maker.session().problem().find_state(name);
  return state != nullptr && !state->history_of.empty();
}

void report_estimates(Job& job, training::DataSetMaker& maker, const std::vector<training::OrderEstimate>& estimates,
                      Told& told) {
  Json all = Json::object(), reasons = Json::object();
  for (const training::OrderEstimate& each : estimates) {
    if (is_memory(maker, each.variable)) continue;
    if (!each.is_known()) {
      reasons[each.variable] = each.why_not;
      told.say(job, fmt::format("{}: its error is not known: {}\n", each.variable, each.why_not));
      continue;
    }
    all[each.variable] = {{"order", json_number(each.order)},
                          {"difference", json_number(each.difference)},
                          {"error", json_number(each.error())}};
    told.say(
        job,
        fmt::format("{}: order {:.2f}, error about {:.2g} (from runs with twice and four times the spacing and step)\n",
                    each.variable, each.order, each.error()));
  }
  told.json["estimates"] = std::move(all);
  told.json["without_estimate"] = std::move(reasons);
}

void report_drifts(Job& job, training::DataSetMaker& maker, const std::vector<training::DataRun>& runs, Told& told) {
  Json all = Json::object();
  for (std::size_t v = 0; v < maker.variables().size(); ++v) {
    const std::string& name = maker.variables()[v].name;
    if (!maker.variables()[v].is_kept || is_memory(maker, name)) continue;
    const auto drift = [v](const training::DataRun& run) { return run.integrals[v].drift(); };
    const auto most = std::ranges::max_element(runs, {}, drift);
    const double relative = most->integrals[v].relative_drift();
    all[name] = {
        {"drift", json_number(drift(*most))}, {"relative_drift", json_number(relative)}, {"run", most - runs.begin()}};
    told.say(job, fmt::format("{}: its integral drifts by at most {:.2g}, {:.2g} of that of its magnitude (run {})\n",
                              name, drift(*most), relative, most - runs.begin()));
  }
  told.json["conservation"] = std::move(all);
}

void report_residuals(Job& job, const DataFile& file, Told& told) {
  Json all = Json::object();
  training::DataSetMaker& maker = file.maker;
  const std::vector<training::DataRun>& runs = file.runs;
  for (int s = 0; s < maker.session().rollout().state_count(); ++s) {
    const std::string& name = maker.session().rollout().state_name(s);
    if (is_memory(maker, name)) continue;
    const auto residual = [&](const training::DataRun& run) {
      return file.of(run).residuals[static_cast<std::size_t>(s)];
    };
    if (std::ranges::any_of(runs, [&](const training::DataRun& run) { return std::isnan(residual(run).rate); })) {
      all[name] = nullptr;
      told.say(job,
               fmt::format("{}: how well the frames satisfy the scene is not known: {}\n", name,
                           maker.times().size() < 2 ? "no frame follows another" : "it does not run on their grid"));
      continue;
    }
    const auto most =
        std::ranges::max_element(runs, {}, [&](const training::DataRun& run) { return residual(run).relative; });
    const auto [rate, relative] = residual(*most);
    all[name] = {{"rate", json_number(rate)}, {"relative", json_number(relative)}, {"run", most - runs.begin()}};
    told.say(job, fmt::format("{}: the scene's steps from a frame miss the next one by at most {:.2g} of the change "
                              "between them, {:.2g} in a unit of time (run {})\n",
                              name, shown(relative), shown(rate), most - runs.begin()));
  }
  told.json["residuals"] = std::move(all);
}

/// Of the whole file: what the runs are, and how many.
std::uint64_t key_of_all(const training::DataSetMaker& maker) {
  const std::string text = fmt::format("{:016x} {}", maker.key(), maker.set().runs);
  return hash_bytes(text.data(), text.size());
}

/// False where a file of the result could not be written: better told before the runs than behind them.
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

/// Of one file. What is of the runs themselves is said of the first.
Told report(Job& job, const DataFile& file, const std::vector<training::OrderEstimate>& estimates) {
  training::DataSetMaker& maker = file.maker;
  const model::DataSet& set = maker.set();
  const std::vector<int> cells = maker.cells(file.grid());
  Told told;
  told.say(job, fmt::format("{}: {} runs of scene {}, {} frames from t = {:.6g} to {:.6g} on {} cells\n", set.name,
                            set.runs, set.scene, maker.times().size(), maker.times().front(), maker.times().back(),
                            fmt::join(cells, " x ")));
  told.json = {{"runs", set.runs}, {"frames", maker.times().size()}, {"cells", cells}};
  if (file.number == 0) {
    report_estimates(job, maker, estimates, told);
    report_drifts(job, maker, file.runs, told);
  }
  report_residuals(job, file, told);
  return told;
}

/// What was told of every file, where all of them are there.
std::optional<std::vector<Told>> told_of_all(const Job& job, const training::DataSetMaker& maker) {
  std::vector<Told> all;
  for (const model::DataSet::Grid& grid : maker.set().grids) {
    std::optional<Told> told = told_of_finished(job, grid.file, key_of_all(maker));
    if (!told) return std::nullopt;
    all.push_back(std::move(*told));
  }
  return all;
}

/// Of the first file, the others by their names.
Json data_set_json(const model::DataSet& set, const std::vector<Told>& told) {
  Json json = told[0].json;
  for (std::size_t g = 1; g < told.size(); ++g) json["others"][set.grids[g].file] = told[g].json;
  return json;
}

/// Of a data set that was finished before.
Json again(Job& job, const model::DataSet& set, const std::vector<Told>& told) {
  for (std::size_t g = 0; g < told.size(); ++g)
    job.say(fmt::format("{}: all runs are made already, {} is there\n{}", set.name, set.grids[g].file, told[g].text));
  Json result = data_set_json(set, told);
  result["finished"] = true;
  result["resumed_runs"] = set.runs;
  result["files"] = job.files();
  return result;
}

/// The data set, and beside it what it cost: the seconds that are returned. Each file says what all of them cost
/// together: the runs are the same.
double write_files(Job& job, training::DataSetMaker& maker, const std::vector<training::DataRun>& runs,
                   const std::vector<training::OrderEstimate>& estimates, const std::vector<Told>& told) {
  double cpu_seconds = 0;
  for (const training::DataRun& run : runs) cpu_seconds += run.cpu_seconds;
  guarded(job, [&] {
    for (std::size_t g = 0; g < told.size(); ++g) {
      const DataFile file{maker, runs, g};
      NetcdfContent content = content_of(job, file, estimates);
      add_told(content, key_of_all(maker), told[g]);
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
  if (const std::optional<std::vector<Told>> told = resume ? told_of_all(job, *maker) : std::nullopt)
    return again(job, set, *told);
  const auto start = std::chrono::steady_clock::now();
  Progress progress(job.options().streams.err, false, quiet);
  int done = 0, there = 0;
  const auto is_done = [&](int run) {
    const bool is_there = resume && Part(job, *maker, run).load().has_value();
    there += is_there ? 1 : 0;
    return is_there;
  };
  const auto take = [&](int run, const training::DataRun& data) {
    Part(job, *maker, run).save(data, job.sink());
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
    std::optional<training::DataRun> data = Part(job, *maker, run).load();
    if (!data) {
      job.sink().report("run-failed", {}, {fmt::format("run {} of dataset {} is no longer there", run, set.name)});
      return result;
    }
    runs.push_back(std::move(*data));
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::vector<training::OrderEstimate> estimates = maker->estimate_order();
  std::vector<Told> told;
  for (std::size_t g = 0; g < set.grids.size(); ++g) told.push_back(report(job, {*maker, runs, g}, estimates));
  const double cpu_seconds = write_files(job, *maker, runs, estimates, told);
  if (!job.failed()) {
    for (int run = 0; run < set.runs; ++run) Part(job, *maker, run).remove();
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
