// SPDX-License-Identifier: Apache-2.0
// Each verb has its own file; this one parses the command line and calls it.
#include "run_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "command.h"
#include "dpde/instruction_set.h"
#include "verbs.h"
#include "version.h"

namespace dpde::tools {

namespace {

/// Invalid options count as wrong input: exit status 2.
int report_usage(const std::string& message, bool json, const Streams& streams) {
  fmt::print(streams.err, "dpde: error[E0904]: {}\n  help: dpde --help, dpde VERB --help\n", message);
  if (json) {
    const Json diagnostic = {{"code", "E0904"}, {"severity", "error"}, {"message", message},        {"file", ""},
                             {"line", 0},       {"column", 0},         {"hint", "dpde VERB --help"}};
    fmt::print(streams.out, "{}\n", Json({{"diagnostics", Json::array({diagnostic})}}).dump());
  }
  return flushed(static_cast<int>(Exit::wrong_input), streams);
}

/// The first argument if it is not a verb; "" if it is one or there is none.
std::string unknown_verb(const CLI::App& app, const std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments[0].starts_with('-')) return "";
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
  if (std::ranges::find(verbs, arguments[0]) != verbs.end()) return "";
  const std::string nearest = nearest_name(arguments[0], verbs);
  return fmt::format("there is no verb {}{}", arguments[0], nearest.empty() ? "" : "; did you mean " + nearest + "?");
}

/// "" if $DPDE_ISA is unset or valid; whether the processor has the instructions is checked elsewhere.
std::string unknown_instruction_set() {
  const char* const value = std::getenv("DPDE_ISA");
  const std::string asked = value == nullptr ? "" : value;
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::v3, InstructionSet::v4}) {
    if (asked.empty() || asked == word_of(set)) return "";
  }
  return fmt::format("DPDE_ISA is {}: set it to portable, avx2 or avx512, or unset it", asked);
}

void add_verbs(CLI::App& app, Console& console) {
  add_run(app, console);
  add_check(app, console);
  add_stability(app, console);
  add_chart(app, console);
  add_tune(app, console);
  add_emit(app, console);
  add_verify(app, console);
  add_gradient(app, console);
  add_optimize(app, console);
  add_test(app, console);
  add_build(app, console);
  add_bench(app, console);
  add_plot(app, console);
  add_fmt(app, console);
  add_new(app, console);
  add_explain(app, console);
  add_help(app, console);
  add_lsp(app, console);
  add_completion(app, console);
  add_man(app, console);
}

}  // namespace

int run_command(const std::vector<std::string>& arguments, const Streams& streams) {
  CLI::App app("dpde: from equations to fast simulations and certified gradients", "dpde");
  app.set_version_flag("--version", version_text);
  app.require_subcommand(1);
  app.footer(
      "First steps:  dpde check FILE.dpde    dpde run FILE.dpde    dpde verify FILE.dpde    dpde help WORD\n"
      "Exit status:  0 done, 1 the run failed, 2 the input is wrong, 3 the machine failed; by a signal: Ctrl-C and "
      "others");
  Console console{streams};
  add_verbs(app, console);
  const bool json = std::ranges::find(arguments, "--json") != arguments.end();
  std::string unknown = unknown_verb(app, arguments);
  if (unknown.empty()) unknown = unknown_instruction_set();
  if (!unknown.empty()) return report_usage(unknown, json, streams);
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 expects reverse order
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return report_usage(error.what(), json, streams);
    std::ostringstream asked;  // --help, --version
    app.exit(error, asked, asked);
    std::fputs(asked.str().c_str(), streams.out);
    return flushed(console.status, streams);
  } catch (const std::exception& error) {
    fmt::print(streams.err, "dpde: error[E0903]: {}\n", error.what());
    return static_cast<int>(Exit::machine_failed);
  }
  return console.status;
}

}  // namespace dpde::tools
