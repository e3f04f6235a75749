// SPDX-License-Identifier: Apache-2.0
#include "lsp/server.h"

#include <exception>

#include "lsp/completion.h"
#include "lsp/hover.h"
#include "lsp/references.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::lsp {

namespace {

// Error codes of JSON-RPC and of the protocol.
constexpr int parse_error = -32700, invalid_request = -32600, method_not_found = -32601, invalid_params = -32602,
              internal_error = -32603, not_initialized = -32002;

constexpr int request_failed = -32803;

struct UnknownMethod {};
/// A valid request that is not carried out.
struct Refused {
  std::string why;
};

int offset_in(const Document& document, const Json& parameters) {
  return document.places().offset(parameters.at("position"));
}

/// Location of a declaration, in any file.
Json location_of(const Document& document, const DeclaredName& name) {
  const SourceFile& whole = document.whole();
  if (!whole.is_imported(name.range.begin))
    return {{"uri", document.uri()}, {"range", document.places().range(name.range)}};
  const LineColumn begin = whole.locate(name.range.begin);
  const Json on_line = TextPlaces(whole.line_at(name.range.begin), false)
                           .range({begin.column - 1, begin.column - 1 + name.range.end - name.range.begin});
  Json location = {{"uri", uri_of_path(whole.path_of(name.range.begin))}, {"range", on_line}};
  location["range"]["start"]["line"] = location["range"]["end"]["line"] = begin.line - 1;
  return location;
}

}  // namespace

void Server::handle(const std::string& message) {
  const std::optional<Json> parsed = parse_json(message);
  if (!parsed) return fail(nullptr, parse_error, "the message is no JSON");
  if (!parsed->is_object() || !parsed->contains("method") || !parsed->at("method").is_string()) {
    if (parsed->is_object() && (parsed->contains("result") || parsed->contains("error"))) return;  // a response
    return fail(nullptr, invalid_request, "the message has no method");
  }
  take(*parsed);
}

void Server::take(const Json& message) {
  const auto method = message.at("method").get<std::string>();
  const Json parameters = message.contains("params") ? message.at("params") : Json::object();
  const bool is_request = message.contains("id");
  const Json id = is_request ? message.at("id") : Json();
  try {
    if (!is_request) return notify(method, parameters);
    if (!is_initialized_ && method != "initialize") return fail(id, not_initialized, "initialize comes first");
    if (was_shut_down_) return fail(id, invalid_request, "the server was shut down");
    Json result = answer(method, parameters);
    send_({{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}});
  } catch (const UnknownMethod&) {
    fail(id, method_not_found, "there is no method " + method);
  } catch (const Refused& refused) {
    fail(id, request_failed, refused.why);
  } catch (const JsonError& error) {
    if (is_request) fail(id, invalid_params, error.what());
  } catch (const std::exception& error) {
    if (is_request) fail(id, internal_error, error.what());
  }
}

void Server::fail(const Json& id, int code, const std::string& what) const {
  send_({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", what}}}});
}

Document& Server::document(const Json& parameters) {
  const auto uri = parameters.at("textDocument").at("uri").get<std::string>();
  const auto found = documents_.find(uri);
  if (found == documents_.end()) throw JsonError("the text is not open: " + uri);
  return found->second;
}

void Server::notify(const std::string& method, const Json& parameters) {
  if (method == "exit") has_ended_ = true;
  if (!is_initialized_ || !method.starts_with("textDocument/")) return;
  const Json& text = parameters.at("textDocument");
  const auto uri = text.at("uri").get<std::string>();
  if (method == "textDocument/didOpen") {
    documents_.insert_or_assign(uri, Document(uri, in_bytes_));
    documents_.at(uri).set_text(text.at("text").get<std::string>());
  } else if (method == "textDocument/didChange") {
    const Json& changes = parameters.at("contentChanges");
    const auto found = documents_.find(uri);
    if (found != documents_.end() && !changes.empty())
      found->second.set_text(changes.back().at("text").get<std::string>());
  } else if (method == "textDocument/didClose") {
    if (documents_.erase(uri) > 0) publish(Document(uri, in_bytes_));
  }
}

Json Server::answer(const std::string& method, const Json& parameters) {
  if (method == "initialize") return initialize(parameters);
  if (method == "shutdown") {
    settle();
    was_shut_down_ = true;
    return nullptr;
  }
  if (method == "textDocument/hover") {
    Document& text = document(parameters);
    look_at(text, Depth::model);  // finds the scenes
    return hover(text, offset_in(text, parameters), order_);
  }
  if (method == "textDocument/completion") {
    const Document& text = document(parameters);
    return {{"isIncomplete", false}, {"items", completions(text, offset_in(text, parameters))}};
  }
  if (method == "textDocument/definition") return definition(parameters);
  if (method == "textDocument/references") return references(parameters);
  if (method == "textDocument/rename") return rename(parameters);
  if (method == "textDocument/signatureHelp") {
    const Document& text = document(parameters);
    return signature_help(text, offset_in(text, parameters));
  }
  if (method == "textDocument/inlayHint") {
    Document& text = document(parameters);
    look_at(text, Depth::model);
    return inlay_hints(text, order_);
  }
  if (method == "textDocument/formatting") return formatting(parameters);
  if (method == "textDocument/documentSymbol") return symbols(parameters);
  throw UnknownMethod();
}

Json Server::initialize(const Json& parameters) {
  if (parameters.contains("capabilities") && parameters.at("capabilities").contains("general")) {
    const Json& general = parameters.at("capabilities").at("general");
    if (general.contains("positionEncodings")) {
      for (const Json& encoding : general.at("positionEncodings")) in_bytes_ = in_bytes_ || encoding == Json("utf-8");
    }
  }
  is_initialized_ = true;
  Json capabilities = {{"positionEncoding", in_bytes_ ? "utf-8" : "utf-16"},
                       {"textDocumentSync", {{"openClose", true}, {"change", 1}}},
                       {"hoverProvider", true},
                       {"definitionProvider", true},
                       {"referencesProvider", true},
                       {"renameProvider", true},
                       {"inlayHintProvider", true},
                       {"signatureHelpProvider", {{"triggerCharacters", Json::array({"(", ","})}}},
                       {"completionProvider", {{"triggerCharacters", Json::array({":", "=", ","})}}},
                       {"documentFormattingProvider", true},
                       {"documentSymbolProvider", true}};
  return {{"capabilities", std::move(capabilities)}, {"serverInfo", {{"name", "dpde"}, {"version", version_}}}};
}

Json Server::definition(const Json& parameters) {
  const Document& text = document(parameters);
  const DeclaredName* name = text.find(offset_in(text, parameters));
  return name == nullptr ? Json() : location_of(text, *name);
}

Json Server::references(const Json& parameters) {
  const Document& text = document(parameters);
  const DeclaredName* name = text.find(offset_in(text, parameters));
  if (name == nullptr) return Json::array();
  const bool is_imported = text.whole().is_imported(name->range.begin);
  const bool with_declaration = !parameters.contains("context") || parameters.at("context").at("includeDeclaration");
  Json places = Json::array();
  if (is_imported && with_declaration) places.push_back(location_of(text, *name));
  for (const SourceRange use : uses_of(text, *name)) {
    if (with_declaration || use.begin != name->range.begin)
      places.push_back(Json{{"uri", text.uri()}, {"range", text.places().range(use)}});
  }
  return places;
}

Json Server::rename(const Json& parameters) {
  const Document& text = document(parameters);
  const int offset = offset_in(text, parameters);
  const auto wanted = parameters.at("newName").get<std::string>();
  const std::string why_not = why_not_renamed(text, offset, wanted);
  if (!why_not.empty()) throw Refused{why_not};
  Json edits = Json::array();
  for (const SourceRange use : uses_of(text, *text.find(offset)))
    edits.push_back(Json{{"range", text.places().range(use)}, {"newText", wanted}});
  Json changes = Json::object();
  changes[text.uri()] = std::move(edits);
  return {{"changes", std::move(changes)}};
}

/// Returns null if the text has errors.
Json Server::formatting(const Json& parameters) {
  const Document& text = document(parameters);
  DiagnosticSink sink;
  const std::string formatted = ast::print(ast::parse(text.source(), sink));
  if (sink.has_errors()) return nullptr;
  if (formatted == text.text()) return Json::array();
  const TextPlaces places = text.places();
  const Json whole = {{"start", places.position(0)}, {"end", places.position(static_cast<int>(text.text().size()))}};
  return Json::array({Json{{"range", whole}, {"newText", formatted}}});
}

/// The blocks, as an outline.
Json Server::symbols(const Json& parameters) {
  constexpr int module = 2;
  const Document& text = document(parameters);
  const TextPlaces places = text.places();
  Json rows = Json::array();
  for (const ast::Declaration& declaration : text.file().declarations) {
    const ast::Identifier* name = name_of(declaration);
    if (name == nullptr || declaration.imported) continue;
    rows.push_back(Json{{"name", name->name},
                        {"detail", word_of(declaration)},
                        {"kind", module},
                        {"range", places.range(declaration.range)},
                        {"selectionRange", places.range(name->range)}});
  }
  return rows;
}

void Server::publish(const Document& document) const {
  const Json parameters = {{"uri", document.uri()}, {"diagnostics", document.diagnostics()}};
  send_({{"jsonrpc", "2.0"}, {"method", "textDocument/publishDiagnostics"}, {"params", parameters}});
}

void Server::look_at(Document& document, Depth depth, const std::function<bool()>& is_waiting) const {
  if (!document.is_understood(depth) && document.understand(depth, is_waiting)) publish(document);
}

void Server::settle(const std::function<bool()>& is_waiting) {
  for (const Depth depth : {Depth::model, Depth::derivatives}) {
    for (auto& [uri, document] : documents_) look_at(document, depth, is_waiting);
  }
}

}  // namespace dpde::lsp
