// SPDX-License-Identifier: Apache-2.0
// Shell completion: verbs, options, their choices, files, and the names of scenes and tasks in the file.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_table.h"

namespace dpde::tools {

namespace {

/// Prints the names of a file's blocks that a command accepts.
constexpr const char* names_of_blocks =
    R"(sed -n -E 's/^[[:space:]]*(scene|task|chart|dataset|program)[[:space:]]+([A-Za-z_][A-Za-z_0-9]*).*/\2/p')";

std::string words_of(const CommandTable& table) {
  std::vector<std::string> verbs;
  for (const VerbEntry& verb : table.verbs) verbs.push_back(verb.name);
  return fmt::format("{}", fmt::join(verbs, " "));
}

/// Escapes text for single quotes, in sh, zsh and fish; zsh specifications also need escaped brackets and colons.
std::string quoted_text(const std::string& text, bool is_zsh) {
  std::string result;
  for (const char c : text) {
    if (c == '\'') {
      result += is_zsh ? "'\\''" : "\\'";
    } else if (c == '\\' && !is_zsh) {
      result += "\\\\";
    } else if (is_zsh && (c == '[' || c == ']' || c == ':' || c == '\\')) {
      result += std::string("\\") + c;
    } else {
      result += c == '\n' ? ' ' : c;
    }
  }
  return result;
}

std::string bash_script(const CommandTable& table) {
  std::string options, choices;
  for (const VerbEntry& verb : table.verbs) {
    std::vector<std::string> names;
    for (const OptionEntry& option : verb.options) {
      if (!option.is_positional) names.insert(names.end(), option.names.begin(), option.names.end());
      if (option.choices.empty()) continue;
      const std::string key = option.is_positional ? ":" : option.names.back();
      choices += fmt::format("    {}{}) words='{}' ;;\n", verb.name, key, fmt::join(option.choices, " "));
    }
    options += fmt::format("    {}) words='{}' ;;\n", verb.name, fmt::join(names, " "));
  }
  return fmt::format(R"sh(# bash completion for dpde
_dpde() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} verb=${{COMP_WORDS[1]}} words=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W '{} --help --version' -- "$current"))
    return
  fi
  case $verb$before in
{}  esac
  if [ -z "$words" ] && [ "$COMP_CWORD" -eq 2 ]; then
    case $verb: in
{}    esac
  fi
  if [ -z "$words" ] && [[ $current == -* ]]; then
    case $verb in
{}    esac
  fi
  if [ -n "$words" ]; then
    COMPREPLY=($(compgen -W "$words" -- "$current"))
  elif [ "$COMP_CWORD" -eq 3 ] && [ -f "$before" ] && [[ $before == *.dpde ]]; then
    COMPREPLY=($(compgen -W "$({} "$before")" -- "$current"))
  else
    local IFS=$'\n'
    compopt -o filenames
    COMPREPLY=($(compgen -f -X '!*.@(dpde|nc|npy)' -- "$current") $(compgen -d -- "$current"))
  fi
}}
shopt -s extglob
complete -F _dpde dpde
)sh",
                     words_of(table), choices, choices, options, names_of_blocks);
}

std::string zsh_options(const VerbEntry& verb) {
  std::string text;
  int place = 0;
  for (const OptionEntry& option : verb.options) {
    const std::string told = quoted_text(option.text, true);
    const std::string words = option.choices.empty() ? "" : fmt::format("({})", fmt::join(option.choices, " "));
    if (option.is_positional) {
      const std::string what = !words.empty()              ? words
                               : option.names[0] == "FILE" ? "_files -g \"*.(dpde|nc|npy)\""
                               : option.names[0] == "NAME" ? "_dpde_names"
                                                           : "_files";
      text += fmt::format(" \\\n      '{}:{}:{}'", ++place, told, what);
      continue;
    }
    for (const std::string& name : option.names) {
      const std::string value = option.value.empty() ? "" : fmt::format(":value:{}", words.empty() ? "_files" : words);
      text += fmt::format(" \\\n      '*{}[{}]{}'", name, told, value);
    }
  }
  return text;
}

std::string zsh_script(const CommandTable& table) {
  std::string verbs, cases;
  for (const VerbEntry& verb : table.verbs) {
    verbs += fmt::format("    '{}:{}'\n", verb.name, quoted_text(verb.text, true));
    cases += fmt::format("    {}) _arguments{} ;;\n", verb.name, zsh_options(verb));
  }
  return fmt::format(R"sh(#compdef dpde
_dpde_names() {{
  local file=${{${{(Q)words[(r)*.dpde]}}/#\~/$HOME}}
  [[ -f $file ]] && compadd -- ${{(f)"$({} $file)"}}
}}
_dpde() {{
  local -a verbs
  verbs=(
{}  )
  if (( CURRENT == 2 )); then
    _describe verb verbs
    return
  fi
  local verb=$words[2]
  shift words
  (( CURRENT-- ))
  case $verb in
{}  esac
}}
_dpde "$@"
)sh",
                     names_of_blocks, verbs, cases);
}

std::string fish_script(const CommandTable& table) {
  std::string text = fmt::format(
      "# fish completion for dpde\n"
      "function __dpde_names\n"
      "  for word in (commandline -opc)\n"
      "    string match -q '*.dpde' -- $word; and test -f $word; and {} $word\n"
      "  end\nend\n",
      names_of_blocks);
  for (const VerbEntry& verb : table.verbs) {
    text += fmt::format("complete -c dpde -n __fish_use_subcommand -f -a {} -d '{}'\n", verb.name,
                        quoted_text(verb.text, false));
    const std::string seen = fmt::format("complete -c dpde -n '__fish_seen_subcommand_from {}'", verb.name);
    for (const OptionEntry& option : verb.options) {
      const std::string words = fmt::format("{}", fmt::join(option.choices, " "));
      if (option.is_positional && !words.empty()) text += fmt::format("{} -f -a '{}'\n", seen, words);
      if (option.is_positional && option.names[0] == "NAME") text += fmt::format("{} -a '(__dpde_names)'\n", seen);
      if (option.is_positional) continue;
      text += seen;
      for (const std::string& name : option.names)
        text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      if (!option.value.empty()) text += words.empty() ? " -r" : fmt::format(" -x -a '{}'", words);
      text += fmt::format(" -d '{}'\n", quoted_text(option.text, false));
    }
  }
  return text;
}

}  // namespace

std::string completion_script(const CommandTable& table, const std::string& shell) {
  if (shell == "bash") return bash_script(table);
  if (shell == "zsh") return zsh_script(table);
  return shell == "fish" ? fish_script(table) : "";
}

}  // namespace dpde::tools
