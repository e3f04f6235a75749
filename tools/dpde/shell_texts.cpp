// SPDX-License-Identifier: Apache-2.0
// dpde completion, dpde man: texts for shells and man, made from the tables of --help.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "command.h"
#include "command_table.h"
#include "verbs.h"

namespace dpde::tools {

void add_completion(CLI::App& app, Console& console) {
  const auto shell = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand("completion", "print what a shell needs to complete verbs, options and names");
  verb->add_option("shell", *shell, "the shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->footer(
      "Examples:\n  source <(dpde completion bash)\n  dpde completion fish > ~/.config/fish/completions/dpde.fish");
  on_call(*verb, console, [&app, &console, shell] {
    fmt::print(console.streams.out, "{}", completion_script(table_of(app), *shell));
    return flushed(static_cast<int>(Exit::done), console.streams);
  });
}

void add_man(CLI::App& app, Console& console) {
  CLI::App* verb = app.add_subcommand("man", "print the manual page");
  verb->footer("Example:  dpde man | man -l -");
  on_call(*verb, console, [&app, &console] {
    fmt::print(console.streams.out, "{}", manual_page(table_of(app), version));
    return flushed(static_cast<int>(Exit::done), console.streams);
  });
}

}  // namespace dpde::tools
