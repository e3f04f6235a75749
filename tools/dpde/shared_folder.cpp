// SPDX-License-Identifier: Apache-2.0
#include "shared_folder.h"

#include <fmt/format.h>

#include <map>
#include <sstream>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/error.h"
#include "files/files.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

/// The scene or task of a model file, and what its files begin with once they are another's.
struct Owner {
  std::string model, name;
  std::string prefix() const { return name.empty() ? fs::path(model).stem().string() : name; }
  bool operator==(const Owner&) const = default;
};

/// Lines "u.npy<tab>model<tab>scene". Without one, or where it is damaged, nobody knows, and nothing is kept.
std::map<std::string, Owner> owners_in(const fs::path& record) {
  DiagnosticSink ignored;
  std::istringstream lines(files::read_file(record, {}, ignored).value_or(""));
  std::map<std::string, Owner> owners;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream parts(line);
    std::string file;
    Owner owner;
    if (std::getline(parts, file, '\t') && std::getline(parts, owner.model, '\t')) {
      std::getline(parts, owner.name, '\t');
      owners[file] = owner;
    }
  }
  return owners;
}

}  // namespace

void keep_file_of_others(Job& job, const fs::path& file) {
  const fs::path record = file.parent_path() / ".dpde";
  std::map<std::string, Owner> owners = owners_in(record);
  const Owner own{job.options().file, job.options().name};
  const auto known = owners.find(file.filename().string());
  std::error_code error;
  if (known != owners.end() && known->second == own) return;
  if (known != owners.end() && fs::exists(file, error)) {
    const std::string kept = known->second.prefix() + "_" + file.filename().string();
    fs::rename(file, file.parent_path() / kept, error);
    if (!error) job.say(fmt::format("{} of {} is {} now\n", file.string(), known->second.prefix(), kept));
    owners[kept] = known->second;
  }
  owners[file.filename().string()] = own;
  std::string text;
  for (const auto& [name, owner] : owners) text += fmt::format("{}\t{}\t{}\n", name, owner.model, owner.name);
  try {
    write_file_atomically(record, text);
  } catch (const Error&) {  // who cannot write it cannot write the file either, which says so
  }
}

}  // namespace dpde::tools
