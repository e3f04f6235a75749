// SPDX-License-Identifier: Apache-2.0
#include "files/evaluation_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"

namespace dpde::files {

namespace {

constexpr std::int64_t header_bytes = 24;
constexpr double seconds_between_syncs = 1;

bool read_exactly(int file, void* bytes, std::int64_t count, std::int64_t at) {
  char* to = static_cast<char*>(bytes);
  while (count > 0) {
    const ssize_t got = pread(file, to, static_cast<std::size_t>(count), at);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    to += got;
    at += got;
    count -= got;
  }
  return true;
}

bool write_exactly(int file, const void* bytes, std::int64_t count, std::int64_t at) {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t put = pwrite(file, from, static_cast<std::size_t>(count), at);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    from += put;
    at += put;
    count -= put;
  }
  return true;
}

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

}  // namespace

EvaluationLog::EvaluationLog(const std::filesystem::path& path, std::uint64_t key, Eigen::Index unknowns, bool resume,
                             DiagnosticSink& sink)
    : path_(path), unknowns_(unknowns), last_sync_(now()) {
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) {
    sink.report("cannot-write", {}, {path.string(), std::strerror(errno)});
    return;
  }
  std::uint64_t header[3] = {0, key, static_cast<std::uint64_t>(unknowns)}, found[3] = {};
  std::memcpy(header, "dpdelog1", 8);
  if (resume && read_exactly(file_, found, header_bytes, 0)) {
    if (std::memcmp(header, found, sizeof header) != 0) {
      sink.report("bad-option", {},
                  {fmt::format("--resume: {} belongs to another task or to other options", path.string())});
      close(file_);
      file_ = -1;
      return;
    }
    double loss;
    Eigen::VectorXd gradient(unknowns);
    while (read_record(recorded_, loss, gradient)) ++recorded_;
  }
  const bool ready =
      ftruncate(file_, header_bytes + recorded_ * record_bytes()) == 0 && write_exactly(file_, header, header_bytes, 0);
  if (ready) return;
  sink.report("cannot-write", {}, {path.string(), std::strerror(errno)});
  close(file_);
  file_ = -1;
}

EvaluationLog::~EvaluationLog() {
  if (file_ >= 0) close(file_);
}

bool EvaluationLog::read_record(std::int64_t index, double& loss, Eigen::VectorXd& gradient) {
  const std::int64_t at = header_bytes + index * record_bytes();
  std::uint64_t checksum = 0;
  if (!read_exactly(file_, &loss, 8, at) || !read_exactly(file_, gradient.data(), 8 * unknowns_, at + 8)) return false;
  if (!read_exactly(file_, &checksum, 8, at + record_bytes() - 8)) return false;
  return checksum == hash_bytes(gradient.data(), static_cast<std::size_t>(8 * unknowns_), hash_bytes(&loss, 8));
}

bool EvaluationLog::next(double& loss, Eigen::VectorXd& gradient) {
  return position_ < recorded_ && read_record(position_, loss, gradient) && ++position_ > 0;
}

void EvaluationLog::append(double loss, const Eigen::VectorXd& gradient) {
  const std::int64_t at = header_bytes + position_ * record_bytes();
  const std::uint64_t checksum =
      hash_bytes(gradient.data(), static_cast<std::size_t>(8 * unknowns_), hash_bytes(&loss, 8));
  record_.resize(static_cast<std::size_t>(record_bytes()));
  std::memcpy(record_.data(), &loss, 8);
  std::memcpy(record_.data() + 8, gradient.data(), static_cast<std::size_t>(8 * unknowns_));
  std::memcpy(record_.data() + record_bytes() - 8, &checksum, 8);
  if (!write_exactly(file_, record_.data(), record_bytes(), at))
    throw Error(ErrorKind::machine, fmt::format("cannot write {}: {}", path_.string(), std::strerror(errno)));
  ++position_;
  if (now() - last_sync_ < seconds_between_syncs) return;
  last_sync_ = now();
  fdatasync(file_);
}

}  // namespace dpde::files
