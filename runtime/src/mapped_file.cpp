// SPDX-License-Identifier: Apache-2.0
// Memory that lies in a file, for checkpoints that are more than the machine's memory holds.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "aligned_memory.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace {

[[noreturn]] void fail(const std::string& folder, int64_t bytes, int reason) {
  throw Error(ErrorKind::machine, fmt::format("the folder {} cannot hold checkpoints of {} bytes: {}", folder, bytes,
                                              std::strerror(reason)));
}

/// A file without a name: where the system knows none it loses its name at once.
int open_nameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return file;
  std::string name = folder + "/dpde_checkpoints_XXXXXX";
  const int named = ::mkstemp(name.data());
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

char* map_file(const std::string& folder, int64_t bytes) {
  const int file = open_nameless(folder);
  if (file < 0) fail(folder, bytes, errno);
  int reason = ::posix_fallocate(file, 0, bytes);  // or else the first write to a full disk would kill the process
  void* memory = MAP_FAILED;
  if (reason == 0) {
    memory = ::mmap(nullptr, static_cast<size_t>(bytes), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) reason = errno;
  }
  ::close(file);
  if (reason != 0) fail(folder, bytes, reason);
  return static_cast<char*>(memory);
}

void unmap_file(char* memory, int64_t bytes) { ::munmap(memory, static_cast<size_t>(bytes)); }

}  // namespace dpde
