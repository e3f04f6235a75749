// SPDX-License-Identifier: Apache-2.0
#include "command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <limits>
#include <thread>
#include <utility>

#include "dpde/runtime/error.h"
#include "dpde/runtime/unsolved.h"
#include "driver/compile/declared.h"
#include "driver/memory/cache_folder.h"
#include "driver/report/solve_report.h"
#include "driver/scene/session.h"
#include "files/files.h"
#include "files/imports.h"
#include "interrupt.h"
#include "model/from_ast.h"
#include "source/render.h"
#include "syntax/parser.h"

namespace dpde::tools {

namespace {

/// By the words of --backend.
std::vector<std::pair<std::string, driver::Backend>> backends() {
  return {{"jit", driver::Backend::jit}, {"cpp", driver::Backend::cpp}, {"interpreter", driver::Backend::interpreter}};
}

Exit exit_for(const std::vector<Diagnostic>& diagnostics) {
  Exit worst = Exit::done;
  for (const Diagnostic& d : diagnostics) {
    if (d.kind->severity != Severity::error) continue;
    const std::string_view code = d.kind->code;
    Exit exit = Exit::wrong_input;
    // E0808 and E0809 are found before any run.
    if (code.starts_with("E08") && code != "E0808" && code != "E0809") exit = Exit::failed;
    if (code == "E0902" || code == "E0903" || code == "E0910") exit = Exit::machine_failed;
    // A machine failure outranks wrong input, which outranks a failed run.
    worst = std::max(worst, exit);
  }
  return worst;
}

/// Sorts errors with a location by it; the others keep their positions.
std::vector<Diagnostic> in_order_of_text(std::vector<Diagnostic> diagnostics) {
  const auto is_placed = [](const Diagnostic& d) { return d.kind->severity == Severity::error && d.range.is_known(); };
  std::vector<Diagnostic> placed;
  std::ranges::copy_if(diagnostics, std::back_inserter(placed), is_placed);
  std::ranges::stable_sort(placed, {}, [](const Diagnostic& d) { return d.range.begin; });
  auto next = placed.begin();
  for (Diagnostic& diagnostic : diagnostics) {
    if (is_placed(diagnostic)) diagnostic = *next++;
  }
  return diagnostics;
}

std::vector<std::string> split_set(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) return {};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace

bool Job::load_source(bool imports) {
  const std::optional<std::string> text = files::read_file(options_.file, {}, sink_);
  if (text) source_ = SourceFile(options_.file, *text);
  if (imports) source_ = files::with_imports(source_, sink_);
  return !sink_.has_errors();
}

bool Job::load_standard_input() {
  std::string text(std::istreambuf_iterator<char>(std::cin), {});
  if (std::cin.bad()) sink_.report("cannot-read", {}, {"standard input", "it cannot be read"});
  source_ = SourceFile("standard input", std::move(text));
  return !failed();
}

std::optional<driver::CompileOptions> Job::compile_options() {
  driver::CompileOptions result;
  result.selection.name = options_.name;
  for (const std::string& setting : options_.set) {
    const std::vector<std::string> parts = split_set(setting);
    if (parts.empty()) {
      sink_.report("bad-option", {}, {fmt::format("--set {} is not NAME=VALUE", setting)});
      return std::nullopt;
    }
    result.selection.overrides[parts[0]] = parts[1];
  }
  result.selection.scheme = options_.scheme;
  result.takes_jumps = result.trusts_signs = options_.force;
  for (const auto& [name, backend] : backends()) {
    if (name == options_.backend) result.backend = backend;
  }
  interrupt_flag();  // before compilers make temporary folders: from here on Ctrl-C ends the process cleanly
  result.cache = open_cache();
  return failed() ? std::nullopt : std::optional(result);
}

/// A missing cache is no error, unless its folder was requested.
std::shared_ptr<codegen::CodeCache> Job::open_cache() {
  if (options_.no_cache) return nullptr;
  const std::filesystem::path folder =
      options_.cache.empty() ? driver::default_cache_folder() : std::filesystem::path(options_.cache);
  if (folder.empty()) return nullptr;
  std::shared_ptr<codegen::CodeCache> cache = driver::open_cache(folder);  // makes it, accessible to this user only
  if (!options_.cache.empty() && !files::make_folder(folder, sink_)) return nullptr;  // reports why it cannot be made
  const std::string why = cache == nullptr ? driver::why_not_private(folder) : "";
  const auto is_told = [](const Diagnostic& told) { return told.kind->name == "cache-not-private"; };
  if (!why.empty() && std::ranges::none_of(sink_.all(), is_told))
    sink_.report("cache-not-private", {}, {folder.string(), why},
                 "chmod go-w takes their right to write; --cache DIR or DPDE_CACHE name another folder");
  return cache;
}

std::string Job::name() const {
  if (!options_.name.empty() || !compiled_ || !compiled_->problem) return options_.name;
  const model::Problem& problem = *compiled_->problem;
  return problem.task ? problem.task->name : problem.scene;
}

SourceRange Job::place() const {
  const std::string named = name();
  return driver::place_of(source_, named, named);
}

/// For a solve the location of its equation; for substeps that are not short enough the line that requests them.
SourceRange Job::place(const std::exception& error) const {
  const auto* known = dynamic_cast<const Error*>(&error);
  if (known == nullptr || !compiled_) return place();
  const auto* unsolved = dynamic_cast<const Unsolved*>(known);
  const bool is_of_parts = unsolved != nullptr && unsolved->facts().what == UnsolvedFacts::What::substeps;
  const SourceRange found = is_of_parts && compiled_->problem ? compiled_->problem->time_origin.range
                                                              : driver::place_of_solve(*compiled_, known->solve_for());
  return found.is_known() ? found : place();
}

Json Job::of_each_task(const std::function<Json()>& one) {
  DiagnosticSink silent;
  ast::File own = ast::parse(source_, silent);
  std::erase_if(own.declarations, [](const ast::Declaration& declaration) { return declaration.imported; });
  const std::vector<std::string> tasks = model::task_names(own);
  if (!options_.name.empty() || tasks.size() < 2) return one();
  Json all = {{"tasks", Json::object()}};
  for (const std::string& task : tasks) {
    if (failed()) break;
    options_.name = task;
    say(fmt::format("---- task {}\n", task));
    all["tasks"][task] = one();
  }
  options_.name.clear();
  return all;
}

void Job::say(const std::string& text) {
  if (!options_.quiet && !options_.json) fmt::print(options_.streams.out, "{}", text);
}

void Job::tell(const std::string& text) const {
  std::fputs(fmt::format("dpde: {}\n", text).c_str(),
             options_.streams.err);  // whole lines, since other processes write too
}

void Job::wrote(const std::string& path) {
  files_.push_back(path);
  say(fmt::format("wrote {}\n", path));
}

int Job::finish(Json result) {
  const Streams& streams = options_.streams;
  std::error_code error;
  if (failed() && !made_folder_.empty()) std::filesystem::remove(made_folder_, error);  // fails if it is not empty
  Exit exit = exit_for(sink_.all());
  const std::vector<Diagnostic> told = in_order_of_text(sink_.all());
  const bool has_colour = is_terminal(streams.err);
  if (option_for_all_.empty()) {
    for (const Diagnostic& diagnostic : told)
      std::fputs(render_text(source_, diagnostic, has_colour).c_str(), streams.err);
  } else {
    std::fputs(render_kinds_once(source_, told, option_for_all_, has_colour).c_str(), streams.err);
  }
  if (options_.json) {
    if (!told.empty()) result["diagnostics"] = diagnostics_json(source_, told);
    fmt::print(streams.out, "{}\n", result.dump());
  }
  return flushed(static_cast<int>(exit), streams);
}

bool is_terminal(std::FILE* stream) {
  const int number = fileno(stream);  // -1 for memory streams
  return number >= 0 && isatty(number) != 0;
}

int flushed(int status, const Streams& streams) {
  errno = 0;
  if (std::fflush(streams.out) == 0 && std::ferror(streams.out) == 0) return status;
  const std::string reason = errno == 0 ? "" : fmt::format(": {}", std::strerror(errno));
  fmt::print(streams.err, "dpde: error[E0902]: cannot write standard output{}\n", reason);
  return static_cast<int>(Exit::machine_failed);
}

/// CLI11 accepts larger numbers as the largest one, and reports limits of floating-point numbers.
std::string number_fits(const std::string& text) {
  std::uint64_t number = 0;
  const char* end = text.data() + text.size();
  const std::from_chars_result read = std::from_chars(text.data(), end, number);
  if (read.ec == std::errc() && read.ptr == end) return "";
  return fmt::format("{} is no whole number from 0 to {}", text, std::numeric_limits<std::uint64_t>::max());
}

void add_common_options(CLI::App& verb, CommonOptions& options, const Console& console, const Takes& takes) {
  options.streams = console.streams;
  verb.add_option("file", options.file, "the .dpde file")->required()->type_name("FILE");
  if (takes.name)
    verb.add_option("name", options.name, "scene, task or program; not needed where the file has one")
        ->type_name("NAME");
  if (takes.compile) {
    verb.add_option("--set", options.set, "override a parameter, cells, cells.x, step, end, or a key of the scheme")
        ->type_name("NAME=VALUE")
        ->allow_extra_args(false);
    verb.add_option("--scheme", options.scheme, "use this scheme block of the file")->type_name("NAME");
    verb.add_option("--backend", options.backend, "what makes the machine code")
        ->check(CLI::IsMember(backends()))
        ->capture_default_str();
    verb.add_option("--cache", options.cache, "folder of compiled code ($DPDE_CACHE, else ~/.cache/dpde)")
        ->type_name("DIR");
    verb.add_flag("--no-cache", options.no_cache, "compile everything anew");
    verb.add_option("--threads", options.threads, "number of threads (0: all cores)")->check(CLI::Range(0, 4096));
  }
  if (takes.force)
    verb.add_flag("--force", options.force,
                  "go on with a step above the largest stable one, or without what switches add to a gradient");
  if (takes.out) verb.add_option("-o,--out,--output", options.out, "folder for the files")->type_name("DIR");
  if (takes.seed) verb.add_option("--seed", options.seed, "seed of random numbers")->check(number_fits, "", "");
  verb.add_flag("--quiet,-q", options.quiet, "no text but errors");
  if (takes.json) verb.add_flag("--json", options.json, "one JSON object on standard output and nothing else");
}

void on_call(CLI::App& verb, Console& console, std::function<int()> body) {
  verb.callback([&console, body = std::move(body)] { console.status = body(); });
}

int thread_count(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

namespace {

/// CLI11's own validators print the whole range of doubles, digit by digit.
CLI::Validator number_that(const char* what, bool (*is_meant)(double)) {
  return CLI::Validator(
      [=](const std::string& text) -> std::string {
        double value = 0;
        const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool is_number = error == std::errc() && stop == text.data() + text.size();
        return is_number && is_meant(value) ? "" : fmt::format("{} is no number {}", text, what);
      },
      fmt::format("NUMBER {}", what));
}

}  // namespace

CLI::Validator positive() {
  return number_that("above 0", [](double value) { return value > 0; });
}
CLI::Validator not_negative() {
  return number_that("of 0 or more", [](double value) { return value >= 0; });
}

bool guarded(Job& job, const std::function<void()>& body) {
  try {
    body();
    return true;
  } catch (const std::exception& error) {
    driver::report_error(error, job.sink(), job.place(error));
    return false;
  }
}

int call(const CommonOptions& options, const std::function<Json(Job&)>& body) {
  Job job(options);
  Json result = Json::object();
  guarded(job, [&] { result = body(job); });
  return job.finish(std::move(result));
}

}  // namespace dpde::tools
