// SPDX-License-Identifier: Apache-2.0
// Counts all allocations of the program, and tests the counter.
#include "allocations.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>

namespace {

std::atomic<long>& counter() {
  static std::atomic<long> count{0};
  return count;
}

}  // namespace

// Not inlined: otherwise g++ sees malloc and delete in one place and warns.
[[gnu::noinline]] void* operator new(size_t size) {
  ++counter();
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(size_t size, const std::nothrow_t&) noexcept {
  ++counter();
  return std::malloc(size);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }

namespace dpde::test {

long allocations() { return counter(); }

TEST(Allocations, AreCounted) {
  const long before = allocations();
  const auto one = std::make_unique<double>(1);
  EXPECT_EQ(allocations(), before + 1) << one.get();
}

}  // namespace dpde::test
