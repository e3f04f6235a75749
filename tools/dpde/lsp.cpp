// SPDX-License-Identifier: Apache-2.0
// dpde lsp: the language server for editors, on standard input and output.
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "command.h"
#include "lsp/server.h"
#include "lsp/wire.h"
#include "report/scene/formal_order.h"
#include "verbs.h"

namespace dpde::tools {

namespace {

std::string order_text(const model::Problem& problem) {
  const std::string text = report::text_of(report::formal_order(problem));
  return text.substr(0, text.find('\n'));
}

int serve() {
  lsp::Wire wire(STDIN_FILENO, STDOUT_FILENO);
  bool is_heard = true;
  lsp::Server server([&](const Json& message) { is_heard = is_heard && wire.write(message); }, order_text, version);
  while (is_heard && !server.has_ended()) {
    if (wire.is_idle()) server.settle([&] { return !wire.is_idle(); });
    const std::optional<std::string> message = wire.read();
    if (!message) break;
    server.handle(*message);
  }
  return server.status();
}

}  // namespace

void add_lsp(CLI::App& app, Console& console) {
  CLI::App* verb = app.add_subcommand("lsp", "the language server for editors, on standard input and output");
  verb->add_flag("--stdio")->description("the same: some editors say so");
  verb->footer("Example:  dpde lsp    (an editor starts it: see tools/editors)");
  on_call(*verb, console, serve);
}

}  // namespace dpde::tools
