// SPDX-License-Identifier: Apache-2.0
// The verbs of the command, one file each. Each adds its subcommand; text and exit status go to the console.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace dpde::tools {

struct Console;
struct Streams;

void add_run(CLI::App& app, Console& console);
void add_check(CLI::App& app, Console& console);
void add_stability(CLI::App& app, Console& console);
void add_chart(CLI::App& app, Console& console);
void add_tune(CLI::App& app, Console& console);
void add_emit(CLI::App& app, Console& console);
void add_verify(CLI::App& app, Console& console);
void add_gradient(CLI::App& app, Console& console);
void add_optimize(CLI::App& app, Console& console);
void add_test(CLI::App& app, Console& console);
void add_build(CLI::App& app, Console& console);
void add_bench(CLI::App& app, Console& console);
void add_plot(CLI::App& app, Console& console);
void add_fmt(CLI::App& app, Console& console);
void add_new(CLI::App& app, Console& console);
void add_explain(CLI::App& app, Console& console);
void add_help(CLI::App& app, Console& console);
/// What an error code says, printed; the exit status.
int explain(const std::string& code, const Streams& streams);
void add_lsp(CLI::App& app, Console& console);
void add_completion(CLI::App& app, Console& console);
void add_man(CLI::App& app, Console& console);

}  // namespace dpde::tools
