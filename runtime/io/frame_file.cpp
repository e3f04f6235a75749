// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/frame_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <vector>

#include "dpde/runtime/bytes.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace fs = std::filesystem;

namespace {

constexpr int most_files = 100;

[[noreturn]] void fail(const fs::path& path) {
  throw Error(ErrorKind::machine, fmt::format("cannot write {}: {}", path.string(), std::strerror(errno)));
}

std::uint64_t empty_checksum() { return hash_bytes("", 0); }

}  // namespace

FrameFile::Descriptor::~Descriptor() {
  if (number >= 0) close(number);
  if (!unmeant.empty()) unlink(unmeant.c_str());
}

FrameFile::FrameFile(const fs::path& checkpoint) : checkpoint_(checkpoint) {
  int number = 0;
  std::error_code error;
  while (number < most_files && fs::exists(path_of(number), error)) ++number;
  mark_ = {path_of(number).filename().string(), 0, empty_checksum()};
}

fs::path FrameFile::path_of(int number) const {
  return checkpoint_.parent_path() /
         fmt::format("{}.frames{}", checkpoint_.stem().string(), number == 0 ? "" : fmt::format("-{}", number));
}

std::string FrameFile::descriptor_name() const { return fmt::format("/proc/self/fd/{}", file_.number); }

void FrameFile::open_file() {
  if (file_.number >= 0) return;
  const fs::path folder = checkpoint_.has_parent_path() ? checkpoint_.parent_path() : ".";
  file_.number = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
  std::error_code error;
  if (file_.number >= 0 && fs::exists(descriptor_name(), error)) return;  // otherwise it could not be named later
  if (file_.number >= 0) close(file_.number);
  file_.number = ::open(path().c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);  // for systems without unnamed files
  if (file_.number < 0) fail(path());
  file_.unmeant = path();
  file_.has_name = true;
}

void FrameFile::append(std::span<const double> frame) {
  open_file();
  const char* const bytes = reinterpret_cast<const char*>(frame.data());
  for (std::size_t done = 0; done < frame.size_bytes();) {
    const ssize_t written = pwrite(file_.number, bytes + done, frame.size_bytes() - done,
                                   static_cast<off_t>(mark_.bytes) + static_cast<off_t>(done));
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = EIO;
    if (written <= 0) fail(path());
    done += static_cast<std::size_t>(written);
  }
  mark_.bytes += static_cast<std::int64_t>(frame.size_bytes());
  mark_.checksum = hash_bytes(bytes, frame.size_bytes(), mark_.checksum);
}

void FrameFile::read(std::int64_t first, std::span<double> numbers) const {
  char* const bytes = reinterpret_cast<char*>(numbers.data());
  const std::int64_t begin = first * std::int64_t{sizeof(double)};
  for (std::size_t done = 0; done < numbers.size_bytes();) {
    const ssize_t count = pread(file_.number, bytes + done, numbers.size_bytes() - done,
                                static_cast<off_t>(begin) + static_cast<off_t>(done));
    if (count < 0 && errno == EINTR) continue;
    if (count == 0) errno = EIO;
    if (count <= 0)
      throw Error(ErrorKind::machine, fmt::format("cannot read {}: {}", mark_.file, std::strerror(errno)));
    done += static_cast<std::size_t>(count);
  }
}

FrameMark FrameFile::sync() {
  if (file_.number < 0) return mark_;
  if (fdatasync(file_.number) != 0) fail(path());
  if (!file_.has_name && linkat(AT_FDCWD, descriptor_name().c_str(), AT_FDCWD, path().c_str(), AT_SYMLINK_FOLLOW) != 0)
    fail(path());
  file_.has_name = true;
  file_.unmeant.clear();
  return mark_;
}

void FrameFile::reopen(const FrameMark& mark) {
  const fs::path path = checkpoint_.parent_path() / fs::path(mark.file).filename();
  const auto damaged = [&] {
    throw Error(ErrorKind::input, fmt::format("{} is not the file its checkpoint means, or damaged", path.string()));
  };
  std::error_code error;
  const auto size = mark.bytes == 0 ? 0 : fs::file_size(path, error);
  if (error || mark.bytes < 0 || mark.bytes % std::int64_t{sizeof(double)} != 0 ||
      size < static_cast<std::uintmax_t>(mark.bytes))
    damaged();
  mark_ = mark;
  if (mark.bytes == 0) return;
  file_.number = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file_.number < 0) damaged();
  file_.has_name = true;
  std::vector<double> part(std::size_t{1} << 16);
  std::uint64_t checksum = empty_checksum();
  for (std::int64_t at = 0; at < count(); at += static_cast<std::int64_t>(part.size())) {
    part.resize(static_cast<std::size_t>(std::min(count() - at, static_cast<std::int64_t>(part.size()))));
    read(at, part);
    checksum = hash_bytes(part.data(), part.size() * sizeof(double), checksum);
  }
  if (checksum != mark.checksum) damaged();
}

void FrameFile::remove_others() {
  if (is_alone_) return;
  is_alone_ = true;
  std::error_code error;
  for (int number = 0; number < most_files; ++number) {
    const fs::path path = path_of(number);
    if (path.filename() != mark_.file) fs::remove(path, error);
  }
}

}  // namespace dpde
