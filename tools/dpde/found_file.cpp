// SPDX-License-Identifier: Apache-2.0
#include "found_file.h"

#include <fmt/format.h>

#include <filesystem>

#include "dpde/runtime/bytes.h"
#include "driver/report/restart_file.h"
#include "files/files.h"
#include "scene_output.h"

namespace dpde::tools {

namespace {

constexpr std::string_view found_magic = "dpdefnd1";  // then: the task, its unknowns, their values, a checksum

std::string file_of_found(const TaskRun& run) { return run.task().name + ".found"; }

/// "initial u 32, nu 1"
std::string names_of_unknowns(const TaskRun& run) {
  std::string text;
  for (const driver::Inverse::Part& part : run.inverse->parts())
    text +=
        fmt::format("{}{}{} {}", text.empty() ? "" : ", ", part.is_initial() ? "initial " : "", part.name, part.size);
  return text;
}

}  // namespace

void save_found(Job& job, const TaskRun& run, const Eigen::VectorXd& x) {
  ByteWriter out;
  out.text(run.task().name);
  out.text(names_of_unknowns(run));
  out.values({x.data(), x.data() + x.size()});
  save_text(job, file_of_found(run), driver::sealed(std::string(found_magic) + out.bytes()));
}

std::optional<Eigen::VectorXd> load_found(Job& job, const TaskRun& run, const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / file_of_found(run)).string();
  const std::optional<std::string> bytes = files::read_file(path, {}, job.sink());
  if (!bytes) return std::nullopt;
  const auto refuse = [&](const std::string& why) {
    job.sink().report("bad-array-file", {}, {path, why}, "dpde optimize with --out writes such a file");
    return std::nullopt;
  };
  const std::optional<std::string_view> content = driver::unsealed(*bytes);
  if (!content || !content->starts_with(found_magic)) return refuse("it is damaged");
  ByteReader in(content->substr(found_magic.size()));
  const std::string task = in.text(), unknowns = in.text();
  const std::vector<double> values = in.values();
  if (!in.is_done()) return refuse("it is damaged");
  if (task != run.task().name || unknowns != names_of_unknowns(run))
    return refuse(fmt::format("it is of task {} with the unknowns {}, wanted are those of task {}, {}", task, unknowns,
                              run.task().name, names_of_unknowns(run)));
  if (std::ssize(values) != run.inverse->size()) return refuse("it is damaged");
  return Eigen::Map<const Eigen::VectorXd>(values.data(), run.inverse->size());
}

}  // namespace dpde::tools
