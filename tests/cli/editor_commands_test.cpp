// SPDX-License-Identifier: Apache-2.0
// Commands for editors, shells and man: lsp, fmt -, completion, man, --version.
#include <fmt/format.h>

#include "command_support.h"
#include "manual_search.h"

namespace dpde::testing {
namespace {

class EditorCommands : public Command {
 protected:
  static std::string framed(const Json& message) {
    const std::string body = message.dump();
    return fmt::format("Content-Length: {}\r\n\r\n{}", body.size(), body);
  }
  static Json request(int id, const std::string& method, const Json& parameters) {
    return {{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", parameters}};
  }
  static std::string opening(const std::string& text) {
    const Json document = {{"uri", "file:///nowhere/rod.dpde"}, {"languageId", "dpde"}, {"version", 1}, {"text", text}};
    return framed(request(1, "initialize", Json::object())) +
           framed({{"jsonrpc", "2.0"}, {"method", "initialized"}, {"params", Json::object()}}) +
           framed({{"jsonrpc", "2.0"}, {"method", "textDocument/didOpen"}, {"params", {{"textDocument", document}}}});
  }
  static std::string closing() {
    return framed(request(9, "shutdown", nullptr)) + framed({{"jsonrpc", "2.0"}, {"method", "exit"}});
  }
  /// The messages of the answer.
  static std::vector<Json> unframed(const std::string& out) {
    std::vector<Json> messages;
    for (std::size_t at = 0; at < out.size();) {
      const std::size_t length = std::stoul(out.substr(at + std::string("Content-Length: ").size()));
      const std::size_t body = out.find("\r\n\r\n", at) + 4;
      const std::optional<Json> message = parse_json(out.substr(body, length));
      EXPECT_TRUE(message.has_value()) << out;
      messages.push_back(message.value_or(Json()));
      at = body + length;
    }
    return messages;
  }
};

TEST_F(EditorCommands, TheServerSpeaksTheProtocol) {
  std::string text = rod_text;
  text.replace(text.find("k*lap(u)"), 8, "kk*lap(u)");
  write("in", opening(text) + closing());
  const Outcome served = shell("$DPDE lsp --stdio < in");
  EXPECT_EQ(served.status, 0) << served.err;
  const std::vector<Json> messages = unframed(served.out);
  ASSERT_EQ(messages.size(), 3u) << served.out;
  EXPECT_EQ(messages[0]["result"]["serverInfo"]["name"], Json("dpde"));
  EXPECT_EQ(messages[1]["params"]["diagnostics"][0]["code"], Json("E0301")) << messages[1];
  EXPECT_EQ(messages[2]["id"], 9);
}

TEST_F(EditorCommands, TheServerEndsWithItsInput) {
  write("in", "what is this?\n\nContent-Length: x\r\n\r\n" + opening(rod_text) + "Content-Length: 99\r\n\r\nhalf");
  const Outcome served = shell("$DPDE lsp < in");
  EXPECT_EQ(served.status, 1);
  EXPECT_EQ(unframed(served.out).at(0)["id"], 1) << served.out;
  write("garbage", "Content-Length: 3\r\n\r\n{{{" + framed({{"jsonrpc", "2.0"}, {"method", "exit"}}));
  const Outcome garbage = shell("$DPDE lsp < garbage");
  EXPECT_EQ(garbage.status, 1);
  EXPECT_EQ(unframed(garbage.out).at(0)["error"]["code"], -32700) << garbage.out;
  EXPECT_EQ(dpde("lsp").status, 1);
}

TEST_F(EditorCommands, FormatsStandardInput) {
  write("loose.dpde", "model heat { field u\n param k\n   dt(u) = k * lap( u ) }\n");
  const Outcome piped = shell("$DPDE fmt - < loose.dpde");
  EXPECT_EQ(piped.status, 0) << piped.err;
  ASSERT_EQ(dpde("fmt loose.dpde").status, 0);
  EXPECT_EQ(piped.out, content(path("loose.dpde")));
  EXPECT_EQ(shell("$DPDE fmt --check - < loose.dpde").status, 0);
  EXPECT_EQ(shell("echo 'model m {field u}' | $DPDE fmt --check -").status, 1);
  EXPECT_EQ(shell("echo 'model m {field u}' | $DPDE fmt - --json").json()["text"], Json("model m { field u }\n"));
  const Outcome broken = shell("echo 'model m {' | $DPDE fmt -");
  EXPECT_EQ(broken.status, 2);
  EXPECT_EQ(broken.out, "");
  EXPECT_NE(broken.err.find("standard input:1:"), std::string::npos) << broken.err;
}

TEST_F(EditorCommands, CompletesInShells) {
  for (const char* name : {"bash", "zsh", "fish"}) {
    const Outcome script = dpde(std::string("completion ") + name);
    EXPECT_EQ(script.status, 0) << script.err;
    for (const char* word : {"optimize", "interpreter", "checkpoint-every"})
      EXPECT_NE(script.out.find(word), std::string::npos) << name << ": " << word;
  }
  EXPECT_EQ(dpde("completion tcsh").status, 2);
  write("rod.dpde", rod_text);
  const auto completed = [&](const std::string& words, int current) {
    return shell(fmt::format("cat > ask <<'end'\nsource <($1 completion bash)\nCOMP_WORDS=({}); COMP_CWORD={}\n"
                             "compopt() {{ :; }}\n_dpde; echo \"${{COMPREPLY[*]}}\"\nend\nbash ask $DPDE",
                             words, current))
        .out;
  };
  EXPECT_EQ(completed("dpde opt", 1), "optimize\n");
  EXPECT_EQ(completed("dpde run rod.dpde ''", 3), "rod find\n");
  EXPECT_EQ(completed("dpde run rod.dpde --backend ''", 4), "jit cpp interpreter\n");
  EXPECT_EQ(completed("dpde run rod.dpde --prog", 3), "--progress\n");
  EXPECT_EQ(completed("dpde completion ''", 2), "bash zsh fish\n");
  EXPECT_EQ(completed("dpde run ro", 2), "rod.dpde\n");
}

TEST_F(EditorCommands, HasAManualPage) {
  const Outcome page = dpde("man");
  EXPECT_EQ(page.status, 0);
  EXPECT_TRUE(page.out.starts_with(".TH DPDE 1")) << page.out.substr(0, 80);
  for (const char* part : {".SS \"dpde verify\"", "\\fB\\-\\-threads\\fR", ".SH ENVIRONMENT"})
    EXPECT_NE(page.out.find(part), std::string::npos) << part;
  EXPECT_EQ(shell("command -v groff >/dev/null || exit 0; $DPDE man | groff -man -Tutf8 -ww -z").err, "");
}

TEST_F(EditorCommands, TellsItsVersion) {
  const Outcome told = dpde("--version");
  EXPECT_EQ(told.status, 0);
  for (const char* line : {"dpde 0.1\n", "\ncommit ", "\nLLVM 19.1", "\nprocessor "})
    EXPECT_NE(told.out.find(line), std::string::npos) << told.out;
}

/// Builds install these files, so that they run nothing that they have built: tools/bless shells writes them.
TEST_F(EditorCommands, InstalledTextsOfShellsAreTheirs) {
  const fs::path shells = fs::path(DPDE_SOURCE_DIR) / "tools/shells";
  for (const auto& [command, file] : {std::pair("man", "dpde.1"), std::pair("completion bash", "dpde"),
                                      std::pair("completion zsh", "_dpde"), std::pair("completion fish", "dpde.fish")})
    EXPECT_TRUE(content(shells / file) == dpde(command).out) << "dpde " << command << ": tools/bless shells";
}

TEST_F(EditorCommands, HelpSearchesTheManual) {
  const Outcome upwind = dpde("help upwind");
  EXPECT_EQ(upwind.status, 0);
  EXPECT_NE(upwind.out.find("schemes.md, Advection\n"), std::string::npos) << upwind.out;
  EXPECT_NE(upwind.out.find("more places, in "), std::string::npos);
  for (const std::string mark : {"](", "**", "<!--", "```"})
    EXPECT_EQ(upwind.out.find(mark), std::string::npos) << mark;
  EXPECT_LE(std::ranges::count(upwind.out, '\n'), 80);
  EXPECT_EQ(dpde("help UPWIND").out, upwind.out);
  EXPECT_TRUE(dpde("help rk4").out.find("`rk4`") != std::string::npos);
  EXPECT_EQ(dpde("help rk").status, 2) << "words, not parts of words";
  EXPECT_NE(dpde("help upwnd").err.find("did you mean upwind?"), std::string::npos);
  EXPECT_EQ(dpde("help run").out, dpde("run --help").out);
  EXPECT_EQ(dpde("help").out, dpde("--help").out);
  EXPECT_EQ(dpde("help E0301").out, dpde("explain E0301").out);
  EXPECT_EQ(dpde("help e0301").out, dpde("explain E0301").out);
  EXPECT_NE(dpde("help E9999").err.find("there is no code E9999"), std::string::npos);
  EXPECT_LE(std::ranges::count(dpde("help polar").out, '\n'), 80) << "of the grammar only the lines with the word";
  EXPECT_EQ(dpde("help ' '").status, 2);
  EXPECT_LT(dpde("help " + std::string(5000, 'x')).err.size(), 300u);
}

/// Every word that the manual sets as code is found in it.
TEST_F(EditorCommands, HelpKnowsEachWordOfTheManual) {
  const std::vector<std::string> words = tools::words_of(tools::manual_pages());
  EXPECT_GT(words.size(), 300u);
  for (const std::string& word : words) EXPECT_FALSE(tools::blocks_with(word, tools::manual_pages()).empty()) << word;
}

}  // namespace
}  // namespace dpde::testing
