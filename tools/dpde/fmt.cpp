// SPDX-License-Identifier: Apache-2.0
// dpde fmt: formats a model file in place.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "command.h"
#include "files/files.h"
#include "syntax/parser.h"
#include "syntax/print_ast.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct FmtOptions : CommonOptions {
  bool check = false;
};

int format_file(const FmtOptions& options) {
  Job job(options);
  bool differs = false;
  guarded(job, [&] {
    if (!job.load_source(false)) return;
    const ast::File file = parse(job.source(), job.sink());
    if (job.failed()) return;
    const std::string text = print(file);
    differs = text != job.source().text();
    if (differs && !options.check) files::write_file(options.file, text, job.sink());
  });
  const int status = job.finish({{"changed", differs}});
  if (status != 0 || !options.check || !differs) return status;
  std::fputs(fmt::format("{} is not formatted; dpde fmt {} formats it\n", options.file, options.file).c_str(), stderr);
  return static_cast<int>(Exit::failed);
}

}  // namespace

void add_fmt(CLI::App& app, int& status) {
  const auto options = std::make_shared<FmtOptions>();
  CLI::App* verb = app.add_subcommand("fmt", "format a model file in place");
  add_common_options(*verb, *options, {.name = false, .compile = false, .out = false, .seed = false});
  verb->add_flag("--check", options->check, "change nothing; exit status 1 when the file is not formatted");
  verb->footer("Example:  dpde fmt burgers.dpde");
  on_call(*verb, status, [options] { return format_file(*options); });
}

}  // namespace dpde::tools
