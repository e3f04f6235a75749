// SPDX-License-Identifier: Apache-2.0
// The protocol: what is asked and what is answered, of texts that are whole, half written, or none.
#include <filesystem>
#include <fstream>

#include "lsp/client.h"

namespace dpde::lsp {
namespace {

TEST(LanguageServer, SaysWhatItCanDo) {
  Client client;
  const Json capabilities = client.initialized.at("result").at("capabilities");
  EXPECT_EQ(capabilities.at("positionEncoding"), Json("utf-16"));
  EXPECT_EQ(capabilities.at("textDocumentSync").at("change"), 1);
  for (const char* what : {"hoverProvider", "definitionProvider", "documentFormattingProvider"})
    EXPECT_TRUE(capabilities.at(what).get<bool>()) << what;
  EXPECT_EQ(Client(true).initialized.at("result").at("capabilities").at("positionEncoding"), Json("utf-8"));
}

TEST(LanguageServer, ShowsMistakesWithTheirEndsAndTakesThemBack) {
  Client client;
  client.open(replaced(rod_text, "k*lap(u)", "k*lap(uu)"));
  const Json rows = client.diagnostics();
  ASSERT_EQ(rows.size(), 1u) << rows;
  const Json& row = rows[0];
  EXPECT_EQ(row.at("code"), Json("E0301"));
  EXPECT_EQ(row.at("severity"), 1);
  EXPECT_EQ(row.at("range").at("start"), (Json{{"line", 3}, {"character", 16}}));
  EXPECT_EQ(row.at("range").at("end"), (Json{{"line", 3}, {"character", 18}}));
  EXPECT_NE(row.at("message").get<std::string>().find("help: did you mean u?"), std::string::npos) << row;
  client.change(rod_text);
  EXPECT_EQ(client.diagnostics(), Json::array());
}

TEST(LanguageServer, CountsCharactersAsEditorsDo) {
  Client client, in_bytes(true);
  for (Client* one : {&client, &in_bytes}) one->open(replaced(rod_text, "16, periodic", "16, \xF0\x9F\x98\x80 perio"));
  const Json utf16 = client.diagnostics()[0].at("range"), bytes = in_bytes.diagnostics()[0].at("range");
  EXPECT_EQ(utf16.at("end").at("character").get<int>() - utf16.at("start").at("character").get<int>(), 2) << utf16;
  EXPECT_EQ(bytes.at("end").at("character").get<int>() - bytes.at("start").at("character").get<int>(), 4) << bytes;
}

/// Typing goes before what takes long.
TEST(LanguageServer, StopsWhereAMessageWaits) {
  Client client;
  client.open(rod_text);
  client.sent.clear();
  int asked = 0;
  client.server.settle([&] { return ++asked > 2; });  // between the task and the derivatives
  EXPECT_EQ(client.sent.size(), 1u);
  client.server.settle([] { return true; });
  EXPECT_EQ(client.sent.size(), 1u);
  client.server.settle();
  EXPECT_EQ(client.sent.size(), 2u);
  client.server.settle();
  EXPECT_EQ(client.sent.size(), 2u);
}

/// Mistakes that only lowering and derivatives find are told, and those of charts.
TEST(LanguageServer, FindsWhatCheckFinds) {
  Client client;
  client.open(replaced(rod_text, "minimise mean(u^2)", "minimise mean(floor(u))"));
  EXPECT_GE(client.diagnostics().size(), 1u);
  client.change(std::string(rod_text) + "chart cost : rod { vary cells in 16, 32; vary tim in rk4 }\n");
  EXPECT_GE(client.diagnostics().size(), 1u);
}

TEST(LanguageServer, LeavesFilesForOthersAlone) {
  Client client;
  client.open("model heat {\n  field u\n  dt(u) = lap(u)\n}\n");
  EXPECT_EQ(client.diagnostics(), Json::array());
  client.change("");
  EXPECT_EQ(client.diagnostics(), Json::array());
}

TEST(LanguageServer, GoesToDefinitions) {
  const std::string text = rod_text;
  Client client;
  client.open(text);
  const auto line_of = [&](const std::string& mark, std::size_t behind) {
    const Json result =
        client.request("textDocument/definition", client.at(Client::place(text, mark, behind))).at("result");
    return result.is_null() ? -1 : result.at("range").at("start").at("line").get<int>();
  };
  EXPECT_EQ(line_of("lap(u)", 4), 1);
  EXPECT_EQ(line_of("unknown k", 8), 2);
  EXPECT_EQ(line_of("minimise mean(u", 14), 1);
  EXPECT_EQ(line_of("rod : heat", 6), 0);
  EXPECT_EQ(line_of("with ftcs", 7), 5);
  EXPECT_EQ(line_of("find : rod", 8), 6);
  EXPECT_EQ(line_of("lap(u)", 1), -1);
}

TEST(LanguageServer, KnowsImportedFiles) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(::testing::TempDir()) / "dpde lsp";
  fs::create_directories(folder);
  const std::string text = rod_text, model = text.substr(0, text.find("scheme"));
  std::ofstream(folder / "heat model.dpde") << model;
  const std::string scene = "import \"heat model.dpde\"\n" + text.substr(model.size());
  Client client;
  client.uri = uri_of_path((folder / "rod.dpde").string());
  EXPECT_NE(client.uri.find("dpde%20lsp"), std::string::npos) << client.uri;
  client.open(scene);
  EXPECT_EQ(client.diagnostics(), Json::array());
  const Json found =
      client.request("textDocument/definition", client.at(Client::place(scene, "unknown k", 8))).at("result");
  EXPECT_EQ(path_of_uri(found.at("uri").get<std::string>()), (folder / "heat model.dpde").string());
  EXPECT_EQ(found.at("range").at("start"), (Json{{"line", 2}, {"character", 8}}));
  std::ofstream(folder / "heat model.dpde") << replaced(model, "lap(u)", "lap(v)");
  client.change(scene);
  const Json rows = client.diagnostics();
  ASSERT_EQ(rows.size(), 1u) << rows;
  EXPECT_EQ(rows[0].at("range").at("start"), (Json{{"line", 0}, {"character", 7}})) << rows;
  EXPECT_NE(rows[0].at("message").get<std::string>().find("heat model.dpde:4:"), std::string::npos) << rows;
  fs::remove_all(folder);
}

TEST(LanguageServer, FormatsWholeTextsOnly) {
  Client client;
  const Json options = {{"textDocument", {{"uri", client.uri}}}, {"options", {{"tabSize", 2}}}};
  client.open(rod_text);
  EXPECT_EQ(client.request("textDocument/formatting", options).at("result"), Json::array());
  client.change(replaced(rod_text, "  field u", "field   u"));
  const Json edits = client.request("textDocument/formatting", options).at("result");
  ASSERT_EQ(edits.size(), 1u);
  EXPECT_EQ(edits[0].at("newText"), Json(rod_text));
  client.change(replaced(rod_text, "field u", "field"));
  EXPECT_TRUE(client.request("textDocument/formatting", options).at("result").is_null());
}

TEST(LanguageServer, ListsBlocks) {
  Client client;
  client.open(rod_text);
  const Json rows =
      client.request("textDocument/documentSymbol", {{"textDocument", {{"uri", client.uri}}}}).at("result");
  ASSERT_EQ(rows.size(), 4u);
  EXPECT_EQ(rows[2].at("name"), Json("rod"));
  EXPECT_EQ(rows[2].at("detail"), Json("scene"));
}

/// Every beginning of a text, as it is typed: an answer to each question, and never an exception.
TEST(LanguageServer, BearsHalfWrittenTexts) {
  const std::string text = rod_text;
  Client client;
  client.open("");
  for (std::size_t length = 0; length <= text.size(); length += 3) {
    const std::string typed = text.substr(0, length);
    client.change(typed);
    for (const Json& row : client.diagnostics())
      EXPECT_LE(row.at("range").at("start").at("line"), row.at("range").at("end").at("line"));
    const Json here = client.at(Client::place(typed, "", length));
    for (const char* method : {"textDocument/hover", "textDocument/completion", "textDocument/definition"})
      EXPECT_TRUE(client.request(method, here).contains("result")) << method << " in\n" << typed;
    client.sent.clear();
  }
}

TEST(LanguageServer, AnswersGarbageWithErrors) {
  Client client;
  const auto code_of = [&](const std::string& message) {
    client.sent.clear();
    client.server.handle(message);
    return client.sent.empty() || !client.sent.back().contains("error")
               ? 0
               : client.sent.back().at("error").at("code").get<int>();
  };
  EXPECT_EQ(code_of("{"), -32700);
  EXPECT_EQ(code_of("\xFF\xFE"), -32700);
  EXPECT_EQ(code_of(std::string(5000, '[')), -32700);
  EXPECT_EQ(code_of("[]"), -32600);
  EXPECT_EQ(code_of("{\"id\": 1}"), -32600);
  EXPECT_EQ(code_of(R"({"id": 1, "method": 5})"), -32600);
  EXPECT_EQ(code_of(R"({"id": 1, "method": "textDocument/brew"})"), -32601);
  EXPECT_EQ(code_of(R"({"id": 1, "method": "textDocument/hover"})"), -32602);
  EXPECT_EQ(code_of(R"({"id": 1, "method": "textDocument/hover", "params": {"textDocument": {"uri": "a"}}})"), -32602);
  EXPECT_EQ(code_of(R"({"id": 1, "method": "textDocument/hover", "params": [1]})"), -32602);
  EXPECT_EQ(code_of(R"({"method": "textDocument/didOpen", "params": {}})"), 0);
  EXPECT_EQ(code_of(R"({"method": "textDocument/didChange", "params": {"textDocument": 5}})"), 0);
  EXPECT_EQ(code_of(R"({"id": 7, "result": null})"), 0);
  client.open(rod_text);
  for (const char* position : {R"({"line": -5, "character": -1})", R"({"line": 99999, "character": 3})",
                               R"({"line": 1, "character": 99999})", R"({"line": 9e18, "character": -9e18})"}) {
    client.sent.clear();
    client.server.handle(R"({"id": 1, "method": "textDocument/completion", "params": {"textDocument": {"uri": ")" +
                         client.uri + R"("}, "position": )" + position + "}}");
    ASSERT_EQ(client.sent.size(), 1u);
    EXPECT_TRUE(client.sent[0].contains("result")) << client.sent[0];
  }
}

TEST(LanguageServer, EndsInOrder) {
  Client client;
  EXPECT_TRUE(client.request("shutdown", nullptr).at("result").is_null());
  EXPECT_TRUE(client.request("textDocument/hover", client.at({{"line", 0}, {"character", 0}})).contains("error"));
  client.notify("exit", nullptr);
  EXPECT_TRUE(client.server.has_ended());
  EXPECT_EQ(client.server.status(), 0);
  Client hasty;
  hasty.notify("exit", nullptr);
  EXPECT_TRUE(hasty.server.has_ended());
  EXPECT_EQ(hasty.server.status(), 1);
}

}  // namespace
}  // namespace dpde::lsp
