// SPDX-License-Identifier: Apache-2.0
#include "task_run.h"

#include <fmt/format.h>

#include "interrupt.h"
#include "scene_output.h"

namespace dpde::tools {

void add_task_options(CLI::App& verb, TaskOptions& options) {
  add_common_options(verb, options);
  verb.add_option("--memory", options.memory, "bytes for stored states, with K, M or G; the steps between are computed again")
      ->type_name("BYTES");
}

bool open_task(Job& job, const TaskOptions& options, TaskRun& run) {
  driver::SessionOptions session;
  session.threads = thread_count(options);
  session.stop = &interrupt_flag();
  if (!options.memory.empty()) {
    const std::optional<std::uint64_t> bytes = parse_bytes(options.memory);
    if (!bytes) {
      job.sink().report("bad-option", {}, {fmt::format("--memory {} is not a number of bytes, as in 64M", options.memory)});
      return false;
    }
    session.checkpoint_bytes = static_cast<std::int64_t>(*bytes);
  }
  if (!job.load_source() || !prepare_out(job)) return false;
  std::optional<driver::CompileOptions> compile_options = job.compile_options();
  if (!compile_options) return false;
  compile_options->adjoint = true;
  std::optional<driver::Compiled> compiled = driver::compile(job.source(), *compile_options, job.sink());
  if (!compiled) return false;
  if (!compiled->problem || !compiled->problem->task) {
    job.sink().report("nothing-to-do", {}, {"there is no task to work on"}, "name a task of the file: task NAME : SCENE { ... }");
    return false;
  }
  run.compiled = std::make_shared<driver::Compiled>(std::move(*compiled));
  run.session = driver::Session::open(job.source(), run.compiled, session, job.sink());
  if (run.session) run.inverse = driver::Inverse::open(*run.session, job.source(), job.sink());
  return run.inverse != nullptr;
}

std::vector<double> part_of(const Eigen::VectorXd& x, const driver::Inverse::Part& part) {
  return {x.data() + part.offset, x.data() + part.offset + part.size};
}

double norm_of(const Eigen::VectorXd& x, const driver::Inverse::Part& part) { return x.segment(part.offset, part.size).norm(); }

}  // namespace dpde::tools
