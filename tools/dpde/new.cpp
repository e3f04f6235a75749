// SPDX-License-Identifier: Apache-2.0
// dpde new: writes a first model file, to be edited.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>

#include "command.h"
#include "files/files.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

/// Is formatted, runs and passes the certificate unchanged.
constexpr const char* first_scene = R"(# Heat in a rod, and a task: which conductivity has made what was seen?
model heat {
  field u
  param k = 0.1
  dt(u) = k*lap(u)
}

scheme plain { time = rk4 }

scene rod : heat with plain {
  grid x = 0 .. 1, cells 64
  boundary u: x.low = 1, x.high = zero_gradient
  initial u = exp(-50*x^2)
  time 0 .. 0.5, step 1/4096
  observe heat = integral(u)
}
scene truth = rod { k = 0.15 }

task find_k : rod {
  data seen = u from scene truth at t = 0.5
  unknown k from 0.1
  minimise mean((u - seen)^2) at t = 0.5
  using lbfgs(), iterations 20
}
)";

std::string for_a_shell(const std::string& path) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '/' || c == '.' || c == '_' || c == '-';
  };
  if (std::ranges::all_of(path, is_plain)) return path;
  std::string quoted = "'";
  for (const char c : path) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

int write_first_scene(const CommonOptions& options) {
  Job job(options);
  guarded(job, [&] {
    if (std::filesystem::exists(options.file)) {
      job.sink().report("bad-option", {}, {options.file + " is there already"}, "give another name");
      return;
    }
    if (!files::write_file(options.file, first_scene, job.sink())) return;
    job.wrote(options.file);
    job.say(fmt::format("next:  dpde run {0} rod    dpde verify {0} find_k    dpde optimize {0} find_k\n",
                        for_a_shell(options.file)));
  });
  return job.finish({{"files", job.files()}});
}

}  // namespace

void add_new(CLI::App& app, Console& console) {
  const auto options = std::make_shared<CommonOptions>();
  CLI::App* verb = app.add_subcommand("new", "write a first model file, to be changed into one's own");
  add_common_options(*verb, *options, console, {.name = false, .compile = false, .out = false, .seed = false});
  verb->footer("Example:  dpde new rod.dpde");
  on_call(*verb, console, [options] { return write_first_scene(*options); });
}

}  // namespace dpde::tools
