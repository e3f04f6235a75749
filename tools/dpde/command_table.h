// SPDX-License-Identifier: Apache-2.0
// The verbs and options shown by --help, for shell completion and the manual page.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace dpde::tools {

struct OptionEntry {
  std::vector<std::string> names;  // --set; -q, --quiet; for a positional one FILE
  std::string value;               // its argument, such as NAME=VALUE; "": none
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

/// Script for bash, zsh or fish; "" for other shells.
std::string completion_script(const CommandTable& table, const std::string& shell);

/// The manual page in the markup of man(7).
std::string manual_page(const CommandTable& table, const std::string& version);

}  // namespace dpde::tools
