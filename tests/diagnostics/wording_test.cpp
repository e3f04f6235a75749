// SPDX-License-Identifier: Apache-2.0
// What the command says about each file of this folder, compared with the text beside it. README.md of tests has the
// rules of these files. DPDE_BLESS=1 writes the texts instead (tools/bless).
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <regex>
#include <set>

#include "cli/command_support.h"
#include "source/error_codes.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

const fs::path folder = fs::path(DPDE_SOURCE_DIR) / "tests/diagnostics";

constexpr std::string_view command_mark = "# $ dpde ", case_mark = "#| ", part_mark = "# ---";

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

struct Case {
  std::string heading;  // "" for the file as it stands
  std::string text;
};

bool begins_with(const std::string& line, std::string_view mark) {
  return std::string_view(line).substr(std::min(line.find_first_not_of(' '), line.size())).starts_with(mark);
}

/// "12: " and the line, without what only tests read.
std::string heading_of(const std::vector<std::string>& lines, std::size_t i, std::string_view mark) {
  std::string heading = lines[i].substr(lines[i].find(mark) + mark.size());
  heading.resize(std::min(heading.find("#~"), heading.size()));
  heading.resize(heading.find_last_not_of(' ') + 1);
  return std::to_string(i + 1) + ":" + (heading.starts_with(' ') || heading.empty() ? "" : " ") + heading;
}

/// Of the lines from `begin` to `end`: they alone, and a case more for each line that begins with "#| ": there that
/// line takes the place of the line above it. Each stays where it is, so that messages tell places of the file.
void add_cases(const std::vector<std::string>& lines, std::size_t begin, std::size_t end, const std::string& heading,
               std::vector<Case>& cases) {
  std::vector<std::string> alone(lines.size());
  std::copy(lines.begin() + begin, lines.begin() + end, alone.begin() + begin);
  cases.push_back({heading, joined(alone)});
  std::size_t replaced = begin;
  for (std::size_t i = begin; i < end; ++i) {
    if (!begins_with(lines[i], case_mark)) {
      replaced = i;
      continue;
    }
    std::vector<std::string> changed = alone;
    changed[replaced] = "";
    changed[i].replace(lines[i].find(case_mark), case_mark.size(), case_mark.size(), ' ');
    cases.push_back({heading_of(lines, i, case_mark), joined(changed)});
  }
}

/// Those of each part; a line that begins with "# ---" begins the next part.
std::vector<Case> cases_of(const std::string& text) {
  const std::vector<std::string> lines = lines_of(text);
  std::vector<Case> cases;
  std::string heading;
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= lines.size(); ++i) {
    if (i < lines.size() && !lines[i].starts_with(part_mark)) continue;
    add_cases(lines, begin, i, heading, cases);
    if (i < lines.size()) heading = heading_of(lines, i, part_mark);
    begin = i;
  }
  return cases;
}

/// Those of the lines "# $ dpde ..."; without one, the file is checked.
std::vector<std::string> commands_of(const std::string& text, const std::string& file) {
  std::vector<std::string> commands;
  for (const std::string& line : lines_of(text)) {
    if (!begins_with(line, command_mark)) continue;
    const std::size_t begin = line.find(command_mark) + command_mark.size();
    commands.push_back(line.substr(begin, std::min(line.find("#~"), line.size()) - begin));
  }
  if (commands.empty()) commands.push_back("check " + file);
  return commands;
}

using Places = std::set<std::pair<int, std::string>>;  // line, code

/// At "#~ E0301" and the like. A message without a place belongs to the line of a command.
Places marked_places(const std::string& text) {
  Places marked;
  const std::regex code("[EW][0-9]{4}");
  const std::vector<std::string> lines = lines_of(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string marks = lines[i].substr(std::min(lines[i].find("#~"), lines[i].size()));
    const int place = begins_with(lines[i], command_mark) ? 0 : static_cast<int>(i + 1);
    for (std::sregex_iterator match(marks.begin(), marks.end(), code), end; match != end; ++match)
      marked.emplace(place, match->str());
  }
  return marked;
}

Places told_places(const std::string& transcript) {
  Places told;
  const std::regex place(R"(^(?:[^ :]+:(\d+):\d+: |[^ :]+: |)(?:error|warning)\[([EW]\d+)\]: .*)");
  for (const std::string& line : lines_of(transcript)) {
    std::smatch match;
    if (std::regex_match(line, match, place)) told.emplace(match[1].matched ? std::stoi(match[1]) : 0, match[2]);
  }
  return told;
}

bool is_blessing() { return setting("DPDE_BLESS", 0) != 0; }

/// Whether one of its commands takes a while.
bool has_runs(const std::string& text) {
  return std::ranges::any_of(commands_of(text, ""), [](const std::string& command) {
    return !command.starts_with("check") && !command.starts_with("emit");
  });
}

/// Without their ending. Of those with runs a part by day.
std::vector<std::string> files_of_folder() {
  std::vector<fs::path> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.path().extension() == ".dpde") all.push_back(entry.path());
  std::ranges::sort(all);
  std::vector<std::string> files;
  for (std::size_t runs = 0; const fs::path& path : all) {
    if (has_runs(content(path)) && !is_tried(runs++, 4) && !is_blessing()) continue;
    files.push_back(fs::relative(path, folder).replace_extension().generic_string());
  }
  return files;
}

class Wording : public Command, public ::testing::WithParamInterface<std::string> {
 protected:
  /// Of all commands, as the user sees it.
  std::string transcript_of(const Case& test, const std::string& file) const {
    for (const auto& entry : fs::directory_iterator(path("."))) fs::remove_all(entry.path());  // of the last case
    write(file, test.text);
    const std::vector<std::string> commands = commands_of(test.text, file);
    std::string transcript = test.heading.empty() ? "" : "\n--- " + test.heading + "\n";
    for (const std::string& command : commands) {
      const Outcome outcome = dpde(command + (command.starts_with("check ") ? " --all" : ""));  // each warning
      if (commands.size() > 1) transcript += "$ dpde " + command + "\n";
      transcript += outcome.err.empty() ? "no message\n" : outcome.err;
      EXPECT_EQ(outcome.status != 0, outcome.err.find("error[") != std::string::npos) << command << outcome.err;
    }
    return transcript;
  }
};

TEST_P(Wording, IsThatOfTheFileBeside) {
  const fs::path source = folder / (GetParam() + ".dpde"), golden = folder / (GetParam() + ".out");
  const std::string text = content(source);
  const std::vector<Case> cases = cases_of(text);
  std::string all;
  for (const Case& test : cases) all += transcript_of(test, source.filename());
  EXPECT_EQ(all.find("{}"), std::string::npos) << "a message lacks an argument";
  if (is_blessing()) std::ofstream(golden, std::ios::binary) << all;
  EXPECT_EQ(all, content(golden)) << "tools/bless " << GetParam() << " writes what is said now";
  const auto* kind = std::ranges::find(diagnostic_kinds, source.stem().string(), &DiagnosticKind::name);
  if (kind != std::end(diagnostic_kinds)) {
    EXPECT_NE(all.find("[" + std::string(kind->code) + "]"), std::string::npos) << "the file is called " << kind->name;
  }
  const Places marked = marked_places(text);
  if (!marked.empty()) EXPECT_EQ(told_places(all), marked);
}

std::string name_of(const ::testing::TestParamInfo<std::string>& info) {
  std::string name = info.param;
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

/// A text whose file is gone.
TEST(Wordings, StandBesideFiles) {
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".out") continue;
    EXPECT_TRUE(fs::exists(fs::path(entry.path()).replace_extension(".dpde"))) << entry.path();
  }
}

INSTANTIATE_TEST_SUITE_P(Diagnostics, Wording, ::testing::ValuesIn(files_of_folder()), name_of);

}  // namespace
}  // namespace dpde::testing
