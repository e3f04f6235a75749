// SPDX-License-Identifier: Apache-2.0
// The verbs and options as --help has them, for completions in shells and the manual page.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace dpde::tools {

struct OptionEntry {
  std::vector<std::string> names;  // --set; -q, --quiet; of a positional one FILE
  std::string value;               // what it takes, as NAME=VALUE; "": nothing
  std::vector<std::string> choices;
  std::string text;
  bool is_positional = false;
};
struct VerbEntry {
  std::string name, text, footer;
  std::vector<OptionEntry> options;
};
struct CommandTable {
  std::string text, footer;
  std::vector<VerbEntry> verbs;
};
CommandTable table_of(const CLI::App& app);

/// For bash, zsh or fish; "" for other shells.
std::string completion_script(const CommandTable& table, const std::string& shell);

/// The manual page in the language of man(7).
std::string manual_page(const CommandTable& table, const std::string& version);

}  // namespace dpde::tools
