// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "command_table.h"

namespace dpde::tools {

namespace {

/// Escapes text for the page: no line begins with a request, and hyphens can be copied.
std::string page_text(const std::string& text) {
  std::string result;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\') result += "\\e";
    if (c == '-') result += "\\-";
    if (c != '\\' && c != '-') result += c;
    begins_line = c == '\n';
  }
  return result;
}

/// Keeps the lines.
std::string verbatim(const std::string& text) { return ".nf\n" + page_text(text) + "\n.fi\n"; }

std::string option_text(const OptionEntry& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names)
    names.push_back(fmt::format("{}{}\\fR", option.is_positional ? "\\fI" : "\\fB", page_text(name)));
  const std::string value = option.value.empty() ? "" : fmt::format(" \\fI{}\\fR", page_text(option.value));
  return fmt::format(".TP\n{}{}\n{}\n", fmt::join(names, ", "), value, page_text(option.text));
}

std::string verb_text(const VerbEntry& verb) {
  std::string text = fmt::format(".SS \"dpde {}\"\n{}\n", page_text(verb.name), page_text(verb.text));
  for (const OptionEntry& option : verb.options) text += option_text(option);
  if (!verb.footer.empty()) text += ".PP\n" + verbatim(verb.footer);
  return text;
}

}  // namespace

std::string manual_page(const CommandTable& table, const std::string& version) {
  std::string text = fmt::format(
      ".TH DPDE 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\ndpde \\- from equations to fast simulations and certified "
      "gradients\n.SH SYNOPSIS\n.B dpde\n.I VERB FILE.dpde\n[\\fINAME\\fR] [\\fIoptions\\fR]\n.SH DESCRIPTION\n"
      "A .dpde file says a partial differential equation, its discretisation and a scene. dpde compiles the step and "
      "its exact adjoint to machine code, proves the derivative, and solves with it.\n.SH VERBS\n",
      page_text(version));
  for (const VerbEntry& verb : table.verbs) text += verb_text(verb);
  text += ".SH \"FIRST STEPS AND EXIT STATUS\"\n" + verbatim(table.footer);
  text +=
      ".SH ENVIRONMENT\n.TP\n.B DPDE_CACHE\nThe folder of compiled code, in place of ~/.cache/dpde.\n.TP\n.B CXX\n"
      "The compiler of \\-\\-backend cpp and of dpde build.\n";
  return text;
}

}  // namespace dpde::tools
