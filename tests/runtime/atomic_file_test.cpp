// SPDX-License-Identifier: Apache-2.0
// Files are complete or absent, even if the disk is full.
#include "dpde/runtime/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string content(const fs::path& path) const {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  size_t file_count() const { return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {})); }
  std::string failure(const fs::path& path, std::string_view text) const {
    try {
      write_file_atomically(path, text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::machine);
      return error.what();
    }
    return "";
  }
  fs::path folder_;
};

TEST_F(AtomicFile, WritesAndReplaces) {
  const fs::path path = folder_ / "a.txt";
  write_file_atomically(path, {"one ", "", "two"});
  EXPECT_EQ(content(path), "one two");
  chmod(path.c_str(), 0640);
  write_file_atomically(path, "three");
  EXPECT_EQ(content(path), "three");
  EXPECT_EQ(static_cast<unsigned>(fs::status(path).permissions()), 0640u);
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(AtomicFile, FollowsLinks) {
  write_file_atomically(folder_ / "target", "old");
  fs::create_symlink("target", folder_ / "link");
  write_file_atomically(folder_ / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(content(folder_ / "target"), "new");
}

TEST_F(AtomicFile, SaysWhyItCannot) {
  EXPECT_EQ(failure("/nowhere/a.txt", "x"), "cannot write /nowhere/a.txt: No such file or directory");
  EXPECT_EQ(failure(folder_, "x"), "cannot write " + folder_.string() + ": Is a directory");
  EXPECT_EQ(failure("/dev/full", "x"), "cannot write /dev/full: No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(AtomicFile, AFullDiskLeavesTheOldFileAndNothingElse) {
  const fs::path path = folder_ / "a.txt";
  write_file_atomically(path, "old");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  const std::string why = failure(path, std::string(5000, 'x'));
  const std::string new_file = failure(folder_ / "b.txt", std::string(5000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(why, "cannot write " + path.string() + ": File too large");
  EXPECT_NE(new_file, "");
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(file_count(), 1u);
}

/// A process is killed while it writes.
TEST_F(AtomicFile, AKillLeavesTheOldFileAndNothingElse) {
  const int probe = open(folder_.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0600);
  if (probe < 0) GTEST_SKIP() << folder_ << " is on a file system without nameless files: a temporary name may stay";
  close(probe);
  const fs::path path = folder_ / "a.txt";
  write_file_atomically(path, "old");
  const std::string content(256 << 20, 'x');
  int told[2];
  ASSERT_EQ(pipe(told), 0);
  const pid_t child = fork();
  if (child == 0) {
    const char begins = 1;
    if (write(told[1], &begins, 1) != 1) _exit(2);
    write_file_atomically(path, content);
    _exit(0);
  }
  char begun = 0;
  ASSERT_EQ(read(told[0], &begun, 1), 1);
  usleep(20000);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  close(told[0]);
  close(told[1]);
  EXPECT_TRUE(WIFSIGNALED(status)) << "it was done before it was killed: nothing was tested";
  EXPECT_EQ(this->content(path), "old");
  EXPECT_EQ(file_count(), 1u);
}

}  // namespace
}  // namespace dpde
