// SPDX-License-Identifier: Apache-2.0
// Files through POSIX calls: the only way to sync, and to learn why something failed.
#include "driver/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace dpde::driver {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t largest_file = std::size_t{16} << 30;

/// Closes a descriptor at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close_now(); }
  int get() const { return fd_; }
  int close_now() {
    const int result = fd_ >= 0 ? ::close(fd_) : 0;
    fd_ = -1;
    return result;
  }

 private:
  int fd_;
};

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool fail_to_write(const fs::path& path, int error, DiagnosticSink& sink) {
  sink.report("cannot-write", {}, {path.string(), std::strerror(error)});
  return false;
}

bool write_device(const fs::path& path, std::string_view bytes, DiagnosticSink& sink) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
  if (file.get() < 0 || !write_all(file.get(), bytes) || file.close_now() != 0) return fail_to_write(path, errno, sink);
  return true;
}

}  // namespace

std::optional<std::string> read_file(const fs::path& path, SourceRange where, DiagnosticSink& sink) {
  const auto fail = [&](const std::string& reason) {
    sink.report("cannot-read", where, {path.string(), reason});
    return std::nullopt;
  };
  // O_NONBLOCK: a named pipe without a writer must not hang us; regular files do not notice.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.get() < 0) return fail(std::strerror(errno));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) return fail("it is a folder");
  if (!S_ISREG(status.st_mode)) return fail("it is not a regular file");
  if (static_cast<std::size_t>(status.st_size) > largest_file) return fail("it is larger than 16 GiB");
  std::string bytes(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(file.get(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return fail(std::strerror(errno));
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

bool write_file(const fs::path& path, std::string_view bytes, DiagnosticSink& sink) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) return fail_to_write(path, EISDIR, sink);
    if (!S_ISREG(status.st_mode)) return write_device(path, bytes, sink);
  }
  const std::string temporary = path.string() + ".part" + std::to_string(::getpid());
  Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) return fail_to_write(path, errno, sink);
  const bool written = write_all(file.get(), bytes) && ::fsync(file.get()) == 0 && file.close_now() == 0;
  if (!written || ::rename(temporary.c_str(), path.c_str()) != 0) {
    const int error = errno;
    ::unlink(temporary.c_str());
    return fail_to_write(path, error, sink);
  }
  return true;
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

}  // namespace dpde::driver
