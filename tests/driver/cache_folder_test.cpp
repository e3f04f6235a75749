// SPDX-License-Identifier: Apache-2.0
// The cache of compiled code: a stored entry is found intact or not at all, whatever happens to the files and whichever
// processes write.
#include "driver/memory/cache_folder.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>

#include "codegen/llvm/jit.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {
namespace {

namespace fs = std::filesystem;

class CacheFolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("cache_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::shared_ptr<codegen::CodeCache> open(std::uint64_t most_bytes = default_cache_bytes) const {
    return open_cache(folder_, most_bytes);
  }
  std::vector<fs::path> files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_)) files.push_back(entry.path());
    return files;
  }
  static std::string content(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  static void write(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }
  static void make_old(const fs::path& path, int hours) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::hours(hours));
  }

  fs::path folder_;
};

/// Code that identifies its key, to detect mixed entries.
std::string code_for(int key) {
  return std::string(2000 + 10 * key, static_cast<char>('a' + key % 26)) + std::to_string(key);
}

TEST_F(CacheFolderTest, FindsWhatWasStoredInAnotherCallToo) {
  EXPECT_EQ(open()->find("k"), std::nullopt);
  const std::string code("\0\1binary\xff", 10);
  open()->store("k", code);
  EXPECT_EQ(open()->find("k"), code);
  EXPECT_EQ(open()->find("K"), std::nullopt);
  EXPECT_EQ(open()->find(""), std::nullopt);
  open()->store("k", "newer");
  EXPECT_EQ(open()->find("k"), "newer");
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(CacheFolderTest, IsOnlyThisUsers) {
  open();
  EXPECT_EQ(fs::status(folder_).permissions(), fs::perms::owner_all);
}

/// On systems with a group per user the umask permits group writes.
TEST_F(CacheFolderTest, IsOnlyThisUsersWhateverTheUmask) {
  const mode_t before = ::umask(002);
  const auto cache = open_cache(folder_ / "above" / "cache");
  ::umask(before);
  EXPECT_NE(cache, nullptr);
  for (const fs::path& part : {folder_, folder_ / "above", folder_ / "above" / "cache"})
    EXPECT_EQ(fs::status(part).permissions(), fs::perms::owner_all) << part;
}

TEST_F(CacheFolderTest, ThrowsAwayEntriesWithAnyByteChanged) {
  open()->store("key", "some code");
  const fs::path file = files().at(0);
  const std::string whole = content(file);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string bytes = whole;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x10);
    write(file, bytes);
    EXPECT_EQ(open()->find("key"), std::nullopt) << i;
    EXPECT_FALSE(fs::exists(file)) << i;
  }
}

TEST_F(CacheFolderTest, ThrowsAwayEntriesOfAnotherLength) {
  open()->store("key", "some code");
  const fs::path file = files().at(0);
  const std::string whole = content(file);
  for (std::size_t size = 0; size < whole.size(); size += 3) {
    write(file, whole.substr(0, size));
    EXPECT_EQ(open()->find("key"), std::nullopt) << size;
    EXPECT_FALSE(fs::exists(file)) << size;
  }
  write(file, whole + "x");
  EXPECT_EQ(open()->find("key"), std::nullopt);
}

TEST_F(CacheFolderTest, TheOldestGoFirstAndUseMakesYoung) {
  const std::string code(10000, 'c');
  for (const char* key : {"a", "b", "c"}) open()->store(key, code);
  for (const fs::path& file : files()) make_old(file, 5);
  EXPECT_EQ(open()->find("a"), code);  // marks it as recently used
  open(25000)->store("d", code);       // room for two
  EXPECT_EQ(files().size(), 2u);
  EXPECT_EQ(open()->find("a"), code);
  EXPECT_EQ(open()->find("d"), code);
  EXPECT_EQ(open()->find("b"), std::nullopt);
  EXPECT_EQ(open()->find("c"), std::nullopt);
}

TEST_F(CacheFolderTest, WhatIsLargerThanAllIsNotKept) {
  open(5000)->store("small", "code");
  open(5000)->store("large", std::string(6000, 'c'));
  EXPECT_EQ(open()->find("small"), "code");
  EXPECT_EQ(open()->find("large"), std::nullopt);
}

TEST_F(CacheFolderTest, SweepsWhatKilledWritersLeft) {
  open();
  write(folder_ / "0123.code.tmp-1-0", "half");
  write(folder_ / "4567.code.tmp-2-0", "half");
  write(folder_ / "notes.txt", "not ours");
  make_old(folder_ / "0123.code.tmp-1-0", 2);
  make_old(folder_ / "notes.txt", 2);
  open()->store("k", "code");
  EXPECT_FALSE(fs::exists(folder_ / "0123.code.tmp-1-0"));
  EXPECT_TRUE(fs::exists(folder_ / "4567.code.tmp-2-0"));  // another process may be writing it
  EXPECT_TRUE(fs::exists(folder_ / "notes.txt"));
}

TEST_F(CacheFolderTest, AFolderThatCannotBeIsNoCache) {
  write(folder_, "a file");
  EXPECT_EQ(open(), nullptr);
  fs::remove(folder_);
}

/// Processes store, find and evict the same entries, and some are killed: none ever finds wrong code.
TEST_F(CacheFolderTest, ManyProcessesAndKills) {
  std::vector<pid_t> children;
  for (int p = 0; p < 6; ++p) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const auto cache = open(20000);
      for (int round = 0; round < (p < 3 ? 60 : 1000000); ++round) {
        const int key = (round * 7 + p) % 12;
        const std::optional<std::string> found = cache->find(std::to_string(key));
        if (found && *found != code_for(key)) _exit(1);
        cache->store(std::to_string(key), code_for(key));
      }
      _exit(0);
    }
    children.push_back(child);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  for (int p = 3; p < 6; ++p) kill(children[p], SIGKILL);
  for (int p = 0; p < 6; ++p) {
    int status = 0;
    waitpid(children[p], &status, 0);
    if (p < 3) {
      EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << p;
    }
    if (p >= 3 && WIFEXITED(status)) ADD_FAILURE() << "process " << p << " found wrong code";
  }
  for (int key = 0; key < 12; ++key) {
    const std::optional<std::string> found = open()->find(std::to_string(key));
    EXPECT_TRUE(!found || *found == code_for(key)) << key;
  }
}

constexpr const char* program_text = R"(kernel grow(u: field halo 0, out v: field, a: param) { v = a*u + 1 }
program step { run grow; swap u, v }
)";

class CountingCache : public codegen::CodeCache {
 public:
  std::optional<std::string> find(std::string_view key) override {
    const auto entry = entries.find(std::string(key));
    return entry == entries.end() ? std::nullopt : std::optional(entry->second);
  }
  void store(std::string_view key, std::string_view code) override { entries[std::string(key)] = code; }
  std::map<std::string, std::string> entries;
};

std::optional<Compiled> compile_with(std::shared_ptr<codegen::CodeCache> cache, Backend backend,
                                     const std::string& text) {
  const SourceFile source("t.dpde", text);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = backend;
  options.cache = std::move(cache);
  return compile(source, options, sink);
}

TEST(CodeCache, BackEndsTakeCodeOfTheSameContentOnly) {
  for (const Backend backend : {Backend::jit, Backend::cpp}) {
    const auto cache = std::make_shared<CountingCache>();
    EXPECT_FALSE(compile_with(cache, backend, program_text)->cached.is_from_cache);
    EXPECT_EQ(cache->entries.size(), 1u);
    const std::optional<Compiled> again = compile_with(cache, backend, program_text);
    EXPECT_TRUE(again->cached.is_from_cache);
    EXPECT_NE(again->program("step"), nullptr);
    std::string other = program_text;
    other.replace(other.find("+ 1"), 3, "+ 2");
    EXPECT_FALSE(compile_with(cache, backend, other)->cached.is_from_cache);
    EXPECT_EQ(cache->entries.size(), 2u);
  }
}

TEST(CodeCache, CodeThatDoesNotLoadIsMadeAnew) {
  for (const Backend backend : {Backend::jit, Backend::cpp}) {
    const auto cache = std::make_shared<CountingCache>();
    compile_with(cache, backend, program_text);
    for (auto& [key, code] : cache->entries) code = "no code at all";
    const std::optional<Compiled> again = compile_with(cache, backend, program_text);
    ASSERT_TRUE(again);
    EXPECT_FALSE(again->cached.is_from_cache);
    EXPECT_NE(again->program("step"), nullptr);
    EXPECT_TRUE(compile_with(cache, backend, program_text)->cached.is_from_cache);
  }
}

TEST(CodeCache, TellsProcessorsAndVectorWidthsApart) {
  EXPECT_NE(codegen::host_description().find("19."), std::string::npos);
  CountingCache cache;
  const std::optional<Compiled> compiled = compile_with(nullptr, Backend::interpreter, program_text);
  codegen::jit(compiled->loop, {.vector_width = 128}, &cache);
  EXPECT_FALSE(codegen::jit(compiled->loop, {.vector_width = 256}, &cache).from_cache);
  EXPECT_TRUE(codegen::jit(compiled->loop, {.vector_width = 128}, &cache).from_cache);
}

}  // namespace
}  // namespace dpde::driver
