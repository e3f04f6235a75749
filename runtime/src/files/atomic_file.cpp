// SPDX-License-Identifier: Apache-2.0
// write, fsync, rename. If the system supports it the file has no name until it is complete: a killed process leaves
// nothing behind. Otherwise it has a temporary name, which only a kill leaves behind.
#include "dpde/runtime/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int code) {
  throw Error(ErrorKind::machine, fmt::format("cannot write {}: {}", path.string(), std::strerror(code)));
}

constexpr int most_attempts = 100;

std::string temporary_name(const std::filesystem::path& path, int attempt) {
  return fmt::format("{}.tmp-{}-{}", path.string(), getpid(), attempt);
}

}  // namespace

/// An open file. The destructor closes it and, unless it was finished, removes its temporary name.
class AtomicFile::Output {
 public:
  Output(const std::filesystem::path& path, bool direct, Access access)
      : path_(path), is_direct_(direct), access_(access) {
    if (direct) {
      descriptor_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    } else if (!create_nameless()) {
      create_temporary();
    }
    if (descriptor_ < 0) fail(path_, errno);
  }
  ~Output() {
    if (descriptor_ >= 0) close(descriptor_);
    if (!temporary_.empty()) unlink(temporary_.c_str());
  }
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  void write_all(std::string_view part) {
    while (!part.empty()) {
      const ssize_t written = write(descriptor_, part.data(), part.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(path_, errno);
      if (written == 0) fail(path_, EIO);
      part.remove_prefix(static_cast<size_t>(written));
    }
  }

  std::string name() {
    if (!is_direct_ && temporary_.empty()) give_name();
    return temporary_;
  }

  /// Keeps the end of the file, so the limit on file sizes (not one of the disk) is checked here.
  void reserve(std::int64_t bytes) const {
    struct stat now {};
    rlimit limit{};
    if (fstat(descriptor_, &now) != 0 || getrlimit(RLIMIT_FSIZE, &limit) != 0) fail(path_, errno);
    if (limit.rlim_cur != RLIM_INFINITY && static_cast<rlim_t>(now.st_size + bytes) > limit.rlim_cur)
      fail(path_, EFBIG);
    if (fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, now.st_size, static_cast<off_t>(bytes)) == 0) return;
    if (errno != EOPNOTSUPP && errno != ENOSYS && errno != EINTR) fail(path_, errno);
  }

  std::string_view read(std::int64_t offset, std::span<char> buffer) const {
    while (true) {
      const ssize_t count = pread(descriptor_, buffer.data(), buffer.size(), static_cast<off_t>(offset));
      if (count >= 0) return {buffer.data(), static_cast<size_t>(count)};
      if (errno != EINTR) fail(path_, errno);
    }
  }

  void cut(std::int64_t bytes) {
    if (ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0 || lseek(descriptor_, 0, SEEK_END) < 0)
      fail(path_, errno);
  }

  void finish() {
    if (!is_direct_) {
      set_permissions();
      if (fsync(descriptor_) != 0) fail(path_, errno);
      if (temporary_.empty()) give_name();
    }
    const int closed = close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) fail(path_, errno);
    if (is_direct_) return;
    if (rename(temporary_.c_str(), path_.c_str()) != 0) fail(path_, errno);
    temporary_.clear();
  }

 private:
  bool create_nameless() {
    const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
    descriptor_ = open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, mode());
    if (descriptor_ < 0) return false;
    std::error_code error;
    if (std::filesystem::exists(file_of_descriptor(), error)) return true;  // otherwise it could not be named later
    close(descriptor_);
    return false;
  }
  std::string file_of_descriptor() const { return fmt::format("/proc/self/fd/{}", descriptor_); }
  /// A name can be given only if it is free: the file then replaces the old one by a rename.
  void give_name() {
    for (int attempt = 0; attempt < most_attempts; ++attempt) {
      const std::string name = temporary_name(path_, attempt);
      const bool is_named =
          linkat(AT_FDCWD, file_of_descriptor().c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
      if (is_named) temporary_ = name;
      if (is_named) return;
      if (errno != EEXIST) break;
    }
    fail(path_, errno);
  }
  void create_temporary() {
    for (int attempt = 0; attempt < most_attempts; ++attempt) {
      const std::string name = temporary_name(path_, attempt);
      descriptor_ = open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode());
      if (descriptor_ >= 0) temporary_ = name;
      if (descriptor_ >= 0 || errno != EEXIST) return;
    }
  }
  mode_t mode() const { return access_ == Access::of_owner ? 0600 : 0666; }
  /// A replaced file keeps its permissions, unless it is to be private to its owner.
  void set_permissions() {
    struct stat old {};
    if (access_ == Access::of_owner) {
      if (fchmod(descriptor_, mode()) != 0) fail(path_, errno);
    } else if (stat(path_.c_str(), &old) == 0 && fchmod(descriptor_, old.st_mode & 07777) != 0) {
      fail(path_, errno);
    }
  }

  std::filesystem::path path_;
  bool is_direct_;
  Access access_;
  std::string temporary_;
  int descriptor_ = -1;
};

namespace {

/// A link is followed: its target is replaced, the link remains. A special file is written directly.
struct ReplacedFile {
  std::filesystem::path path;
  bool is_special;
};

ReplacedFile target_of(const std::filesystem::path& path) {
  struct stat status {};
  const bool exists = stat(path.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(path, EISDIR);
  const bool special = exists && !S_ISREG(status.st_mode);
  std::error_code error;
  const std::filesystem::path target = exists && !special ? std::filesystem::canonical(path, error) : path;
  if (error) fail(path, error.value());
  return {target, special};
}

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& path, Access access) {
  const ReplacedFile target = target_of(path);
  output_ = std::make_unique<Output>(target.path, target.is_special, access);
}
AtomicFile::~AtomicFile() = default;
AtomicFile::AtomicFile(AtomicFile&&) noexcept = default;
AtomicFile& AtomicFile::operator=(AtomicFile&&) noexcept = default;
void AtomicFile::append(std::string_view part) { output_->write_all(part); }
std::string AtomicFile::name() { return output_->name(); }
void AtomicFile::reserve(std::int64_t bytes) const { output_->reserve(bytes); }
std::string_view AtomicFile::read(std::int64_t offset, std::span<char> buffer) const {
  return output_->read(offset, buffer);
}
void AtomicFile::cut(std::int64_t bytes) { output_->cut(bytes); }
void AtomicFile::finish() { output_->finish(); }

namespace {

void write_atomically(AtomicFile file, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts) file.append(part);
  file.finish();
}

}  // namespace

void write_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts) {
  write_atomically(AtomicFile(path), parts);
}

void write_private_file_atomically(const std::filesystem::path& path, std::initializer_list<std::string_view> parts) {
  write_atomically(AtomicFile(path, AtomicFile::Access::of_owner), parts);
}

void write_file_atomically(const std::filesystem::path& path, std::string_view content) {
  write_file_atomically(path, {content});
}

}  // namespace dpde
