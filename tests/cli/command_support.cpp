// SPDX-License-Identifier: Apache-2.0
#include "command_support.h"

#include <cstdio>
#include <memory>

#include "run_command.h"

namespace dpde::testing {

namespace {

/// The words of a shell's command line; nullopt if it contains more than words.
std::optional<std::vector<std::string>> words_of(const std::string& line) {
  std::vector<std::string> words;
  bool is_inside = false;  // of a word
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '\'' || c == '"') {
      const std::size_t end = line.find(c, i + 1);
      if (end == std::string::npos) return std::nullopt;
      const std::string quoted = line.substr(i + 1, end - i - 1);
      if (c == '"' && quoted.find_first_of("$`\\") != std::string::npos) return std::nullopt;
      if (!is_inside) words.emplace_back();
      is_inside = true;
      words.back() += quoted;
      i = end;
    } else if (c == ' ') {
      is_inside = false;
    } else if (std::string_view("|&;<>()$`\\*?[#~\n").find(c) != std::string_view::npos) {
      return std::nullopt;
    } else {
      if (!is_inside) words.emplace_back();
      is_inside = true;
      words.back() += c;
    }
  }
  return words;
}

/// A stream into memory.
class Heard {
 public:
  Heard() : stream_(open_memstream(&text_, &size_)) {}
  ~Heard() {
    std::fclose(stream_);
    std::free(text_);
  }
  Heard(const Heard&) = delete;
  Heard& operator=(const Heard&) = delete;

  std::FILE* stream() const { return stream_; }
  std::string text() const {
    std::fflush(stream_);
    return {text_, size_};
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* stream_;
};

/// Changes to a folder and back.
class In {
 public:
  explicit In(const fs::path& folder) : before_(fs::current_path()) { fs::current_path(folder); }
  ~In() { fs::current_path(before_); }
  In(const In&) = delete;
  In& operator=(const In&) = delete;

 private:
  fs::path before_;
};

/// The cache folder of this process.
class CacheFolder : public ::testing::Environment {
 public:
  void SetUp() override {
    fs::create_directories(folder_);
    fs::permissions(folder_, fs::perms::owner_all);
    setenv("DPDE_CACHE", folder_.c_str(), 1);
  }
  void TearDown() override { fs::remove_all(folder_); }

 private:
  fs::path folder_ = fs::path(::testing::TempDir()) / ("dpde_cache_" + std::to_string(getpid()));
};

const ::testing::Environment* const cache_folder = ::testing::AddGlobalTestEnvironment(new CacheFolder);

}  // namespace

Outcome Command::dpde(const std::string& arguments) const {
  const std::optional<std::vector<std::string>> words = words_of(arguments);
  if (!words) return process(arguments);
  const In folder(path("."));
  const Heard out, err;
  const int status = tools::run_command(*words, {out.stream(), err.stream()});
  return {status, out.text(), err.text()};
}

}  // namespace dpde::testing
