// SPDX-License-Identifier: Apache-2.0
#include "command_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>

namespace dpde::tools {

namespace {

/// The choices in a text such as "TEXT:{jit,cpp,interpreter}".
std::vector<std::string> choices_in(const std::string& type) {
  std::vector<std::string> choices;
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return choices;
  for (std::size_t at = open + 1; at < close;) {
    const std::size_t end = std::min(type.find(',', at), close);
    choices.push_back(type.substr(at, end - at));
    at = end + 1;
  }
  return choices;
}

OptionEntry entry_of(const CLI::Option& option) {
  OptionEntry entry;
  entry.text = option.get_description();
  entry.is_positional = option.get_positional();
  const std::string type = option.get_type_name();
  entry.choices = choices_in(type);
  if (entry.is_positional) {
    entry.names = {type.empty() ? option.get_name(true) : type.substr(0, type.find_first_of(":{"))};
    return entry;
  }
  for (const std::string& name : option.get_snames()) entry.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) entry.names.push_back("--" + name);
  if (option.get_items_expected_max() == 0) return entry;
  entry.value = type.empty() ? "VALUE" : type;
  if (!entry.choices.empty()) entry.value = fmt::format("{}", fmt::join(entry.choices, "|"));
  return entry;
}

}  // namespace

CommandTable table_of(const CLI::App& app) {
  CommandTable table{app.get_description(), app.get_footer(), {}};
  for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) {
    VerbEntry entry{verb->get_name(), verb->get_description(), verb->get_footer(), {}};
    for (const CLI::Option* option : verb->get_options()) entry.options.push_back(entry_of(*option));
    table.verbs.push_back(std::move(entry));
  }
  return table;
}

}  // namespace dpde::tools
