// SPDX-License-Identifier: Apache-2.0
// What every verb shares: the options common to all, exit codes, and the one way results and messages leave it.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"
#include "source/diagnostic.h"
#include "support/json.h"
#include "support/version.h"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace dpde::tools {

enum class Exit : int { done = 0, failed = 1, wrong_input = 2, machine_failed = 3 };

/// Where text goes: results to `out`, messages and progress to `err`.
struct Streams {
  std::FILE* out = stdout;
  std::FILE* err = stderr;
};
bool is_terminal(std::FILE* stream);

/// One call of the command.
struct Console {
  Streams streams;
  int status = 0;  // how it ended
};

struct CommonOptions {
  std::string file, name, scheme, backend = "jit", out;
  std::string cache;  // folder; "": the default one
  bool no_cache = false;
  std::vector<std::string> set;
  int threads = 0;  // 0: all cores
  std::uint64_t seed = 0;
  bool quiet = false, json = false;
  bool force = false;  // a step that is above the largest stable one is made all the same
  Streams streams;
};

/// One call of a verb: collects messages and files, and says in the end how it went.
class Job {
 public:
  explicit Job(const CommonOptions& options) : options_(options), source_(options.file, "") {}

  const CommonOptions& options() const { return options_; }
  const SourceFile& source() const { return source_; }
  DiagnosticSink& sink() { return sink_; }
  bool failed() const { return sink_.has_errors(); }
  /// The task or scene that the command names, else the one that is run; "" before that is known.
  std::string name() const;
  /// Where the task or scene of name() is declared.
  SourceRange place() const;
  /// Where the solve was written that `error` comes from, else that place.
  SourceRange place(const std::exception& error) const;
  /// What is run from now on.
  void runs(std::shared_ptr<const driver::Compiled> compiled) { compiled_ = std::move(compiled); }

  /// Reads options().file; false and a diagnostic when that fails.
  bool load_source(bool imports = true);
  /// The same of standard input, which options().file, "-", stands for.
  bool load_standard_input();
  /// Selection, backend and verification level of the options; nullopt and diagnostics when one is nonsense.
  std::optional<driver::CompileOptions> compile_options();

  /// What `one` gives for the task or scene that the command means. Where it names none and the file has several tasks,
  /// of each of them: {"tasks": {NAME: ...}}, up to the first that fails.
  Json of_each_task(const std::function<Json()>& one);

  /// Text for people: standard output, or nothing with --quiet or --json.
  void say(const std::string& text);
  /// What stands in no result, always told: standard error.
  void tell(const std::string& text) const;
  /// A file that was written: told to people and listed under `files`.
  void wrote(const std::string& path);
  const std::vector<std::string>& files() const { return files_; }
  /// A folder that was not there: it does not stay where the command fails and nothing is in it.
  void makes(const std::string& folder) { made_folder_ = folder; }

  /// Prints the diagnostics (standard error) and, with --json, `result` with the diagnostics; the exit status.
  int finish(Json result);

 private:
  std::shared_ptr<codegen::CodeCache> open_cache();

  CommonOptions options_;
  SourceFile source_;
  std::shared_ptr<const driver::Compiled> compiled_;
  DiagnosticSink sink_;
  std::vector<std::string> files_;
  std::string made_folder_;
};

/// Which of `common`'s options a verb takes beside FILE.
struct Takes {
  bool name = true, compile = true, out = true, seed = true, json = true, force = false;
};
void add_common_options(CLI::App& verb, CommonOptions& options, const Console& console, const Takes& takes = {});

/// Adds a verb whose `body` does the work and gives the exit status.
void on_call(CLI::App& verb, Console& console, std::function<int()> body);

/// A whole call: the result of `body` with the diagnostics, what it throws among them; the exit status.
int call(const CommonOptions& options, const std::function<Json(Job&)>& body);

/// `status`, or after an error of its own that of a failed machine where `streams.out` could not be written.
int flushed(int status, const Streams& streams);

/// --threads, or all cores.
int thread_count(const CommonOptions& options);

/// Of options that are numbers above 0, or not below it.
CLI::Validator positive();
CLI::Validator not_negative();

/// Turns what the library threw into a diagnostic of `job`; false when the body threw.
bool guarded(Job& job, const std::function<void()>& body);

}  // namespace dpde::tools
