// SPDX-License-Identifier: Apache-2.0
// Reads by POSIX calls, which return the kind of file and the reason of failures.
#include "files/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "dpde/runtime/atomic_file.h"
#include "dpde/runtime/error.h"
#include "files/private_file.h"

namespace dpde::files {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest_file = std::size_t{16} << 30;

/// Closes a descriptor at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// Returns nullopt and sets errno if it cannot be read.
std::optional<std::string> content_of(const Descriptor& file, const struct stat& status) {
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace

std::optional<std::string> read_file(const fs::path& path, SourceRange where, DiagnosticSink& sink) {
  const auto fail = [&](const std::string& reason) {
    sink.report("cannot-read", where, {path.string(), reason});
    return std::nullopt;
  };
  // O_NONBLOCK: a named pipe without a writer must not block; regular files are not affected.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return fail(std::strerror(errno));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) return fail("it is a folder");
  if (!S_ISREG(status.st_mode)) return fail("it is not a regular file");
  if (static_cast<std::size_t>(status.st_size) > largest_file) return fail("it is larger than 16 GiB");
  std::optional<std::string> bytes = content_of(file, status);
  if (!bytes) return fail(std::strerror(errno));
  return bytes;
}

std::optional<std::string> read_private_file(const fs::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOFOLLOW));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0 || !S_ISREG(status.st_mode)) return std::nullopt;
  const bool is_own = status.st_uid == ::geteuid() && (status.st_mode & (S_IWGRP | S_IWOTH)) == 0;
  const bool fits = static_cast<std::size_t>(status.st_size) <= largest_file;
  return is_own && fits ? content_of(file, status) : std::nullopt;
}

bool write_file(const fs::path& path, std::string_view bytes, DiagnosticSink& sink) {
  try {
    write_file_atomically(path, bytes);
    return true;
  } catch (const Error& error) {
    sink.report("machine-failed", {}, {error.what()});
    return false;
  }
}

bool make_folder(const fs::path& path, DiagnosticSink& sink) {
  std::error_code error;
  fs::create_directories(path, error);
  if (!error && !fs::is_directory(path, error)) error = std::make_error_code(std::errc::not_a_directory);
  if (!error) return true;
  sink.report("cannot-write", {}, {path.string(), error.message()});
  return false;
}

fs::path find_data_file(const std::string& file, const std::string& model_file) {
  const fs::path beside = fs::path(model_file).parent_path() / file;
  std::error_code error;
  return fs::exists(beside, error) ? beside : fs::path(file);
}

}  // namespace dpde::files
