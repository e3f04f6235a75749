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

/// The scene or task of a model file, and the prefix of its files once another one owns the plain names.
struct Owner {
  std::string model, name;
  std::string stem() const { return fs::path(model).stem().string(); }
  std::string prefix() const { return name.empty() ? stem() : name; }
  bool operator==(const Owner&) const = default;
};

/// Lines "u.npy<tab>model<tab>scene". Without a valid record owners are unknown, and no file is kept.
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

/// Equal for the same file and scene, however the command line names them.
Owner owner_now(const Job& job) {
  std::error_code error;
  const fs::path model = fs::weakly_canonical(job.options().file, error);
  return {error ? job.options().file : model.string(), job.name()};
}

/// A new name for `file`, which belongs to its owner: one that no other owner has, since another model may have a scene
/// of the same name.
std::string free_name(const fs::path& file, const Owner& owner, const std::map<std::string, Owner>& owners) {
  const std::string name = owner.prefix() + "_" + file.filename().string();
  std::string found = name;
  const auto is_of_others = [&] {
    std::error_code error;
    const auto known = owners.find(found);
    const bool is_own = known != owners.end() && known->second == owner;
    return !is_own && fs::exists(fs::symlink_status(file.parent_path() / found, error));
  };
  if (is_of_others()) found = owner.stem() + "_" + name;
  for (int number = 2; is_of_others(); ++number) found = fmt::format("{}_{}_{}", owner.stem(), number, name);
  return found;
}

}  // namespace

void keep_file_of_others(Job& job, const fs::path& file) {
  const fs::path record = file.parent_path() / ".dpde";
  std::map<std::string, Owner> owners = owners_in(record);
  const Owner own = owner_now(job);
  const auto known = owners.find(file.filename().string());
  std::error_code error;
  if (known != owners.end() && known->second == own) return;
  if (known != owners.end() && fs::exists(file, error)) {
    const Owner other = known->second;
    const std::string kept = free_name(file, other, owners);
    fs::rename(file, file.parent_path() / kept, error);
    if (!error) {
      job.say(fmt::format("{} of {} is {} now\n", file.string(), other.prefix(), kept));
      owners[kept] = other;
    }
  }
  owners[file.filename().string()] = own;
  std::string text;
  for (const auto& [name, owner] : owners) text += fmt::format("{}\t{}\t{}\n", name, owner.model, owner.name);
  try {
    write_file_atomically(record, text);
  } catch (const Error&) {  // then the file cannot be written either, which is reported
  }
}

}  // namespace dpde::tools
