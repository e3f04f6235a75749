// SPDX-License-Identifier: Apache-2.0
// An editor that speaks to the server in its own process.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "lsp/server.h"
#include "model/model.h"

namespace dpde::lsp {

inline const char* const rod_text = R"(model heat {
  field u
  param k = 0.3
  dt(u) = k*lap(u)
}
scheme ftcs { lap = central(2); time = euler }
scene rod : heat with ftcs {
  grid x = 0 .. 1, cells 16, periodic
  initial u = sin(2*pi*x)
  time 0 .. 1, step 1/512
}
task find : rod {
  unknown k from 0.25
  minimise mean(u^2) at t = 1
  using lbfgs(), iterations 5
}
)";

class Client {
 public:
  explicit Client(bool in_bytes = false)
      : server([this](const Json& message) { sent.push_back(message); },
               [](const model::Problem& problem) { return "steps: " + std::to_string(problem.steps); }, "dpde 0.1") {
    Json parameters = Json::object();
    if (in_bytes) parameters["capabilities"]["general"]["positionEncodings"] = Json::array({"utf-16", "utf-8"});
    initialized = request("initialize", parameters);
  }

  Json request(const std::string& method, const Json& parameters) {
    const int id = ++last_id_;
    server.handle(Json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", parameters}}.dump());
    for (const Json& message : sent) {
      if (message.contains("id") && message.at("id") == id) return message;
    }
    ADD_FAILURE() << method << " was not answered";
    return {};
  }
  void notify(const std::string& method, const Json& parameters) {
    server.handle(Json{{"jsonrpc", "2.0"}, {"method", method}, {"params", parameters}}.dump());
  }

  void open(const std::string& text) {
    notify("textDocument/didOpen",
           {{"textDocument", {{"uri", uri}, {"languageId", "dpde"}, {"version", 1}, {"text", text}}}});
  }
  void change(const std::string& text) {
    notify("textDocument/didChange", {{"textDocument", {{"uri", uri}, {"version", 2}}},
                                      {"contentChanges", Json::array({Json{{"text", text}, {"rangeLength", 0}}})}});
  }
  /// Where `mark` stands in the text, and `behind` bytes more. ASCII alone.
  static Json place(const std::string& text, const std::string& mark, std::size_t behind = 0) {
    const std::size_t at = text.find(mark) + behind;
    const std::size_t begin = text.rfind('\n', at == 0 ? 0 : at - 1);
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    return {{"line", line}, {"character", begin == std::string::npos ? at : at - begin - 1}};
  }
  Json at(const Json& position) const { return {{"textDocument", {{"uri", uri}}}, {"position", position}}; }

  /// The diagnostics of the last text.
  Json diagnostics() {
    server.settle();
    for (auto message = sent.rbegin(); message != sent.rend(); ++message) {
      if (message->contains("method") && message->at("method") == Json("textDocument/publishDiagnostics"))
        return message->at("params").at("diagnostics");
    }
    ADD_FAILURE() << "no diagnostics";
    return {};
  }
  std::string hover(const std::string& text, const std::string& mark, std::size_t behind = 0) {
    const Json result = request("textDocument/hover", at(place(text, mark, behind)))["result"];
    return result.is_null() ? "" : result.at("contents").at("value").get<std::string>();
  }
  /// What may stand behind `mark`, when the text is as long as that.
  std::set<std::string> completions(const std::string& text, const std::string& mark) {
    const Json answer = request("textDocument/completion", at(place(text, mark, mark.size())));
    std::set<std::string> labels;
    for (const Json& item : answer.at("result").at("items")) labels.insert(item.at("label").get<std::string>());
    return labels;
  }

  std::vector<Json> sent;
  Json initialized;
  std::string uri = "file:///nowhere/rod.dpde";
  Server server;

 private:
  int last_id_ = 0;
};

inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

}  // namespace dpde::lsp
