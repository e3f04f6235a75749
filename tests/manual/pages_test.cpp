// SPDX-License-Identifier: Apache-2.0
// The README and the manual are run: each model is checked, each command made in a folder of the page's own, and what
// it prints compared with what the page shows. page.h says what pages may write.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <sstream>

#include "manual/page.h"

namespace dpde::testing {
namespace {

namespace fs = std::filesystem;

const fs::path root = DPDE_SOURCE_DIR;

#ifdef __SANITIZE_ADDRESS__
constexpr bool is_sanitized = true;
#else
constexpr bool is_sanitized = false;
#endif

std::vector<fs::path> manual() {
  std::vector<fs::path> pages{root / "README.md", root / "dsl-examples/README.md"};
  for (const auto& entry : fs::directory_iterator(root / "dsl-examples/manual")) {
    if (entry.path().extension() == ".md") pages.push_back(entry.path());
  }
  std::sort(pages.begin(), pages.end());
  return pages;
}

/// The file with the snippet beside or in the place of its first line that holds what the page says.
std::string changed(const fs::path& file, const Snippet& snippet) {
  std::string result;
  bool is_done = snippet.change == "append";
  for (const std::string& line : lines_of(file)) {
    const bool is_it = !is_done && line.find(snippet.beside) != std::string::npos;
    if (!is_it || snippet.change == "insert") result += line + "\n";
    if (is_it) result += snippet.text;
    is_done = is_done || is_it;
  }
  EXPECT_TRUE(is_done) << file << " has no line with " << snippet.beside;
  return snippet.change == "append" ? result + snippet.text : result;
}

/// What to check of a text: nothing named, which is all tasks, and where there is none each scene.
std::vector<std::string> checked_names(const std::string& text) {
  static const std::regex scene(R"(\bscene (\w+)\s*[:=])"), task(R"(\btask \w+\s*:)");
  if (std::regex_search(text, task)) return {""};
  std::vector<std::string> names;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), scene); match != std::sregex_iterator(); ++match)
    names.push_back((*match)[1]);
  EXPECT_FALSE(names.empty()) << text;
  return names;
}

class Manual : public ::testing::TestWithParam<fs::path> {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::create_directory_symlink(root / "dsl-examples", folder_ / "dsl-examples");
  }
  void TearDown() override {
    if (!HasFailure()) fs::remove_all(folder_);
  }

  std::string place(const Snippet& snippet) const {
    return fs::relative(GetParam(), root).string() + ":" + std::to_string(snippet.line);
  }
  /// Runs a shell command in the page's folder: its exit status and what it prints.
  std::pair<int, std::vector<std::string>> shell(const std::string& command) const {
    const fs::path script = folder_ / ".command", output = folder_ / ".output";
    std::ofstream(script) << "cd '" << folder_.string()
                          << "'\nexport DPDE_CACHE=.cache PATH='" DPDE_BINARY_DIR "/bin':$PATH\n"
                          << command << "\n";
    const int status = std::system(("sh '" + script.string() + "' >'" + output.string() + "' 2>&1 </dev/null").c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), lines_of(output)};
  }
  static std::string joined(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
  }

  /// What a snippet stands for, as the comment before it says.
  std::string whole(const Snippet& snippet) const {
    if (!snippet.change.empty()) return changed(folder_ / snippet.file, snippet);
    if (snippet.as.empty()) return snippet.text;
    const std::size_t at = snippet.as.find("@@");
    EXPECT_NE(at, std::string::npos) << place(snippet);
    return snippet.as.substr(0, at) + snippet.text + snippet.as.substr(std::min(at + 2, snippet.as.size()));
  }

  void check_model(const Snippet& snippet) const {
    std::string name = snippet.name.empty() ? "line_" + std::to_string(snippet.line) + ".dpde" : snippet.name;
    if (!snippet.change.empty()) name = snippet.file;
    const std::string text = whole(snippet);
    std::ofstream(folder_ / name) << text;
    for (const std::string& scene : checked_names(text)) {
      // What stands in a frame that the page does not show is lowered only, which is quick.
      const std::string verb = snippet.as.empty() ? "check "
                               : scene.empty()    ? "emit --stage adjoint "
                                                  : "emit --stage stencil ";
      const auto [status, printed] = shell("dpde " + verb + name + " " + scene);
      EXPECT_EQ(status, snippet.status) << place(snippet) << "\n" << joined(printed);
    }
  }

  void check_commands(const Snippet& snippet) const {
    const bool is_quick = !snippet.quick.empty() && !std::getenv("DPDE_THOROUGH");
    ASSERT_FALSE(commands_of(snippet).empty()) << place(snippet);
    for (const Command& command : commands_of(snippet)) {
      const std::size_t comment = command.line.find("  # ");
      const std::string line = command.line.substr(0, comment) + (is_quick ? " " + snippet.quick : "");
      const auto [status, printed] = shell(line);
      EXPECT_EQ(status, snippet.status) << place(snippet) << ": " << line << "\n" << joined(printed);
      if (is_quick || !snippet.is_compared || command.prints.empty()) continue;
      EXPECT_EQ(missing_line(command.prints, printed), "") << place(snippet) << ": " << line << "\n" << joined(printed);
    }
  }

  /// Programs are run, parts of programs compiled.
  void check_cpp(const Snippet& snippet) const {
    const std::string text = whole(snippet);
    std::ofstream(folder_ / "snippet.cpp") << text;
    const std::string source = root.string();
    std::string command = "${CXX:-c++} -std=c++20 -I '" + source + "/compiler/include' -I '" + source +
                          "/runtime/include' -I '" + source + "/runtime/abi' snippet.cpp";
    if (text.find("int main(") == std::string::npos || is_sanitized)
      command += " -fsyntax-only";
    else
      command += " -o snippet '" DPDE_BINARY_DIR "/compiler/libdpde.so' '" DPDE_BINARY_DIR
                 "/runtime/libdpde_runtime.a' -Wl,-rpath,'" DPDE_BINARY_DIR "/compiler' && ./snippet";
    const auto [status, printed] = shell(command);
    EXPECT_EQ(status, 0) << place(snippet) << "\n" << joined(printed);
  }

  /// These lines are tested where they stand in a shipped project (hosts/installed.cmake), programs by their names.
  void check_is_shipped(const Snippet& snippet) const {
    const std::string shipped = joined(lines_of(root / "dsl-examples/hosts/CMakeLists.txt"));
    std::stringstream in(snippet.text);
    for (std::string line; std::getline(in, line);) {
      line = line.substr(0, line.find(" #"));
      line.erase(line.find_last_not_of(' ') + 1);
      EXPECT_NE(shipped.find(line), std::string::npos) << place(snippet) << ": " << line;
    }
  }
  void check_programs_exist(const Snippet& snippet) const {
    std::stringstream in(snippet.text);
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with("tools/"))
        EXPECT_TRUE(fs::exists(root / line.substr(0, line.find(' ')))) << place(snippet) << ": " << line;
    }
  }

 private:
  static std::string own_name() {
    std::string name = fs::relative(GetParam(), root).string();
    std::ranges::replace(name, '/', '_');
    return "dpde_page_" + name;
  }
  fs::path folder_ = fs::path(::testing::TempDir()) / own_name();
};

TEST_P(Manual, SnippetsAreWhatTheySay) {
  const std::set<std::string> tested_elsewhere{"python", "c", "fortran", "text"};  // python/pages_test.py
  for (const Snippet& snippet : snippets_of(GetParam())) {
    if (snippet.language == "dpde")
      check_model(snippet);
    else if (snippet.language == "console")
      check_commands(snippet);
    else if (snippet.language == "cpp")
      check_cpp(snippet);
    else if (snippet.language == "cmake")
      check_is_shipped(snippet);
    else if (snippet.language == "sh")
      check_programs_exist(snippet);
    else
      EXPECT_TRUE(tested_elsewhere.contains(snippet.language)) << place(snippet) << ": what is ```" << snippet.language;
  }
}

INSTANTIATE_TEST_SUITE_P(Pages, Manual, ::testing::ValuesIn(manual()), [](const auto& info) {
  std::string name = fs::relative(info.param, root).replace_extension().string();
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
});

TEST(ManualPages, BeginWithAnExample) {
  for (const fs::path& page : manual()) {
    if (page.parent_path().filename() != "manual" || page.filename() == "tutorial.md") continue;
    const std::vector<Snippet> snippets = snippets_of(page);
    EXPECT_TRUE(!snippets.empty() && snippets.front().leads) << page << " begins with rules";
  }
}

/// The pages of the examples name files, and what stands in them; AllTasksAndScenesAreCertified runs those.
TEST(ManualPages, ExamplesNameWhatThereIs) {
  const std::regex command(R"(^(?:\$ )?dpde \w+ (dsl-examples/[\w/]+\.dpde)(?: +(\w+))?)");
  int found = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root / "dsl-examples")) {
    if (entry.path().extension() != ".md") continue;
    for (const std::string& line : lines_of(entry.path())) {
      std::smatch match;
      if (!std::regex_search(line, match, command)) continue;
      ++found;
      std::stringstream text;
      text << std::ifstream(root / match[1].str()).rdbuf();
      const std::regex block("(scene|task|dataset|chart) " + match[2].str() + "\\b");
      EXPECT_TRUE(!match[2].matched || std::regex_search(text.str(), block)) << entry.path() << ": " << line;
    }
  }
  EXPECT_GT(found, 50);
}

/// Those of other languages have none.
TEST(ManualPages, GalleryShowsEachExample) {
  const std::set<std::string> without_picture{"hosts", "python", "manual"};
  std::string gallery;
  for (const std::string& line : lines_of(root / "dsl-examples/README.md")) gallery += line + "\n";
  for (const auto& entry : fs::directory_iterator(root / "dsl-examples")) {
    const std::string name = entry.path().filename();
    if (!entry.is_directory() || without_picture.contains(name)) continue;
    EXPECT_NE(gallery.find("<img src=\"" + name + "/"), std::string::npos) << name;
  }
}

TEST(ManualPages, ShownAndPrintedAreCompared) {
  EXPECT_TRUE(is_shown("rod: 64 cells in 262 us (501 M points/s)", "rod: 64  cells in 1.2 ms (2.01 G points/s)"));
  EXPECT_TRUE(is_shown("loss ... after 8.0e-14", "loss 3 after 7e-15"));
  EXPECT_TRUE(is_shown("k = 0.15", "k = 0.1501"));
  EXPECT_FALSE(is_shown("k = 0.15", "k = 0.16"));
  EXPECT_FALSE(is_shown("k = 0.15", "k = -0.15"));
  EXPECT_FALSE(is_shown("k = 0.15", "kappa = 0.15"));
  EXPECT_EQ(missing_line({"a", "...", "c"}, {"a", "b", "b", "c"}), "");
  EXPECT_EQ(missing_line({"a", "c"}, {"a", "b", "c"}), "c");
  EXPECT_NE(missing_line({"a"}, {"a", "b"}), "");
}

}  // namespace
}  // namespace dpde::testing
