// SPDX-License-Identifier: Apache-2.0
// dpde fmt: formats a model file in place, or standard input to standard output.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "files/files.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

struct FmtOptions : CommonOptions {
  bool check = false;
};

constexpr const char* standard_input = "-";

int format_file(const FmtOptions& options) {
  Job job(options);
  const bool is_piped = options.file == standard_input;
  bool differs = false;
  Json result = Json::object();
  guarded(job, [&] {
    if (is_piped ? !job.load_standard_input() : !job.load_source(false)) return;
    const ast::File file = parse(job.source(), job.sink());
    if (job.failed()) return;
    const std::string text = print(file);
    differs = text != job.source().text();
    if (is_piped && options.json) result["text"] = text;
    if (is_piped && !options.json && !options.check) fmt::print(options.streams.out, "{}", text);
    if (!is_piped && differs && !options.check) files::write_file(options.file, text, job.sink());
  });
  result["changed"] = differs;
  const int status = job.finish(std::move(result));
  if (status != 0 || !options.check || !differs) return status;
  const std::string& name = is_piped ? job.source().path() : options.file;
  fmt::print(options.streams.err, "{} is not formatted; dpde fmt {} formats it\n", name, options.file);
  return static_cast<int>(Exit::failed);
}

}  // namespace

void add_fmt(CLI::App& app, Console& console) {
  const auto options = std::make_shared<FmtOptions>();
  CLI::App* verb = app.add_subcommand("fmt", "format a model file in place; - is standard input, to standard output");
  add_common_options(*verb, *options, console, {.name = false, .compile = false, .out = false, .seed = false});
  verb->add_flag("--check", options->check, "change nothing; exit status 1 when the file is not formatted");
  verb->footer("Examples:\n  dpde fmt burgers.dpde\n  dpde fmt - < burgers.dpde");
  on_call(*verb, console, [options] { return format_file(*options); });
}

}  // namespace dpde::tools
