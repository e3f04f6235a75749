// SPDX-License-Identifier: Apache-2.0
// dpde: the command. Each verb has a file of its own; this one parses the command line and hands over.
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <sstream>
#include <string>
#include <vector>

#include "command.h"
#include "dpde/instruction_set.h"
#include "interrupt.h"
#include "standard_output.h"
#include "verbs.h"
#include "version.h"

namespace {

/// Wrong options are wrong input: exit status 2.
int report_usage(const std::string& message, bool json) {
  std::fputs(fmt::format("dpde: error[E0904]: {}\n  help: dpde --help, dpde VERB --help\n", message).c_str(), stderr);
  if (json) {
    const dpde::Json diagnostic = {{"code", "E0904"}, {"severity", "error"}, {"message", message},        {"file", ""},
                                   {"line", 0},       {"column", 0},         {"hint", "dpde VERB --help"}};
    fmt::print("{}\n", dpde::Json({{"diagnostics", dpde::Json::array({diagnostic})}}).dump());
  }
  return static_cast<int>(dpde::tools::Exit::wrong_input);
}

/// A first word that is no verb; "" when it is one or there is none.
std::string unknown_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return "";
  std::vector<std::string> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
  if (std::find(verbs.begin(), verbs.end(), argv[1]) != verbs.end()) return "";
  const std::string nearest = dpde::nearest_name(argv[1], verbs);
  return fmt::format("there is no verb {}{}", argv[1], nearest.empty() ? "" : "; did you mean " + nearest + "?");
}

/// "" where $DPDE_ISA is not set or names instructions; those that the processor lacks are left to it.
std::string unknown_instruction_set() {
  using dpde::InstructionSet;
  const char* const value = std::getenv("DPDE_ISA");
  const std::string asked = value == nullptr ? "" : value;
  for (const InstructionSet set : {InstructionSet::portable, InstructionSet::v3, InstructionSet::v4}) {
    if (asked.empty() || asked == dpde::word_of(set)) return "";
  }
  return fmt::format("DPDE_ISA is {}: set it to portable, avx2 or avx512, or unset it", asked);
}

bool wants_json(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--json") return true;
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace dpde::tools;
  drop_what_nobody_reads();
  mallopt(M_MMAP_THRESHOLD, 1 << 17);  // arrays that are given back go to the system, also after larger ones
  CLI::App app("dpde: from equations to fast simulations and certified gradients", "dpde");
  app.set_version_flag("--version", version_text);
  app.require_subcommand(1);
  app.footer(
      "First steps:  dpde check FILE.dpde    dpde run FILE.dpde    dpde verify FILE.dpde\n"
      "Exit status:  0 done, 1 the run failed, 2 the input is wrong, 3 the machine failed; by a signal: Ctrl-C and "
      "others");
  int status = 0;
  add_run(app, status);
  add_check(app, status);
  add_stability(app, status);
  add_chart(app, status);
  add_tune(app, status);
  add_emit(app, status);
  add_verify(app, status);
  add_gradient(app, status);
  add_optimize(app, status);
  add_test(app, status);
  add_build(app, status);
  add_bench(app, status);
  add_plot(app, status);
  add_fmt(app, status);
  add_new(app, status);
  add_explain(app, status);
  add_lsp(app, status);
  add_completion(app, status);
  add_man(app, status);
  std::string unknown = unknown_verb(app, argc, argv);
  if (unknown.empty()) unknown = unknown_instruction_set();
  if (!unknown.empty()) return flushed(report_usage(unknown, wants_json(argc, argv)));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) return flushed(report_usage(error.what(), wants_json(argc, argv)));
    std::ostringstream asked;  // --help, --version
    app.exit(error, asked, asked);
    std::fputs(asked.str().c_str(), stdout);
    return flushed(status);
  } catch (const std::exception& error) {
    std::fputs(fmt::format("dpde: error[E0903]: {}\n", error.what()).c_str(), stderr);
    return static_cast<int>(Exit::machine_failed);
  }
  return status_or_signal(status);
}
