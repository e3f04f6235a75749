// SPDX-License-Identifier: Apache-2.0
// Shared by all verbs: common options, exit codes, and the output of results and messages.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
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

/// Output streams: results to `out`, messages and progress to `err`.
struct Streams {
  std::FILE* out = stdout;
  std::FILE* err = stderr;
};
bool is_terminal(std::FILE* stream);

/// One call of the command.
struct Console {
  Streams streams;
  int status = 0;  // exit status
};

struct CommonOptions {
  std::string file, name, scheme, backend = "jit", out;
  std::string cache;  // folder; "": the default one
  bool no_cache = false;
  std::vector<std::string> set;
  int threads = 0;  // 0: all cores
  std::uint64_t seed = 0;
  bool quiet = false, json = false;
  bool force = false;  // run even with a step above the largest stable one
  Streams streams;
};

/// One call of a verb: collects messages and files, and determines the exit status.
class Job {
 public:
  explicit Job(const CommonOptions& options) : options_(options), source_(options.file, "") {}

  const CommonOptions& options() const { return options_; }
  const SourceFile& source() const { return source_; }
  DiagnosticSink& sink() { return sink_; }
  bool failed() const { return sink_.has_errors(); }
  /// The task or scene named in the command, else the one that is run; "" before it is known.
  std::string name() const;
  /// Location of its declaration.
  SourceRange place() const;
  /// Location of the solve that `error` comes from, else that one.
  SourceRange place(const std::exception& error) const;
  /// Sets the program that is run from now on.
  void runs(std::shared_ptr<const driver::Compiled> compiled) { compiled_ = std::move(compiled); }

  /// Reads options().file; returns false with a diagnostic on failure.
  bool load_source(bool imports = true);
  /// The same from standard input, if options().file is "-".
  bool load_standard_input();
  /// Selection, backend and verification level from the options; nullopt with diagnostics if one is invalid.
  std::optional<driver::CompileOptions> compile_options();

  /// The result of `one` for the task or scene of the command. If it names none and the file has several tasks, for
  /// each of them: {"tasks": {NAME: ...}}, up to the first that fails.
  Json of_each_task(const std::function<Json()>& one);

  /// Prints text for people to standard output; nothing with --quiet or --json.
  void say(const std::string& text);
  /// Prints information that is in no result to standard error, always.
  void tell(const std::string& text) const;
  /// Reports a file that was written, and lists it under `files`.
  void wrote(const std::string& path);
  const std::vector<std::string>& files() const { return files_; }
  /// A folder that was just made: removed again if the command fails and it is empty.
  void makes(const std::string& folder) { made_folder_ = folder; }

  /// finish() prints one warning of each kind, with the number of others; `option` is what shows them.
  void tell_kinds_once(std::string option) { option_for_all_ = std::move(option); }
  /// Prints the diagnostics (standard error) and, with --json, `result` with them; returns the exit status.
  int finish(Json result);

 private:
  std::shared_ptr<codegen::CodeCache> open_cache();

  CommonOptions options_;
  SourceFile source_;
  std::shared_ptr<const driver::Compiled> compiled_;
  DiagnosticSink sink_;
  std::vector<std::string> files_;
  std::string made_folder_;
  std::string option_for_all_;  // see tell_kinds_once()
};

/// The options of `common` that a verb takes in addition to FILE.
struct Takes {
  bool name = true, compile = true, out = true, seed = true, json = true, force = false;
};
void add_common_options(CLI::App& verb, CommonOptions& options, const Console& console, const Takes& takes = {});

/// Adds a verb; `body` does the work and returns the exit status.
void on_call(CLI::App& verb, Console& console, std::function<int()> body);

/// A whole call: prints the result of `body` and diagnostics, also for exceptions; returns the exit status.
int call(const CommonOptions& options, const std::function<Json(Job&)>& body);

/// Flushes; returns `status`, or reports a machine failure if `streams.out` cannot be written.
int flushed(int status, const Streams& streams);

/// --threads, or all cores.
int thread_count(const CommonOptions& options);

/// Validators of numbers > 0, and >= 0.
CLI::Validator positive();
CLI::Validator not_negative();

/// Converts an exception of the library to a diagnostic of `job`; returns false if `body` threw.
bool guarded(Job& job, const std::function<void()>& body);

}  // namespace dpde::tools
