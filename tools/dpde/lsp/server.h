// SPDX-License-Identifier: Apache-2.0
// The language server protocol, version 3.17, with the capabilities stated in initialize: full-text synchronisation,
// diagnostics, hover, definition, references, rename, signature help, inlay hints, completion, formatting, symbols.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "lsp/document.h"

namespace dpde::lsp {

class Server {
 public:
  using Send = std::function<void(const Json&)>;
  Server(Send send, OrderText order, std::string version)
      : send_(std::move(send)), order_(std::move(order)), version_(std::move(version)) {}

  /// Handles one message. Never throws; an invalid request is answered by an error.
  void handle(const std::string& message);
  /// Publishes diagnostics of changed texts while no message waits: first the fast ones, then all. Stops if
  /// `is_waiting` returns true.
  void settle(const std::function<bool()>& is_waiting = {});

  bool has_ended() const { return has_ended_; }
  /// 0 if shutdown came before exit.
  int status() const { return was_shut_down_ ? 0 : 1; }

 private:
  void take(const Json& message);
  void notify(const std::string& method, const Json& parameters);
  void look_at(Document& document, Depth depth, const std::function<bool()>& is_waiting = {}) const;
  Json answer(const std::string& method, const Json& parameters);
  Json initialize(const Json& parameters);
  Json definition(const Json& parameters);
  Json references(const Json& parameters);
  Json rename(const Json& parameters);
  Json formatting(const Json& parameters);
  Json symbols(const Json& parameters);
  void publish(const Document& document) const;
  void fail(const Json& id, int code, const std::string& what) const;
  Document& document(const Json& parameters);

  Send send_;
  OrderText order_;
  std::string version_;
  std::map<std::string, Document> documents_;  // by URI
  bool in_bytes_ = false, is_initialized_ = false, was_shut_down_ = false, has_ended_ = false;
};

}  // namespace dpde::lsp
