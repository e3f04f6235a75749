// SPDX-License-Identifier: Apache-2.0
#include "frame_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "dpde/runtime/error.h"
#include "files/evaluation_log.h"

namespace dpde::tools {
namespace fs = std::filesystem;

namespace {

constexpr int most_files = 100;

[[noreturn]] void fail(const fs::path& path) {
  throw Error(ErrorKind::machine, fmt::format("cannot write {}: {}", path.string(), std::strerror(errno)));
}

std::uint64_t empty_checksum() { return files::hash_bytes("", 0); }

}  // namespace

FrameFile::Descriptor::~Descriptor() {
  if (number >= 0) close(number);
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

void FrameFile::open_file() {
  if (file_.number >= 0) return;
  const fs::path path = checkpoint_.parent_path() / mark_.file;
  file_.number = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file_.number < 0) fail(path);
}

void FrameFile::append(std::span<const double> frame) {
  open_file();
  const char* const bytes = reinterpret_cast<const char*>(frame.data());
  for (std::size_t done = 0; done < frame.size_bytes();) {
    const ssize_t written = pwrite(file_.number, bytes + done, frame.size_bytes() - done,
                                   static_cast<off_t>(mark_.bytes) + static_cast<off_t>(done));
    if (written < 0 && errno == EINTR) continue;
    if (written == 0) errno = EIO;
    if (written <= 0) fail(mark_.file);
    done += static_cast<std::size_t>(written);
  }
  mark_.bytes += static_cast<std::int64_t>(frame.size_bytes());
  mark_.checksum = files::hash_bytes(bytes, frame.size_bytes(), mark_.checksum);
}

FrameMark FrameFile::sync() {
  if (file_.number >= 0 && fdatasync(file_.number) != 0) fail(mark_.file);
  return mark_;
}

std::vector<double> FrameFile::reopen(const FrameMark& mark) {
  const fs::path path = checkpoint_.parent_path() / fs::path(mark.file).filename();
  const auto damaged = [&] {
    throw Error(ErrorKind::input, fmt::format("{} is not the file its checkpoint means, or damaged", path.string()));
  };
  std::error_code error;
  const auto size = mark.bytes == 0 ? 0 : fs::file_size(path, error);
  if (error || mark.bytes < 0 || mark.bytes % std::int64_t{sizeof(double)} != 0 ||
      size < static_cast<std::uintmax_t>(mark.bytes))
    damaged();
  std::vector<double> values(static_cast<std::size_t>(mark.bytes) / sizeof(double));
  std::ifstream in(path, std::ios::binary);
  if (mark.bytes > 0 && !in.read(reinterpret_cast<char*>(values.data()), mark.bytes)) damaged();
  if (files::hash_bytes(values.data(), values.size() * sizeof(double), empty_checksum()) != mark.checksum) damaged();
  mark_ = mark;
  return values;
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

}  // namespace dpde::tools
