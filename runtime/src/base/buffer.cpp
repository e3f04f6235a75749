// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/buffer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "base/aligned_memory.h"
#include "dpde/runtime/allocation.h"
#include "dpde/runtime/error.h"

namespace dpde {
namespace {

constexpr int64_t huge_page_bytes = 2 << 20, least_huge_bytes = 2 * huge_page_bytes;

int64_t physical_bytes() { return int64_t{sysconf(_SC_PHYS_PAGES)} * sysconf(_SC_PAGESIZE); }

/// Maps huge pages. Null on failure. `bytes`: a multiple of the huge page size.
char* map_huge(int64_t bytes) {
  const auto size = static_cast<size_t>(bytes), more = static_cast<size_t>(huge_page_bytes);
  void* const all = ::mmap(nullptr, size + more, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (all == MAP_FAILED) return nullptr;
  char* const begin = static_cast<char*>(all);
  const size_t before = (more - reinterpret_cast<uintptr_t>(begin) % more) % more;
  if (before > 0) ::munmap(begin, before);
  ::munmap(begin + before + size, more - before);
  // Huge pages need fewer page table entries: factor 1.1 for sweeps over 4096^2, 1.2 for RK4 at 1024^2. Only a hint: it
  // may fail.
  ::madvise(begin + before, size, MADV_HUGEPAGE);
  return begin + before;
}

/// `bytes`: `wanted` rounded up to whole pages.
char* allocate(int64_t bytes, int64_t wanted) {
  const int64_t alignment = wanted > page_bytes ? page_bytes : line_bytes;
  void* const memory = std::aligned_alloc(static_cast<size_t>(alignment), static_cast<size_t>(bytes));
  if (memory != nullptr) std::memset(memory, 0, static_cast<size_t>(bytes));
  return static_cast<char*>(memory);
}

[[noreturn]] void fail(const std::string& folder, int64_t bytes, int reason) {
  throw Error(ErrorKind::machine, fmt::format("the folder {} cannot hold checkpoints of {} bytes: {}", folder, bytes,
                                              std::strerror(reason)));
}

/// Opens a file without a name; on systems without such files its name is removed immediately.
int open_nameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR)) return file;
  std::string name = folder + "/dpde_checkpoints_XXXXXX";
  const int named = ::mkstemp(name.data());
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

void Buffer::Release::operator()(char* memory) const {
  if (mapped > 0) {
    ::munmap(memory, static_cast<size_t>(mapped));
  } else {
    std::free(memory);
  }
}

int64_t allocated_bytes(int64_t wanted) {
  const int64_t whole = wanted >= least_huge_bytes ? huge_page_bytes : page_bytes;
  return (wanted + whole - 1) / whole * whole;
}

Buffer::Buffer(int64_t wanted) {
  const int64_t bytes = allocated_bytes(wanted);
  const bool is_mapped = wanted >= least_huge_bytes;
  // Linux may grant more memory than there is and kill the process later: refuse sizes that can never fit.
  char* const memory = bytes > physical_bytes() ? nullptr : is_mapped ? map_huge(bytes) : allocate(bytes, wanted);
  if (memory == nullptr) throw Error(ErrorKind::machine, fmt::format("there is no memory for {} bytes", bytes));
  memory_ = std::unique_ptr<char, Release>(memory, Release(is_mapped ? bytes : 0));
}

void Buffer::touch() const {
  for (int64_t at = 0; at < memory_.get_deleter().mapped; at += page_bytes) {
    volatile char& first_of_page = memory_.get()[at];
    first_of_page = first_of_page;
  }
}

Buffer::Buffer(const std::string& folder, int64_t bytes) {
  const int file = open_nameless(folder);
  if (file < 0) fail(folder, bytes, errno);
  int reason = ::posix_fallocate(file, 0, bytes);  // otherwise the first write to a full disk would kill the process
  void* memory = MAP_FAILED;
  if (reason == 0) {
    memory = ::mmap(nullptr, static_cast<size_t>(bytes), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    if (memory == MAP_FAILED) reason = errno;
  }
  ::close(file);
  if (reason != 0) fail(folder, bytes, reason);
  memory_ = std::unique_ptr<char, Release>(static_cast<char*>(memory), Release(bytes));
}

}  // namespace dpde
