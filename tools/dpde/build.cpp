// SPDX-License-Identifier: Apache-2.0
// dpde build: compiles a scene ahead of time to a library and a class for C++ hosts.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "driver/compile/library.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct BuildOptions : CommonOptions {
  std::string folder, class_name, march = "native";
  bool second_order = false;
};

Json build(Job& job, const BuildOptions& options) {
  Json result = Json::object();
  if (!job.load_source()) return result;
  const std::optional<driver::CompileOptions> common = job.compile_options();
  if (!common) return result;
  const std::optional<driver::LibraryFiles> files = driver::build_library(
      job.source(), {common->selection, options.folder, options.class_name, options.march, options.second_order},
      job.sink());
  if (!files) return result;
  for (const std::string& path : files->paths) job.wrote(path);
  job.say(
      fmt::format("with CMake: include({0}/{1}.cmake) and link {1}; or write dpde_add_library({1} {2} ...) and leave "
                  "this to the build\n",
                  options.folder, files->name, options.file));
  result["name"] = files->name;
  result["files"] = job.files();
  return result;
}

}  // namespace

void add_build(CLI::App& app, Console& console) {
  const auto options = std::make_shared<BuildOptions>();
  CLI::App* verb = app.add_subcommand("build", "a library ahead of time: C++ source, class, shared library, CMake");
  add_common_options(*verb, *options, console, {.compile = false, .out = false, .seed = false});
  verb->add_option("-o,--output,--out", options->folder, "folder for the files")->required()->type_name("DIR");
  verb->add_option("--name", options->class_name, "of the class and the files, in place of the task's or scene's")
      ->type_name("NAME");
  verb->add_option("--set", options->set, "as for run")->type_name("NAME=VALUE")->allow_extra_args(false);
  verb->add_option("--scheme", options->scheme, "use this scheme block of the file")->type_name("NAME");
  verb->add_option("--march", options->march, "processor to compile for, as the C++ compiler calls it")
      ->type_name("CPU")
      ->capture_default_str();
  verb->add_flag("--second-order", options->second_order,
                 "of a task also products with the Hessian (hessian_vector); newton_cg has them anyway");
  verb->footer(
      "Examples:\n  dpde build heat.dpde rod -o generated\n  dpde build burgers.dpde recover -o generated --march "
      "x86-64-v3\n"
      "The C++ compiler is $CXX, or else c++.");
  on_call(*verb, console, [options] { return call(*options, [&](Job& job) { return build(job, *options); }); });
}

}  // namespace dpde::tools
