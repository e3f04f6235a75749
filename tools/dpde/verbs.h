// SPDX-License-Identifier: Apache-2.0
// The verbs of the command, one file each. Each adds its subcommand; the exit status goes to `status`.
#pragma once

namespace CLI {
class App;
}

namespace dpde::tools {

void add_run(CLI::App& app, int& status);
void add_check(CLI::App& app, int& status);
void add_stability(CLI::App& app, int& status);
void add_chart(CLI::App& app, int& status);
void add_tune(CLI::App& app, int& status);
void add_emit(CLI::App& app, int& status);
void add_verify(CLI::App& app, int& status);
void add_gradient(CLI::App& app, int& status);
void add_optimize(CLI::App& app, int& status);
void add_test(CLI::App& app, int& status);
void add_build(CLI::App& app, int& status);
void add_bench(CLI::App& app, int& status);
void add_plot(CLI::App& app, int& status);
void add_fmt(CLI::App& app, int& status);
void add_new(CLI::App& app, int& status);
void add_explain(CLI::App& app, int& status);
void add_lsp(CLI::App& app, int& status);
void add_completion(CLI::App& app, int& status);
void add_man(CLI::App& app, int& status);

}  // namespace dpde::tools
