// SPDX-License-Identifier: Apache-2.0
// The rules of the house that a machine can check: direction of includes, sizes, headers of files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path root = DPDE_SOURCE_DIR;

std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<fs::path> sources(const std::vector<std::string>& folders) {
  std::vector<fs::path> result;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const std::string extension = entry.path().extension();
      if (extension == ".cpp" || extension == ".h") result.push_back(entry.path());
    }
  }
  return result;
}

const std::vector<std::string> everything{"compiler", "runtime", "tools", "tests", "dsl-examples"};

/// Folder of compiler/src -> the folders it may include, itself aside. An arrow means "may include"; nothing else is.
const std::map<std::string, std::set<std::string>> allowed_includes{
    {"support", {}},
    {"network", {"support"}},
    {"source", {"support"}},
    {"syntax", {"support", "source"}},
    {"model", {"support", "network", "source", "syntax"}},
    {"stencil", {"support", "network", "source", "syntax", "model"}},
    {"adjoint", {"support", "network", "source", "stencil"}},
    {"loop", {"support", "network", "source", "stencil"}},
    {"codegen", {"support", "network", "source", "loop", "dpde"}},
    {"codegen/cpp", {"support", "source", "loop", "codegen", "dpde"}},
    {"codegen/llvm", {"support", "source", "loop", "codegen", "dpde"}},
    {"codegen/no_llvm", {"support", "source", "loop", "codegen", "codegen/cpp", "codegen/llvm", "dpde"}},
    {"files", {"support", "network", "source", "syntax", "model", "codegen", "dpde"}},
    {"driver",
     {"support", "network", "source", "syntax", "model", "stencil", "adjoint", "loop", "codegen", "codegen/cpp",
      "codegen/llvm", "files", "dpde"}},
    {"stability", {"support", "source", "model", "stencil", "adjoint", "codegen", "codegen/llvm", "driver", "dpde"}},
    {"chart", {"support", "source", "model", "files", "driver", "stability", "dpde"}},
    {"plot", {"support", "source", "model", "files", "driver", "chart", "dpde"}},
    {"analysis",
     {"support", "network", "source", "model", "stencil", "adjoint", "loop", "codegen", "codegen/llvm", "files",
      "driver", "stability", "dpde"}},
    {"training",
     {"support", "network", "source", "syntax", "model", "stencil", "adjoint", "codegen", "files", "driver", "analysis",
      "chart", "dpde"}},
    {"report",
     {"support", "source", "model", "stencil", "files", "driver", "stability", "chart", "plot", "analysis", "training",
      "dpde"}},
    {"host", {"support", "source", "syntax", "model", "files", "driver", "stability", "plot", "analysis", "dpde"}},
};

/// "stencil/passes" belongs to the layer stencil, "codegen/llvm" is one of its own.
std::string layer_of(const std::string& folder) {
  if (allowed_includes.contains(folder)) return folder;
  return folder.substr(0, folder.find('/'));
}

TEST(House, IncludesPointDownwards) {
  const std::regex include(R"re(^#include "([a-z_/]+)/[a-z_0-9]+\.h")re");
  int checked = 0;
  for (const fs::path& path : sources({"compiler/src"})) {
    const std::string layer = layer_of(fs::relative(path.parent_path(), root / "compiler/src").generic_string());
    ASSERT_TRUE(allowed_includes.contains(layer)) << path << ": a folder the house does not know";
    for (const std::string& line : read_lines(path)) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      const std::string other = layer_of(match[1]);
      ++checked;
      EXPECT_TRUE(other == layer || allowed_includes.at(layer).contains(other)) << path << ": " << line;
    }
  }
  EXPECT_GT(checked, 100);
  for (const auto& [folder, others] : allowed_includes) {
    EXPECT_TRUE(fs::is_directory(root / "compiler/src" / folder))
        << folder << ": a rule for a folder that is not there";
  }
}

/// Analyses know every kind of statement: they ask stencil/analyse/effects.h or match() over all kinds, naming each;
/// who is after what one kind has says so by the walks of support/walk.h, match_some() or is_one_of(). Below the model
/// level these names mean statements; expressions of models and networks have others of the same names.
TEST(House, StatementsAreClosed) {
  const std::regex one_kind(
      R"((get_if|holds_alternative|std::get)<(const )?(stencil::|loop::)?(Fill|Fold|Reduce|NetworkCall|Run|Sweep|Transform|Solve|Repeat)>)");
  const std::regex of_model(R"(<(const )?model::)");
  const std::map<std::string, std::string> exceptions{
      {"stencil/space/apply.cpp", "looks for a call that is there already, among what is made before a kernel"},
      {"stencil/space/discretise_operands.cpp", "the same of a reduction"},
      {"stencil/space/discretise_waves.cpp", "the same of a transform"},
      {"stencil/passes/dead_code.cpp", "a step of Newton's method is a solve, always"},
      {"loop/from_stencil.cpp", "the same"},
      {"codegen/program_table.cpp", "the same"},
      {"loop/schedule.cpp", "moves fills into sweeps and leaves all else where it is"}};
  std::set<std::string> unused;
  for (const auto& [file, reason] : exceptions) unused.insert(file);
  int checked = 0;
  for (const fs::path& path : sources({"compiler/src", "tools"})) {
    const std::string name = fs::relative(path, root / "compiler/src").generic_string();
    if (name.starts_with("model/") || name.starts_with("syntax/")) continue;  // which know no statement of programs
    ++checked;
    for (const std::string& line : read_lines(path)) {
      if (!std::regex_search(line, one_kind) || std::regex_search(line, of_model)) continue;
      unused.erase(name);
      EXPECT_TRUE(exceptions.contains(name)) << name << ": " << line;
    }
  }
  EXPECT_TRUE(unused.empty()) << *unused.begin() << " is an exception, and none is needed";
  EXPECT_GT(checked, 200);
}

/// What stands in the text behind `open` ( up to its ).
/// The arguments of the call whose bracket opens there.
std::vector<std::string> arguments_of(const std::string& text, std::size_t open) {
  std::vector<std::string> arguments(1);
  int depth = 1;
  for (std::size_t at = open + 1; at < text.size(); ++at) {
    const char c = text[at];
    depth += (c == '(' || c == '[' || c == '{') - (c == ')' || c == ']' || c == '}');
    if (depth == 0) break;
    if (depth == 1 && c == ',')
      arguments.emplace_back();
    else
      arguments.back() += c;
  }
  return arguments;
}

/// match() would compile with a kind that is added. Where most kinds are nothing to a place that is match_some(), or a
/// case of several kinds, all named.
TEST(House, MatchesHaveNoCaseForAnyKind) {
  const std::regex any_kind(R"(^\s*\[[^\]]*\]\((const )?auto& *\w*\))");
  std::set<std::string> used;
  const std::map<std::string, std::string> exceptions{
      {"model/from_ast/network/network_layers.cpp", "other lines are an error, or for others"},
      {"plot/picture.cpp", "what is done with each kind of panel is overloaded"},
      {"../../tools/dpde/lsp/declared_names.cpp", "most kinds of declarations have a name and items"}};
  for (const fs::path& path : sources({"compiler/src", "tools"})) {
    std::string text;
    for (const std::string& line : read_lines(path)) text += line + '\n';
    const std::string name = fs::relative(path, root / "compiler/src").generic_string();
    for (std::size_t at = text.find(" match("); at != std::string::npos; at = text.find(" match(", at + 1)) {
      if (std::ranges::none_of(arguments_of(text, at + 6), [&](const std::string& argument) {
            return std::regex_search(argument, any_kind, std::regex_constants::match_continuous);
          }))
        continue;
      EXPECT_TRUE(exceptions.contains(name)) << name << ": " << text.substr(at, text.find('\n', at) - at);
      used.insert(name);
    }
  }
  for (const auto& [name, why] : exceptions) EXPECT_TRUE(used.contains(name)) << name << " needs no exception";
}

std::size_t indent_of(const std::string& line) { return line.find_first_not_of(' '); }

/// The label of a case of the switch in which `default:` stands in this line: one as far to the right, above or below.
std::string label_beside(const std::vector<std::string>& lines, std::size_t at) {
  const std::size_t indent = indent_of(lines[at]);
  const std::regex label(R"(^ *case ([^ ]+):.*)");
  std::smatch match;
  for (std::size_t i = at; i-- > 0 && (indent_of(lines[i]) == std::string::npos || indent_of(lines[i]) >= indent);) {
    if (indent_of(lines[i]) == indent && std::regex_match(lines[i], match, label)) return match[1];
  }
  return "";
}

/// A switch over an enumeration of ours names all of it, so that a new one does not compile until each says what it
/// does. Numbers that come from outside, of the ABI and of bytes, may be any.
TEST(House, SwitchesOverOurEnumerationsAreClosed) {
  const std::regex from_outside(R"(^(DPDE_[A-Z_0-9]+|[A-Z_]*[a-z_]*DPDE_.*|'.*|[0-9].*)$)"), open(R"(^\s*default:.*)");
  int checked = 0;
  for (const fs::path& path : sources({"compiler", "runtime", "tools"})) {
    const std::vector<std::string> lines = read_lines(path);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!std::regex_match(lines[i], open)) continue;
      ++checked;
      EXPECT_TRUE(std::regex_match(label_beside(lines, i), from_outside))
          << path << ":" << i + 1 << ": name the others beside " << label_beside(lines, i);
    }
  }
  EXPECT_GT(checked, 5);
}

/// A loop over an enumeration ends with its last enumerator: `i <= static_cast<int>(E::last)` or names_up_to(E::last).
/// Otherwise one that is added behind would not be found by its name.
TEST(House, LoopsOverEnumerationsReachTheirEnds) {
  const std::regex loop(R"((?:<= static_cast<int>|names_up_to)\(([A-Z]\w*)::(\w+)\))"),
      enumeration(R"(enum class ([A-Z]\w*)[^{;]*\{([^}]*)\})"), last(R"((\w+),?\s*$)");
  std::map<std::string, std::string> ends;
  for (const fs::path& path : sources({"compiler/src/support"})) {
    std::string text;
    for (const std::string& line : read_lines(path)) text += line + '\n';
    for (std::sregex_iterator found(text.begin(), text.end(), enumeration), end; found != end; ++found) {
      const std::string body = (*found)[2];
      if (std::smatch match; std::regex_search(body, match, last)) ends[(*found)[1]] = match[1];
    }
  }
  int checked = 0;
  for (const fs::path& path : sources({"compiler", "runtime", "tools", "tests"})) {
    for (const std::string& line : read_lines(path)) {
      std::smatch match;
      if (!std::regex_search(line, match, loop) || !ends.contains(match[1])) continue;
      if (match[1] == "BinaryOp") continue;  // a part of the operators
      ++checked;
      EXPECT_EQ(match[2], ends[match[1]]) << path << ": " << line;
    }
  }
  EXPECT_GT(checked, 5);
}

/// The headers of compiler/src that a file includes, directly or through others.
class Includes {
 public:
  const std::set<std::string>& of(const std::string& file) {
    const auto [entry, is_new] = reached_.try_emplace(file);
    if (!is_new) return entry->second;
    std::set<std::string> found;
    for (const std::string& line : read_lines(source_ / file)) {
      std::smatch match;
      if (!std::regex_search(line, match, include_) || !fs::exists(source_ / match[1].str())) continue;
      found.insert(match[1]);
      found.merge(std::set<std::string>(of(match[1])));
    }
    return reached_[file] = found;
  }

 private:
  const fs::path source_ = root / "compiler/src";
  const std::regex include_{R"re(^#include "([^"]+)")re"};
  std::map<std::string, std::set<std::string>> reached_;
};

struct Level {
  std::string folder;
  std::vector<std::string> above;
  std::vector<std::string> conversion;  // folders of the conversion into this level, beside files called from_*
};

/// The result of a conversion, its passes, printers and verifiers know their own level alone.
const std::vector<Level> levels{
    {"syntax", {"model/", "stencil/", "loop/"}, {}},
    {"model", {"syntax/"}, {}},
    {"stencil", {"syntax/", "model/"}, {"stencil/lower/", "stencil/space/", "stencil/time/"}},
    {"loop", {"stencil/"}, {}},
};

TEST(House, OnlyConversionsSeeTwoLevels) {
  Includes includes;
  for (const Level& level : levels) {
    for (const fs::path& path : sources({"compiler/src/" + level.folder})) {
      const std::string file = fs::relative(path, root / "compiler/src").generic_string();
      const std::set<std::string>& reached = includes.of(file);
      const bool sees = std::any_of(reached.begin(), reached.end(), [&](const std::string& header) {
        return std::any_of(level.above.begin(), level.above.end(),
                           [&](const std::string& above) { return header.starts_with(above); });
      });
      if (!sees) continue;
      const bool converts =
          file.find("from_") != std::string::npos ||
          std::ranges::any_of(level.conversion, [&](const std::string& folder) { return file.starts_with(folder); });
      EXPECT_TRUE(converts) << file << " sees the level above and is no part of a conversion";
    }
  }
}

TEST(House, LlvmHeadersStayInOneFolder) {
  int found = 0;
  for (const fs::path& path : sources({"compiler", "runtime", "tools"})) {
    for (const std::string& line : read_lines(path)) {
      if (!line.starts_with("#include <llvm/") && !line.starts_with("#include \"llvm/")) continue;
      ++found;
      EXPECT_NE(path.generic_string().find("codegen/llvm/"), std::string::npos) << path << ": " << line;
    }
  }
  EXPECT_GT(found, 0);
}

TEST(House, RuntimeKnowsNothingOfTheCompiler) {
  const std::regex system(R"re(^#include <.*>)re"), own(R"re(^#include "([^"]+)")re");
  const fs::path runtime = root / "runtime";
  for (const fs::path& path : sources({"runtime"})) {
    for (const std::string& line : read_lines(path)) {
      if (!line.starts_with("#include") || std::regex_search(line, system)) continue;
      std::smatch header;
      ASSERT_TRUE(std::regex_search(line, header, own)) << path << ": " << line;
      const bool is_of_runtime =
          std::ranges::any_of(std::vector{runtime / "src", runtime / "abi", runtime / "include"},
                              [&](const fs::path& in) { return fs::exists(in / header[1].str()); });
      EXPECT_TRUE(is_of_runtime || fs::exists(path.parent_path() / header[1].str())) << path << ": " << line;
    }
  }
}

TEST(House, PublicHeadersShowNothingOfTheCompiler) {
  const std::regex allowed(R"re(^#include (<[a-z_]+(\.h)?>|"dpde/runtime/.*"))re");
  for (const fs::path& path : sources({"compiler/include"})) {
    for (const std::string& line : read_lines(path)) {
      EXPECT_TRUE(!line.starts_with("#include") || std::regex_search(line, allowed)) << path << ": " << line;
    }
  }
}

TEST(House, FilesAreSmallAndSayWhoseTheyAre) {
  for (const fs::path& path : sources(everything)) {
    const std::vector<std::string> lines = read_lines(path);
    EXPECT_LE(lines.size(), 500u) << path;
    ASSERT_FALSE(lines.empty()) << path;
    EXPECT_NE(lines[0].find("SPDX-License-Identifier"), std::string::npos) << path;
  }
}

std::size_t columns(const std::string& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; }));  // UTF-8
}

/// Texts in raw strings are as long as what they stand for.
TEST(House, CodeHas120Columns) {
  for (const fs::path& path : sources(everything)) {
    bool is_text = false;
    for (const std::string& line : read_lines(path)) {
      const bool opens = line.find("R\"") != std::string::npos;
      EXPECT_TRUE(is_text || opens || columns(line) <= 120) << path << ": " << line;
      if (opens) is_text = true;
      if (is_text && line.find(")\"") != std::string::npos) is_text = false;
    }
  }
}

/// All that is written for people.
std::vector<fs::path> pages() {
  std::vector<fs::path> result;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().extension() == ".md" && entry.path().string().find("/build") == std::string::npos)
      result.push_back(entry.path());
  }
  return result;
}

/// The lines of a page, without texts between lines of ```.
std::vector<std::string> prose(const fs::path& page) {
  std::vector<std::string> result;
  bool is_text = false;
  for (const std::string& line : read_lines(page)) {
    if (line.starts_with("```")) is_text = !is_text;
    if (!is_text && !line.starts_with("```")) result.push_back(line);
  }
  return result;
}

/// Tables aside.
TEST(House, ProseHas120Columns) {
  for (const fs::path& page : pages()) {
    for (const std::string& line : prose(page))
      EXPECT_TRUE(line.starts_with("|") || columns(line) <= 120) << page << ": " << line;
  }
  EXPECT_GT(pages().size(), 10u);
}

/// What stands behind # in a link to a heading.
std::string anchor(const std::string& heading) {
  std::string result;
  for (const char c : heading.substr(heading.find(' ') + 1)) {
    if (c == ' ') result += '-';
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return result;
}

std::set<std::string> anchors(const fs::path& page) {
  std::set<std::string> result;
  for (const std::string& line : prose(page)) {
    if (line.starts_with("#")) result.insert(anchor(line));
  }
  return result;
}

TEST(House, LinksOfPagesLeadSomewhere) {
  const std::regex link(R"re((?:\]\(|<img src=")([^)"\s#]*)(#[^)\s]*)?[)"])re");
  int followed = 0;
  for (const fs::path& page : pages()) {
    for (const std::string& line : prose(page)) {
      for (auto match = std::sregex_iterator(line.begin(), line.end(), link); match != std::sregex_iterator();
           ++match) {
        const std::string file = (*match)[1], place = (*match)[2];
        if (file.starts_with("http")) continue;
        ++followed;
        const fs::path target = file.empty() ? page : page.parent_path() / file;
        EXPECT_TRUE(fs::exists(target)) << page << ": " << match->str();
        if (!place.empty()) EXPECT_TRUE(anchors(target).contains(place.substr(1))) << page << ": " << match->str();
      }
    }
  }
  EXPECT_GT(followed, 100);
}

/// The line that the head of a function begins in which ends in line `last`, `) ... {`: what goes on is indented more.
std::size_t first_line_of_head(const std::vector<std::string>& lines, std::size_t last) {
  const auto indent = [](const std::string& line) { return line.find_first_not_of(' '); };
  std::size_t first = last;
  while (first > 0 && indent(lines[first]) >= 4 && !lines[first - 1].ends_with(";") &&
         !lines[first - 1].ends_with("{") && !lines[first - 1].ends_with("}"))
    --first;
  return first;
}

/// Length of functions by indentation: from the first line of a head that ends in `) ... {` to the `}` below it.
TEST(House, FunctionsAreShort) {
  const std::regex closed(R"(.*\)( const)?( noexcept)?( override)?( ->.*)? \{$)");
  const std::regex opening(R"(^( {0,4})[A-Za-z~][^=]*\(.*)");
  const std::regex not_a_function(
      R"(^\s*(if|for|while|switch|return|match|match_some|namespace|struct|class|enum|TEST)\b)");
  int longest = 0;
  for (const fs::path& path : sources({"compiler", "runtime", "tools"})) {
    const std::vector<std::string> lines = read_lines(path);
    for (size_t i = 0; i < lines.size(); ++i) {
      std::smatch match;
      if (!std::regex_match(lines[i], closed)) continue;
      const size_t first = first_line_of_head(lines, i);
      if (!std::regex_match(lines[first], match, opening) || std::regex_search(lines[first], not_a_function)) continue;
      const std::string closing = match[1].str() + "}";
      size_t end = i + 1;
      while (end < lines.size() && !lines[end].starts_with(closing)) ++end;
      const int length = static_cast<int>(end - first) + 1;
      EXPECT_LE(length, 60) << path << ":" << first + 1 << ": " << lines[first];
      longest = std::max(longest, length);
    }
  }
  EXPECT_GT(longest, 50);  // it sees them
}

/// So that `ls` of a room fits a screen. Public headers stay where hosts include them from.
TEST(House, FoldersFitAScreen) {
  constexpr int most_entries = 25;
  const std::set<std::string> exceptions{"runtime/include/dpde/runtime", "tools/dpde"};
  int checked = 0;
  for (const char* const room : {"compiler", "runtime", "tools"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      if (!entry.is_directory()) continue;
      ++checked;
      const auto entries = std::distance(fs::directory_iterator(entry.path()), fs::directory_iterator());
      const std::string name = fs::relative(entry.path(), root).generic_string();
      EXPECT_EQ(entries > most_entries, exceptions.contains(name)) << name << " has " << entries << " entries";
    }
  }
  EXPECT_GT(checked, 50);
}

TEST(House, TopLevelHoldsWhatIsAgreed) {
  const std::set<std::string> agreed{"CMakeLists.txt", "CMakePresets.json", "README.md", "LICENSE", "compiler",
                                     "runtime",        "dsl-examples",      "tests",     "tools"};
  for (const auto& entry : fs::directory_iterator(root)) {
    const std::string name = entry.path().filename();
    if (name.starts_with(".") || name.starts_with("build") || name == "dpde-out") continue;
    EXPECT_TRUE(agreed.contains(name)) << name;
  }
}

}  // namespace
