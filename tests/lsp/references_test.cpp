// SPDX-License-Identifier: Apache-2.0
// Uses of names, renaming, signatures of calls, hints in the text.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include "client.h"

namespace dpde::lsp {
namespace {

/// The text after the edits of a rename.
std::string edited(std::string text, const Json& edits) {
  std::vector<std::pair<std::size_t, std::string>> parts;
  for (const Json& edit : edits) {
    std::size_t at = 0;
    for (int line = 0; line < edit.at("range").at("start").at("line").get<int>(); ++line) at = text.find('\n', at) + 1;
    const auto begin = edit.at("range").at("start").at("character").get<std::size_t>();
    const auto end = edit.at("range").at("end").at("character").get<std::size_t>();
    parts.emplace_back(at + begin, std::string(end - begin, '~') + edit.at("newText").get<std::string>());
  }
  std::ranges::sort(parts, std::greater<>());
  for (const auto& [at, part] : parts) {
    const std::size_t length = part.rfind('~') + 1;
    text.replace(at, length, part.substr(length));
  }
  return text;
}

struct Asked {
  Client client;
  std::string text;
  explicit Asked(std::string with) : text(std::move(with)) { client.open(text); }

  Json rename(const std::string& mark, std::size_t behind, const std::string& wanted) {
    Json parameters = client.at(Client::place(text, mark, behind));
    parameters["newName"] = wanted;
    return client.request("textDocument/rename", parameters);
  }
  std::string renamed(const std::string& mark, std::size_t behind, const std::string& wanted) {
    const Json answer = rename(mark, behind, wanted);
    EXPECT_TRUE(answer.contains("result")) << answer;
    return answer.contains("result") ? edited(text, answer.at("result").at("changes").at(client.uri)) : "";
  }
  int code(const std::string& mark, std::size_t behind, const std::string& wanted) {
    const Json answer = rename(mark, behind, wanted);
    return answer.contains("error") ? answer.at("error").at("code").get<int>() : 0;
  }
  Json request(const std::string& method, const std::string& mark, std::size_t behind) {
    return client.request("textDocument/" + method, client.at(Client::place(text, mark, behind))).at("result");
  }
};

TEST(LanguageServer, FindsAllUses) {
  Asked rod(rod_text);
  const auto lines_of = [&](const std::string& mark, std::size_t behind) {
    std::vector<int> lines;
    for (const Json& place : rod.request("references", mark, behind))
      lines.push_back(place.at("range").at("start").at("line").get<int>());
    return lines;
  };
  EXPECT_EQ(lines_of("lap(u)", 4), (std::vector{1, 3, 3, 8, 13}));
  EXPECT_EQ(lines_of("unknown k", 8), (std::vector{2, 3, 12}));
  EXPECT_EQ(lines_of("find : rod", 8), (std::vector{6, 11}));
  EXPECT_EQ(lines_of("sin(", 1), std::vector<int>());
}

TEST(LanguageServer, RenamesAllUsesAndNothingElse) {
  Asked rod(rod_text);
  const std::string renamed = rod.renamed("param k", 6, "kappa");
  EXPECT_EQ(renamed, replaced(replaced(replaced(rod_text, "param k", "param kappa"), "= k*", "= kappa*"), "unknown k",
                              "unknown kappa"));
  // A field of the same name in another model, and a component behind a dot, stay.
  const std::string two =
      "model a { vector u; dt(u) = -u }\nmodel b { field u, x1; dt(u) = u; dt(x1) = u }\n"
      "scene s : a { grid x = 0 .. 1, cells 4, periodic; initial u = (x, 0); observe n = max(u.x); "
      "time 0 .. 1, step 0.1 }\n";
  Asked both(two);
  EXPECT_EQ(both.renamed("vector u", 7, "v"),
            "model a { vector v; dt(v) = -v }\nmodel b { field u, x1; dt(u) = u; dt(x1) = u }\n"
            "scene s : a { grid x = 0 .. 1, cells 4, periodic; initial v = (x, 0); observe n = max(v.x); "
            "time 0 .. 1, step 0.1 }\n");
  EXPECT_EQ(both.renamed("field u, x1", 9, "y1"),
            replaced(replaced(two, "field u, x1", "field u, y1"), "dt(x1)", "dt(y1)"));
}

/// What would hit other names is refused, as are names that are none and words of the language.
TEST(LanguageServer, RefusesToRename) {
  constexpr int request_failed = -32803;
  Asked rod(rod_text);
  EXPECT_EQ(rod.code("param k", 6, "u"), request_failed);
  EXPECT_EQ(rod.code("param k", 6, "2k"), request_failed);
  EXPECT_EQ(rod.code("param k", 6, ""), request_failed);
  EXPECT_EQ(rod.code("param k", 6, "pi"), request_failed);
  EXPECT_EQ(rod.code("grid x", 5, "s"), request_failed);
  EXPECT_EQ(rod.code("sin(", 1, "cos"), request_failed);
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "dpde renaming";
  fs::create_directories(folder);
  const std::string text = rod_text, model = text.substr(0, text.find("scheme"));
  std::ofstream(folder / "heat.dpde") << model;
  Client client;
  client.uri = uri_of_path((folder / "rod.dpde").string());
  const std::string scene = "import \"heat.dpde\"\n" + text.substr(model.size());
  client.open(scene);
  client.diagnostics();
  Json parameters = client.at(Client::place(scene, "unknown k", 8));
  parameters["newName"] = "kappa";
  const Json answer = client.request("textDocument/rename", parameters);
  ASSERT_TRUE(answer.contains("error")) << answer;
  EXPECT_NE(answer.at("error").at("message").get<std::string>().find("rename it there"), std::string::npos) << answer;
}

TEST(LanguageServer, TellsSignaturesOfCalls) {
  Asked rod(std::string("function twice(a, b) = 2*a + b\n") + rod_text);
  const Json mean = rod.request("signatureHelp", "mean(u", 5);
  ASSERT_FALSE(mean.is_null());
  EXPECT_NE(mean.at("signatures")[0].at("label").get<std::string>().find("mean("), std::string::npos) << mean;
  EXPECT_TRUE(rod.request("signatureHelp", "grid x", 5).is_null());
  Asked own("function twice(a, b) = 2*a + b\nmodel m { field u; dt(u) = twice(max(u, 0), u) }\n");
  const Json second = own.request("signatureHelp", "0), u)", 4);
  EXPECT_NE(second.at("signatures")[0].at("label").get<std::string>().find("twice(a, b)"), std::string::npos) << second;
  EXPECT_EQ(second.at("activeParameter"), 1);
  EXPECT_EQ(own.request("signatureHelp", "u, 0)", 3).at("activeParameter"), 1) << "of max";
}

TEST(LanguageServer, HintsShowOrdersAndUnits) {
  Asked rod(replaced(replaced(rod_text, "field u", "field u in K"), "  time 0 .. 1",
                     "  observe heat = max(u)\n  time 0 .. 1"));
  const Json hints =
      rod.client.request("textDocument/inlayHint", {{"textDocument", {{"uri", rod.client.uri}}}}).at("result");
  ASSERT_EQ(hints.size(), 2u) << hints;
  EXPECT_EQ(hints[0].at("label"), Json("steps: 512"));
  EXPECT_EQ(hints[0].at("position").at("line"), 6);
  EXPECT_EQ(hints[1].at("label"), Json("in K"));
  EXPECT_EQ(hints[1].at("position"), Client::place(rod.text, "heat = max", 4));
}

}  // namespace
}  // namespace dpde::lsp
