// SPDX-License-Identifier: Apache-2.0
#include "driver/memory/cache_folder.h"

#include <elf.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <vector>

#include "codegen/llvm/jit.h"
#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"
#include "files/private_file.h"

namespace dpde::driver {
namespace fs = std::filesystem;

namespace {

constexpr std::string_view magic = "dpdecod1";  // ends with the format version
constexpr const char* extension = ".code";

struct Header {
  std::array<char, 8> magic;
  std::uint64_t key_bytes, code_bytes, checksum;
};

std::uint64_t checksum_of(std::string_view key, std::string_view code) {
  return hash_bytes(code.data(), code.size(), hash_bytes(key.data(), key.size()));
}

struct BuildId {
  const void* inside;  // an address in the object whose id is looked up
  std::string id;
};

/// Finds the linker's content hash (build id) of an executable or library in its notes in memory.
int find_build_id(dl_phdr_info* info, std::size_t, void* data) {
  BuildId& wanted = *static_cast<BuildId*>(data);
  const auto place_of = [&](const ElfW(Phdr) & segment) {
    return reinterpret_cast<const char*>(info->dlpi_addr + segment.p_vaddr);
  };
  const auto holds = [&](const ElfW(Phdr) & segment) {
    const char* inside = static_cast<const char*>(wanted.inside);
    return segment.p_type == PT_LOAD && inside >= place_of(segment) && inside < place_of(segment) + segment.p_memsz;
  };
  const ElfW(Phdr)* const segments = info->dlpi_phdr;
  if (!std::any_of(segments, segments + info->dlpi_phnum, holds)) return 0;
  for (int i = 0; i < info->dlpi_phnum && wanted.id.empty(); ++i) {
    if (segments[i].p_type != PT_NOTE) continue;
    const char* place = place_of(segments[i]);
    const char* const end = place + segments[i].p_memsz;
    while (place + sizeof(ElfW(Nhdr)) <= end) {
      ElfW(Nhdr) note;
      std::memcpy(&note, place, sizeof note);
      const char* name = place + sizeof note;
      const char* content = name + (note.n_namesz + 3) / 4 * 4;
      const bool is_id = note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(name, "GNU", 4) == 0;
      if (is_id) wanted.id.assign(content, note.n_descsz);
      place = content + (note.n_descsz + 3) / 4 * 4;
    }
  }
  return 1;
}

/// Identity of this process's compiler, which all keys include; "" if it is unknown.
std::string identity() {
  BuildId dpde{magic.data(), ""};
  dl_iterate_phdr(find_build_id, &dpde);
  return dpde.id.empty() ? "" : dpde.id + '\n' + codegen::host_description() + '\n';
}

class CacheFolder : public codegen::CodeCache {
 public:
  CacheFolder(fs::path folder, std::string identity, std::uint64_t most_bytes)
      : folder_(std::move(folder)), identity_(std::move(identity)), most_bytes_(most_bytes) {}

  std::optional<std::string> find(std::string_view key) override {
    const std::string whole = identity_ + std::string(key);
    const fs::path path = path_of(whole);
    std::error_code error;
    if (!fs::exists(fs::symlink_status(path, error))) return std::nullopt;
    const std::optional<std::string> bytes = files::read_private_file(path);
    std::optional<std::string> code = bytes ? code_in(*bytes, whole) : std::nullopt;
    if (!code) {
      ::unlink(path.c_str());
      return std::nullopt;
    }
    ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // marks it as used now
    return code;
  }

  void store(std::string_view key, std::string_view code) override {
    const std::string whole = identity_ + std::string(key);
    Header header{{}, whole.size(), code.size(), checksum_of(whole, code)};
    std::copy(magic.begin(), magic.end(), header.magic.begin());
    if (sizeof header + whole.size() + code.size() > most_bytes_) return;
    try {
      write_private_file_atomically(path_of(whole),
                                    {{reinterpret_cast<const char*>(&header), sizeof header}, whole, code});
    } catch (const Error&) {
      return;  // no space or permission: the code is compiled again next time
    }
    shrink();
  }

 private:
  fs::path path_of(const std::string& key) const {
    // Two hashes, so that keys rarely share a file. The file has the key, which detects that.
    const std::uint64_t first = hash_bytes(key.data(), key.size()), second = hash_bytes(key.data(), key.size(), first);
    return folder_ / fmt::format("{:016x}{:016x}{}", first, second, extension);
  }

  static std::optional<std::string> code_in(const std::string& bytes, std::string_view key) {
    Header header;
    if (bytes.size() < sizeof header) return std::nullopt;
    std::memcpy(&header, bytes.data(), sizeof header);
    const std::size_t rest = bytes.size() - sizeof header;
    const bool has_sizes =
        header.key_bytes == key.size() && rest >= key.size() && header.code_bytes == rest - key.size();
    if (!has_sizes || !std::equal(magic.begin(), magic.end(), header.magic.begin())) return std::nullopt;
    const std::string_view all = std::string_view(bytes).substr(sizeof header);
    const std::string_view own_key = all.substr(0, key.size()), code = all.substr(key.size());
    if (own_key != key || checksum_of(own_key, code) != header.checksum) return std::nullopt;
    return std::string(code);
  }

  /// Other processes may do the same concurrently. Every failure here means that a file is already gone.
  void shrink() const {
    struct Entry {
      fs::file_time_type used;
      std::uint64_t bytes;
      fs::path path;
    };
    std::vector<Entry> entries;
    std::uint64_t total = 0;
    std::error_code error;
    const auto abandoned = fs::file_time_type::clock::now() - std::chrono::hours(1);
    for (fs::directory_iterator file(folder_, error), end; !error && file != end; file.increment(error)) {
      std::error_code gone;
      const Entry entry{file->last_write_time(gone), file->file_size(gone), file->path()};
      if (gone) continue;
      if (entry.path.extension() == extension) {
        entries.push_back(entry);
        total += entry.bytes;
      } else if (entry.used < abandoned &&
                 entry.path.filename().string().find(std::string(extension) + ".tmp-") != std::string::npos) {
        fs::remove(entry.path, gone);  // left by a process that was killed while it wrote
      }
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.used < b.used; });
    for (const Entry& entry : entries) {
      if (total <= most_bytes_) break;
      fs::remove(entry.path, error);
      total -= entry.bytes;
    }
  }

  fs::path folder_;
  std::string identity_;
  std::uint64_t most_bytes_;
};

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Why users other than this one and root may replace the content of a folder; "" if they may not. In a sticky folder
/// such as /tmp others may add files, but not replace existing ones.
std::string why_open_to_others(const fs::path& folder, bool is_parent) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode)) return folder.string() + " is no folder";
  const bool is_own = status.st_uid == ::geteuid() || (is_parent && status.st_uid == 0);
  if (!is_own) return folder.string() + " is another user's";
  const bool is_shared = (status.st_mode & (S_IWGRP | S_IWOTH)) != 0;
  const bool is_sticky = (status.st_mode & S_ISVTX) != 0;
  return is_shared && !(is_parent && is_sticky) ? "others may write to " + folder.string() : "";
}

/// Creates missing folders of the path, each private to this user whatever the umask is, since this user will run code
/// from there. Failures are found when the folder is checked.
void make_private(const fs::path& folder) {
  fs::path part;
  for (const fs::path& name : folder) {
    part /= name;
    ::mkdir(part.c_str(), 0700);
  }
}

}  // namespace

std::string why_not_private(const fs::path& folder) {
  std::error_code error;
  const fs::path whole = fs::canonical(folder, error);
  if (error) return error == std::errc::no_such_file_or_directory ? "" : error.message();
  std::string why = why_open_to_others(whole, false);
  for (fs::path parent = whole; why.empty() && parent != parent.root_path();) {
    parent = parent.parent_path();
    why = why_open_to_others(parent, true);
  }
  return why;
}

std::shared_ptr<codegen::CodeCache> open_cache(const fs::path& folder, std::uint64_t most_bytes) {
  const std::string who = identity();
  if (who.empty()) return nullptr;
  make_private(folder);
  std::error_code error;
  if (!fs::is_directory(folder, error) || !why_not_private(folder).empty()) return nullptr;
  return std::make_shared<CacheFolder>(folder, who, most_bytes);
}

fs::path default_cache_folder() {
  if (const std::string own = environment("DPDE_CACHE"); !own.empty()) return own;
  if (const fs::path user = environment("XDG_CACHE_HOME"); user.is_absolute()) return user / "dpde";
  const fs::path home = environment("HOME");
  return home.is_absolute() ? home / ".cache" / "dpde" : fs::path();
}

}  // namespace dpde::driver
